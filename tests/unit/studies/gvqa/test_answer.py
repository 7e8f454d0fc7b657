"""The embedded backend's answers to a file: from its objects alone, in the challenge's form, abstentions told."""

import json
import sys
from pathlib import Path
from typing import Any

import pytest

from evaluation.baselines.direct.cassette import read
from studies.gvqa.answer import answers, main
from studies.gvqa.command import main as score
from tests.shared import SHARED
from tests.unit.services.drivelm import llama_stand_in

ANNOTATED = SHARED / "data" / "street" / "sequence" / "gvqa.json"
TAG = "<c1,CAM_FRONT,10.0,10.0>"
SECRET = "Secret."


def _file() -> dict[str, Any]:
    shown = {"Category": "Vehicle", "Status": "Moving", "Visual_description": "Red car.", "2d_bbox": [0, 0, 20, 20]}
    asked = (f"What is the observed status of object {TAG}?", f"What is the moving status of object {TAG}?", "Secret?")
    questions = {"perception": [{"Q": question, "A": SECRET} for question in asked]}
    frame = {"key_object_infos": {TAG: shown}, "QA": questions, "image_paths": {"CAM_FRONT": "a.jpg"}}
    return {"s": {"scene_description": SECRET, "key_frames": {"f": frame}}}


def test_the_annotated_answers_are_not_looked_at() -> None:
    found = answers(_file())
    assert [one.answer for one in found] == ["Moving.", "", ""]
    assert [one.family for one in found] == ["status", "moving", "other forms"]


def test_nothing_is_answered_of_a_black_picture() -> None:
    assert [one.answer for one in answers(_file(), black=True)] == ["", "", ""]


def test_a_language_model_answers_by_the_scene_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "llama_cpp", llama_stand_in.module())
    llama_stand_in.write(model := tmp_path / "tiny.gguf", {":": "S", "S": "t", "t": "o", "o": "p", "p": "."})
    (file := tmp_path / "file.json").write_text(json.dumps(_file()))
    out, kept = tmp_path / "out.json", tmp_path / "kept.jsonl"
    asks = ["--set", "prompt_backend=gguf", "--set", f"gguf.file={model}", "--set", "gguf.context=32768"]
    assert main([str(file), str(out), *asks, "--set", f"answers.record={kept}"]) == 0
    assert [one["answer"] for one in json.loads(out.read_text())] == ["Stop."] * 3
    assert {line.context for line in read(kept)} == {f"{TAG}: Red car, to the front, moving."}
    monkeypatch.delitem(sys.modules, "llama_cpp")
    assert main([str(file), str(out), "--set", "prompt_backend=gguf", "--set", f"answers.play={kept}"]) == 0
    assert main([str(file), str(out), "--set", "prompt_backend=gguf", "--set", f"answers.play={kept}", "--black"]) == 2
    assert "has no answer" in capsys.readouterr().err


def test_the_command_writes_answers_that_the_scorer_takes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, out = tmp_path / "file.json", tmp_path / "out.json"
    file.write_text(json.dumps(_file()))
    assert main([str(file), str(out)]) == 0
    assert "| all | 1 | 2 |" in capsys.readouterr().out
    assert [one["id"] for one in json.loads(out.read_text())] == ["s_f_0"]
    assert score([str(out), str(file)]) == 0
    assert "1 of 3 questions answered" in capsys.readouterr().out


def test_a_file_that_cannot_be_read_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "bad.json").write_text('{"s": {}}')
    assert main([str(tmp_path / "bad.json"), str(tmp_path / "out.json")]) == 2
    assert "s.key_frames: absent" in capsys.readouterr().err
    assert not (tmp_path / "out.json").exists()


@pytest.mark.skipif(
    not ANNOTATED.is_file(), reason="the annotated sequence lies outside the project and is absent here"
)
def test_what_is_answered_exactly_of_an_annotated_sequence_is_right(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out.json"
    assert main([str(ANNOTATED), str(out)]) == 0
    capsys.readouterr()
    assert score([str(out), str(ANNOTATED), "--json"]) == 0
    (report,) = json.loads(capsys.readouterr().out)["figures"].values()
    exact = report["scores"][0]
    assert report["answered"] >= 160
    assert exact["answered"] >= 30
    assert exact["score"] == pytest.approx(exact["answered"] / exact["asked"], abs=1e-6)


WHO = {"method": "m", "team": "t", "authors": ["A"], "email": "a@example.org", "institution": "i", "country": "c"}


def test_the_challenges_submission_is_written_and_scored(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, who, out = (tmp_path / name for name in ("file.json", "who.json", "out.json"))
    file.write_text(json.dumps(_file()), encoding="utf-8-sig")
    who.write_text(json.dumps(WHO))
    assert main([str(file), str(out), "--submission", str(who)]) == 0
    submission = json.loads(out.read_text())
    assert {name: submission[name] for name in WHO} == WHO
    assert [one["id"] for one in submission["results"]] == ["s_f_0"]
    assert score([str(out), str(file)]) == 0
    assert "1 of 3 questions answered" in capsys.readouterr().out
    who.write_text("{}")
    assert main([str(file), str(out), "--submission", str(who)]) == 2
    assert "who.json.method: absent" in capsys.readouterr().err


def test_a_submission_without_results_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file.json").write_text(json.dumps(_file()))
    (tmp_path / "out.json").write_text(json.dumps(WHO))
    assert score([str(tmp_path / "out.json"), str(tmp_path / "file.json")]) == 2
    assert "the submission.results: absent" in capsys.readouterr().err


def test_a_test_file_has_neither_answers_nor_objects() -> None:
    document = _file()
    frame = document["s"]["key_frames"]["f"]
    del document["s"]["scene_description"]
    for row in frame["QA"]["perception"]:
        del row["A"]
    assert [one.answer for one in answers(document)] == ["Moving.", "", ""]
    del frame["key_object_infos"]
    assert [one.answer for one in answers(document)] == ["", "", ""]


def test_the_converted_form_of_a_test_file_is_scored(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    asked = _file()["s"]["key_frames"]["f"]["QA"]["perception"][1]["Q"]
    turns = [{"from": "human", "value": f"<image>\n{asked}"}, {"from": "gpt", "value": SECRET}]
    (tmp_path / "file.json").write_text(json.dumps(_file()))
    (tmp_path / "out.json").write_text(json.dumps([{"id": "s_f_1", "image": [], "conversations": turns}]))
    assert score([str(tmp_path / "out.json"), str(tmp_path / "file.json")]) == 0
    assert "1 of 3 questions answered" in capsys.readouterr().out

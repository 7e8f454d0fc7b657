"""The scorer as it is called: the table, JSON, and everything that does not fit told."""

import json
from pathlib import Path
from typing import Any

import pytest

from studies.gvqa.command import main

MOVING = "What is the moving status of object <c1,CAM_FRONT,10.0,10.0>?"
FIRST = "Which objects are ahead?"
WHY = "Why does the ego vehicle brake?"


def _row(question: str, answer: str, **more: Any) -> dict[str, Any]:
    return {"Q": question, "A": answer, **more}


REFERENCE = {
    "s": {
        "key_frames": {
            "f": {
                "QA": {
                    "perception": [_row(MOVING, "Going ahead."), _row("Is there a light?", "Yes.")],
                    "prediction": [_row(FIRST, "<c1,CAM_FRONT,10.0,10.0>, <c2,CAM_FRONT,90.0,10.0>.")],
                    "planning": [_row(WHY, "The light is red."), _row(WHY, "The lead brakes hard.")],
                    "behavior": [_row("Judge this.", "Fine.", tag=[1])],
                }
            }
        }
    }
}


@pytest.fixture
def score(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Any:
    def run(predictions: Any, *flags: str, reference: Any = REFERENCE) -> tuple[int, str, str]:
        (tmp_path / "p.json").write_text(json.dumps(predictions))
        (tmp_path / "r.json").write_text(json.dumps(reference))
        status = main([str(tmp_path / "p.json"), str(tmp_path / "r.json"), *flags])
        said = capsys.readouterr()
        return status, said.out, said.err

    return run


def _answers(*texts: str) -> list[dict[str, str]]:
    return [{"id": f"s_f_{number}", "answer": text} for number, text in enumerate(texts)]


ALL = ("Going ahead.", "No.", "<c1,CAM_FRONT,12.0,10.0>", "The light is red.", "The lead brakes hard.", "Fine.")


def _figures(out: str) -> Any:
    """Of the only file."""
    (found,) = json.loads(out)["figures"].values()
    return found


def _scores(out: str, form: str = "score") -> dict[str, float]:
    return {one["metric"]: one[form] for one in _figures(out)["scores"]}


def test_each_question_counts_under_the_metric_of_its_form(score: Any) -> None:
    status, out, _ = score(_answers(*ALL), "--json")
    found = _scores(out)
    assert status == 0
    assert found["exact match"] == 0.5  # "Going ahead." right, "No." for "Yes." wrong
    assert found["coordinate match F1"] == pytest.approx(2 / 3, abs=1e-6)  # one of two points
    assert found["BLEU-1"] == found["ROUGE-L"] == 1.0
    assert _figures(out)["judged"] == 1


def test_exact_match_is_told_strictly_and_without_case_articles_punctuation_and_spelling_of_numbers(score: Any) -> None:
    _, out, _ = score(_answers("the Going ahead", "yes"), "--json")
    assert _scores(out)["exact match"] == 0.0
    assert _scores(out, "lenient")["exact match"] == 1.0
    assert _scores(out, "lenient")["ROUGE-L"] is None


def test_several_answers_stand_beside_each_other(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for name, said in (("ours", _answers(*ALL)), ("black", []), ("reference", REFERENCE)):
        (tmp_path / name).write_text(json.dumps(said))
    assert main([str(tmp_path / name) for name in ("ours", "black", "reference")]) == 0
    out = capsys.readouterr().out
    assert f"{tmp_path / 'ours'} | exact match | 2 | 2 | 0.5000 | 0.5000" in out
    assert f"{tmp_path / 'black'} | exact match | 2 | 0 | 0.0000 | 0.0000" in out


def test_an_unanswered_question_scores_0_and_is_told(score: Any) -> None:
    status, out, _ = score(_answers(*ALL[:4], " "))
    assert status == 0
    assert "4 of 6 questions answered" in out
    assert "2 questions without an answer (score 0)" in out
    _, out, _ = score(_answers(*ALL[:4]), "--json")
    # one of two sentences: ROUGE-L (1 + 0) / 2; BLEU-1 four words right of four said, eight wanted: exp(1 - 8/4)
    assert _scores(out)["ROUGE-L"] == 0.5
    assert _scores(out)["BLEU-1"] == pytest.approx(0.367879, abs=1e-6)


def test_nothing_answered_at_all_is_0_everywhere(score: Any) -> None:
    _, out, _ = score([], "--json")
    assert set(_scores(out).values()) == {0.0}


def test_what_does_not_fit_is_counted(score: Any) -> None:
    rows = [
        *_answers(*ALL[:2]),
        {"id": "s_f_1", "answer": "Yes."},  # disputes the "No." before
        {"id": "s_f_2", "question": "Another question?", "answer": "<c1,CAM_FRONT,10.0,10.0>"},
        {"id": "s_f_3", "question": f"<image> {WHY}", "answer": "The light <c1,CAM_FRONT> is red."},
        {"id": "s_g_0", "answer": "Yes."},
        {"id": 4, "answer": "Yes."},
        "no row",
    ]
    _, out, _ = score(rows, "--json")
    assert _figures(out)["oddities"] == {
        "unanswered": 4, "other_question": 1, "disputed": 1, "unknown": 1, "wrong_form": 2, "broken_tags": 1,
    }  # fmt: skip
    assert _scores(out)["exact match"] == 0.5
    assert _scores(out)["coordinate match F1"] == 0.0


def test_a_file_of_drivelms_form_is_scored_by_question_whatever_its_order(score: Any) -> None:
    turned = json.loads(json.dumps(REFERENCE))
    turned["s"]["key_frames"]["f"]["QA"]["perception"].reverse()
    _, out, _ = score(turned, "--json")
    assert _scores(out)["exact match"] == 1.0
    assert _figures(out)["oddities"]["unanswered"] == 0


def test_a_questions_own_tags_decide_its_metrics(score: Any) -> None:
    reference = {"s": {"key_frames": {"f": {"QA": {"planning": [_row("Say it.", "Yes.", tag=[2])]}}}}}
    _, out, _ = score(_answers("Yes."), "--json", reference=reference)
    assert _scores(out)["exact match"] is None
    assert _scores(out)["BLEU-1"] == 1.0


@pytest.mark.parametrize(
    ("reference", "told"),
    [
        ([], "the file: expected an object"),
        ({"s": {}}, "s.key_frames: absent"),
        ({"s": {"key_frames": {"f": {"QA": {"planning": [{"Q": "a"}]}}}}}, r"planning[0].A: absent"),
        ({"s": {"key_frames": {"f": {"QA": {"planning": [_row("a", "b", tag=[9])]}}}}}, r"planning[0].tag"),
    ],
)
def test_a_reference_that_cannot_be_read_is_refused_by_its_field(score: Any, reference: Any, told: str) -> None:
    status, out, err = score([], reference=reference)
    assert (status, out) == (2, "")
    assert told in err
    assert "r.json: " in err
    assert err.count("\n") == 1


def test_layers_and_tags_may_be_null(score: Any) -> None:
    reference = {
        "s": {"key_frames": {"f": {"QA": {"perception": None, "planning": [_row("Is it?", "Yes.", tag=None)]}}}}
    }
    _, out, _ = score(_answers("Yes."), "--json", reference=reference)
    assert _scores(out)["exact match"] == 1.0


def test_answers_may_stand_in_a_line_each(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "p.jsonl").write_text("\n".join(json.dumps(each) for each in _answers(*ALL)) + "\n")
    (tmp_path / "r.json").write_text(json.dumps(REFERENCE))
    assert main([str(tmp_path / "p.jsonl"), str(tmp_path / "r.json"), "--json"]) == 0
    assert _figures(capsys.readouterr().out)["oddities"]["unanswered"] == 0


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_byte_order_mark_counts_and_one_line_may_be_all(
    encoding: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "p.jsonl").write_text(json.dumps(_answers(*ALL)[0]) + "\n", encoding=encoding)
    (tmp_path / "r.json").write_text(json.dumps(REFERENCE), encoding=encoding)
    assert main([str(tmp_path / "p.jsonl"), str(tmp_path / "r.json"), "--json"]) == 0
    assert _figures(capsys.readouterr().out)["oddities"]["unanswered"] == 5


def test_a_file_that_is_absent_or_no_json_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "bad.json").write_text("{")
    (tmp_path / "empty.json").write_text("")
    for name, told in (("bad.json", "not JSON"), ("empty.json", "it is empty"), ("absent.json", "No such file")):
        assert main([str(tmp_path / name), str(tmp_path / name)]) == 2
        assert told in capsys.readouterr().err

"""Answers are recorded once, in a plain file, and played back to the bit."""

import gzip
import logging
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.errors import ConfigError, ToolFailed, UserError
from drivemcp.testing import bus
from evaluation.baselines.direct.answer_sources import (
    Generated,
    Played,
    Recorded,
    digest,
    source_of,
    template_of,
)
from evaluation.baselines.direct.cassette import MOST_MS, Cassette, Line, Recording, model_of, read, recorded_at, write
from evaluation.baselines.direct.template import Asked, filled, load
from evaluation.baselines.direct.whole_prompts import answered
from services.drivelm.backends.config import AnswersConfig
from services.drivelm.reading.crops import Picture
from services.drivelm.service import SERVICE, DrivelmConfig

ASKED = Asked(
    "The traffic sign is a speed limit sign of 70 km/h.", "Which speed limit is in force here?", ("p",), ("t",)
)
PROMPT = load()


class Model:
    """Says another number each time, as a model that draws does."""

    def __init__(self, name: str = "openai:some", sees: bool = False) -> None:
        self.name, self.sees, self.asked = name, sees, list[str]()

    def free(self, image: Picture | None, prompt: str) -> tuple[str, float]:
        self.asked.append(prompt)
        return f"Drive at most {10 * len(self.asked)} km/h.", 0.25


def test_the_drive_that_plays_hears_what_the_drive_that_recorded_heard_to_the_bit(tmp_path: Path) -> None:
    file, model = tmp_path / "answers.jsonl", Model()
    source = Recorded(Generated(model), Recording(file, model.name))
    recorded = [answered(asked, PROMPT, source) for asked in (ASKED, ASKED._replace(query="q"), ASKED)]
    assert recorded[0] == recorded[2], "asked once"
    assert len(model.asked) == 2
    played = Played(Cassette(file, model.name, read(file)))
    again = [answered(asked, PROMPT, played) for asked in (ASKED, ASKED._replace(query="q"), ASKED)]
    assert [msgspec.structs.replace(each, method="") for each in again] == [
        msgspec.structs.replace(each, method="") for each in recorded
    ]
    assert {each.backend for each in again} == {"openai:some"}
    line = read(file)[0]
    assert (line.asked, line.prompt) == (ASKED, digest(filled(PROMPT, ASKED), None))


def test_a_prompt_without_an_answer_is_an_error_and_no_abstention(tmp_path: Path) -> None:
    played = Played(Cassette(tmp_path / "answers.jsonl", "openai:some", ()))
    with pytest.raises(ToolFailed, match=r"answers\.jsonl has no answer of openai:some"):
        answered(ASKED, PROMPT, played)


def test_a_second_process_takes_the_answer_of_the_first_and_what_was_cut_is_mended(tmp_path: Path) -> None:
    file = tmp_path / "answers.jsonl"
    one, other = Recording(file, "a:1"), Recording(file, "a:1")
    first = one.add(Line(backend="a:1", prompt="x", text="one", took_ms=1.0))
    assert other.add(Line(backend="a:1", prompt="x", text="other", took_ms=2.0)) == first
    with file.open("ab") as cut:
        cut.write(b'{"backend":"a:1","pro')
    third = Recording(file, "a:1")
    third.add(Line(backend="a:1", prompt="y"))
    assert [each.prompt for each in read(file)] == ["x", "y"]


def test_with_a_model_that_sees_the_picture_counts_and_without_one_nothing_is_recorded(tmp_path: Path) -> None:
    file, model = tmp_path / "answers.jsonl", Model(sees=True)
    source = Recorded(Generated(model), Recording(file, model.name))
    dark, light = np.zeros((2, 2, 3), np.uint8), np.full((2, 2, 3), 255, np.uint8)
    said = [source.answer(ASKED, "prompt", picture).text for picture in (dark, light, dark)]
    assert said[0] == said[2] != said[1]
    played = Played(Cassette(file, model.name, read(file)))
    assert played.sees
    assert [played.answer(ASKED, "prompt", picture).text for picture in (dark, light)] == said[:2]


LINES = st.lists(
    st.builds(
        Line, backend=st.just("b:1"), prompt=st.text(max_size=9), text=st.text(max_size=40), score=st.floats(0, 1),
        took_ms=st.floats(0, MOST_MS), context=st.text(max_size=40), passages=st.tuples(st.text(max_size=9)),
    )
)  # fmt: skip


@given(lines=LINES)
def test_a_file_holds_what_was_written_whether_or_not_it_is_compressed(
    lines: Sequence[Line], tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("cassettes")
    for name in ("a.jsonl", "a.jsonl.gz"):
        write(folder / name, lines)
        assert read(folder / name) == list(lines)
    assert gzip.decompress((folder / "a.jsonl.gz").read_bytes()) == (folder / "a.jsonl").read_bytes()


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{}\n",
        b'{"cassette": 2}\n',
        b'{"cassette": 1}\n{"prompt": 1}\n',
        b'{"cassette":1}\n{"backend":"b","prompt":"","took_ms":1e99}\n',
        b"\xff\n",
    ],
)
def test_what_is_no_cassette_is_refused_by_name(tmp_path: Path, content: bytes) -> None:
    (file := tmp_path / "broken.jsonl").write_bytes(content)
    with pytest.raises(UserError, match=r"cassette .*broken\.jsonl"):
        read(file)
    (file := tmp_path / "broken.jsonl.gz").write_bytes(content or b"\x1f\x8b")
    with pytest.raises(UserError, match=r"cassette .*broken\.jsonl\.gz"):
        read(file)


def test_answers_of_two_models_of_a_kind_are_not_mixed() -> None:
    lines = [Line(backend=name, prompt="x") for name in ("gguf:free:a", "gguf:forms:a", "gguf:forms:b", "embedded:1")]
    assert model_of(lines, "gguf:free") == "gguf:free:a"
    assert model_of(lines, "transformers") == ""
    with pytest.raises(UserError, match="gguf:forms:a, gguf:forms:b"):
        model_of(lines, "gguf:forms")


@pytest.mark.parametrize(
    ("answers", "words"),
    [
        ({"record": "a.jsonl", "play": "b.jsonl"}, "both set"),
        ({"play": "absent.jsonl"}, r"cassette .*absent\.jsonl"),
        ({"record": "a.jsonl.gz"}, "plain file"),
        ({"play": "empty.jsonl"}, "has no answers of embedded"),
    ],
)
def test_settings_that_cannot_be_used_are_told_in_one_line(tmp_path: Path, answers: dict[str, str], words: str) -> None:
    write(tmp_path / "empty.jsonl", ())
    named = {key: str(tmp_path / file) for key, file in answers.items()}
    config = DrivelmConfig(answers=AnswersConfig(**named))
    with pytest.raises(ConfigError, match=words) as error:
        source_of(config, template_of(config), None, "embedded:abc")
    assert "\n" not in str(error.value)


def test_the_reader_without_a_model_is_recorded_too_and_the_service_plays_it(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    file = str(tmp_path / "answers.jsonl")
    question = {"query": ASKED.query, "context": ASKED.context}
    with bus() as b:
        b.start(SERVICE, DrivelmConfig(whole_prompts=True, answers=AnswersConfig(record=file)))
        recorded = b.call("answer_prompt", question)
    assert recorded.result is not None
    with bus() as b:
        b.start(SERVICE, DrivelmConfig(whole_prompts=True, answers=AnswersConfig(play=file)))
        played = b.call("answer_prompt", question)
        assert played.result == {**recorded.result, "method": Played.method}
        with caplog.at_level(logging.ERROR):
            assert not b.call("answer_prompt", {"query": "another"}).ok
        assert "has no answer" in caplog.text


def test_a_recording_notes_the_behaviour_with_which_it_began_and_an_older_one_without_it_is_read(
    tmp_path: Path,
) -> None:
    new, old = tmp_path / "new.jsonl", tmp_path / "old.jsonl"
    Recording(new, "", at="1f")
    line = Recording(new, "b", at="2e").add(Line(backend="b", prompt="0" * 64))
    assert (recorded_at(new), read(new)) == ("1f", [line])
    old.write_bytes(b'{"cassette":1}\n' + msgspec.json.encode(line) + b"\n")
    assert (recorded_at(old), read(old)) == ("", [line])
    write(tmp_path / "copy.jsonl.gz", read(new), recorded_at(new))
    assert recorded_at(tmp_path / "copy.jsonl.gz") == "1f"

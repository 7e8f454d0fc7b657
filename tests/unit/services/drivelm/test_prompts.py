"""Prompts are short, versioned files; every sentence that they ask for is one that the parser knows."""

import re
from pathlib import Path

import msgspec
import pytest

from services.drivelm.backends import prompts
from services.drivelm.backends.abstentions import OFFERED
from services.drivelm.vocabulary.classes import KIND_OF_QUESTION, OTHER, QUESTIONS, SENTENCES
from services.drivelm.vocabulary.parser import parse, statement_of


@pytest.mark.parametrize("question", QUESTIONS.values())
def test_every_sentence_asked_for_is_known_and_of_the_kind(question: str) -> None:
    lines = prompts.load().texts[question].splitlines()
    assert lines[0] == question
    offered = [line.replace(" N.", " 50.") for line in lines if line.startswith("The ")]
    offered += [line.rpartition(": ")[2].replace(" N.", " 50.") for line in lines if ": The" in line]
    read = {statement.reading for text in offered if (statement := parse(text)) is not None}
    assert len(read) == len(set(offered)) == len(offered)
    kind = KIND_OF_QUESTION[question]
    heads = {label.partition(":")[0] for label in (*OFFERED[kind], OTHER)}
    assert {reading.partition(":")[0] for reading in read} == heads


def test_every_class_can_be_said() -> None:
    said = "\n".join(prompts.load().texts.values())
    for labels in OFFERED.values():
        for label in labels:
            assert SENTENCES[label] in said or re.sub(r" \d+\.$", " N.", SENTENCES[label]) in said, label
            assert parse(SENTENCES[label]) == statement_of(label)


def test_prompts_are_short() -> None:
    assert all(len(text) < 3200 for text in prompts.load().texts.values())


def test_the_hash_follows_the_text_that_is_sent(tmp_path: Path) -> None:
    before = prompts.load().sha256
    assert before == prompts.load().sha256
    assert re.fullmatch("[0-9a-f]{64}", before)
    for file in prompts.FOLDER.glob("*.toml"):
        (tmp_path / file.name).write_bytes(file.read_bytes())
    assert prompts.load(tmp_path).sha256 == before
    light = tmp_path / "light.toml"
    light.write_text(light.read_text().replace("Look at", "Look well at"))
    assert prompts.load(tmp_path).sha256 != before


def test_a_prompt_file_without_a_version_is_refused(tmp_path: Path) -> None:
    (tmp_path / "sign.toml").write_text("ask = '{question}'")
    with pytest.raises(msgspec.ValidationError, match="version"):
        prompts.load(tmp_path)

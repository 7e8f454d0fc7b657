"""Twenty questions of a reader: each answer stands where `questions.toml` says, one link from the index."""

import os
import tomllib
from pathlib import Path

import pytest

from tests.shared import ROOT
from tests.unit.docs.test_links import LINK, anchor_of, anchors

DOCS = ROOT / "docs"
QUESTIONS = tomllib.loads((Path(__file__).with_name("questions.toml")).read_text(encoding="utf-8"))["question"]


def section(page: Path, anchor: str) -> str:
    """A heading and what stands below it, up to the next heading of its rank."""
    lines = page.read_text(encoding="utf-8").splitlines()
    begin = next(
        number for number, line in enumerate(lines) if line.startswith("#") and anchor_of(line.lstrip("# ")) == anchor
    )
    rank = len(lines[begin]) - len(lines[begin].lstrip("#"))
    end = next(
        (number for number, line in enumerate(lines) if number > begin and line.startswith("#") and line.lstrip("#")[:1] == " "
         and len(line) - len(line.lstrip("#")) <= rank),
        len(lines),
    )  # fmt: skip
    return "\n".join(lines[begin:end])


def test_there_are_twenty() -> None:
    assert len({each["ask"] for each in QUESTIONS}) == 20


@pytest.mark.parametrize("question", QUESTIONS, ids=lambda question: question["ask"])
def test_the_answer_stands_there_with_its_key_words(question: dict[str, str]) -> None:
    page = DOCS / question["page"]
    assert question["anchor"] in anchors(page)
    text = section(page, question["anchor"])
    assert [word for word in question["words"] if word not in text] == []


def test_every_answer_is_one_link_from_the_index() -> None:
    index = (DOCS / "index.md").read_text(encoding="utf-8")
    linked = {os.path.normpath(link.partition("#")[0]) for link in LINK.findall(index)}
    assert {question["page"] for question in QUESTIONS} - linked - {"index.md"} == set()

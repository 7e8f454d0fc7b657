"""The generated pages are what the code gives, and leave out nothing of the tables."""

import msgspec
import pytest

from proto.services import OWNERS
from proto.topics import TOPICS
from scripts.reference import __main__ as reference
from scripts.reference.markdown import cell, field_docs, table
from scripts.reference.settings import undocumented
from tests.shared import ROOT


def page(name: str) -> str:
    return (ROOT / "docs" / "reference" / f"{name}.md").read_text(encoding="utf-8")


def test_the_committed_pages_are_what_the_code_gives() -> None:
    assert [str(file) for file in reference.stale()] == [], "run: python -m scripts.reference"


def test_a_stale_page_is_named_with_the_command_that_mends_it(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(reference, "GENERATED", {"topics": "scripts.reference.tables:kinds"})
    assert reference.main(["--check"]) == 1
    assert capsys.readouterr().err == "docs/reference/topics.md is stale; run: python -m scripts.reference\n"


def test_every_setting_says_what_it_does() -> None:
    assert undocumented() == []


def test_every_tool_and_topic_of_the_tables_has_its_place() -> None:
    assert [tool for tool in OWNERS if f"### {tool}\n" not in page("tools")] == []
    assert [row.name for row in TOPICS if f"| `{row.name}` |" not in page("topics")] == []


def test_a_cell_breaks_no_table() -> None:
    assert cell("a | b\n`<id>` < c") == "a \\| b `<id>` &lt; c"
    assert table(("x",), [("1",)]).splitlines() == ["| x |", "| --- |", "| 1 |"]


class Base(msgspec.Struct):
    """A struct."""

    first: int = 0
    """Of the base."""


class Derived(Base):
    """With a field of its own."""

    second: int = 0
    """Of this one."""
    third: int = 0


def test_docstrings_of_fields_come_with_those_of_the_bases() -> None:
    assert field_docs(Derived) == {"first": "Of the base.", "second": "Of this one."}

"""The ways that the page on architecture draws: each arrow is an import, and no way goes back up."""

import ast
import re
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest

from proto.topics import TOPICS
from scripts.syntax import parsed

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs" / "explanation" / "architecture.md").read_text(encoding="utf-8")
FILE = r"`[\w/]+\.py`"
WAYS = [re.findall(r"[\w/]+\.py", chain) for chain in re.findall(rf"{FILE}(?: → {FILE})+", PAGE)]
ARROWS = sorted({pair for way in WAYS for pair in pairwise(way)})
CROSSINGS = re.findall(r"topic `([^`]+)` from ([\w, ]+) to ([\w, ]+)\.", PAGE)


def file_of(name: str) -> str:
    """The file of a module or package of this repository; empty for any other name."""
    path = name.replace(".", "/")
    return next((each for each in (f"{path}.py", f"{path}/__init__.py") if (ROOT / each).is_file()), "")


@cache
def imported(file: str) -> frozenset[str]:
    """The files of this repository that a file imports, inside functions too."""
    found: set[str] = set()
    for node in ast.walk(parsed((ROOT / file).read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module:
            found |= {file_of(f"{node.module}.{each.name}") or file_of(node.module) for each in node.names}
        elif isinstance(node, ast.Import):
            found |= {file_of(each.name) for each in node.names}
    return frozenset(found - {""})


def reached(file: str) -> set[str]:
    """The same, and what those import."""
    found, todo = set[str](), [file]
    while todo:
        fresh = imported(todo.pop()) - found
        found |= fresh
        todo += fresh
    return found


def test_the_page_draws_three_ways() -> None:
    assert len(ARROWS) > 40
    assert len(CROSSINGS) >= 6


@pytest.mark.parametrize(("upper", "lower"), ARROWS)
def test_an_arrow_is_an_import_and_goes_downward_only(upper: str, lower: str) -> None:
    assert lower in imported(upper)
    assert upper not in reached(lower)


@pytest.mark.parametrize(("name", "publishers", "readers"), CROSSINGS)
def test_a_topic_goes_from_and_to_whom_the_table_says(name: str, publishers: str, readers: str) -> None:
    topic = next(topic for topic in TOPICS if topic.name == name)
    assert publishers.replace("everyone", "*").split(", ") == list(topic.publishers)
    assert readers.replace("everyone", "*").split(", ") == list(topic.readers)

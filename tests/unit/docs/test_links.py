"""Links between pages, and the files of this repository that pages name, are there."""

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
OF_THEIR_TIME = {ROOT / "CHANGELOG.md"}
"""Pages that may name what is gone."""
FOLDERS = "proto|domain|drivemcp|services|app|evaluation|studies|training|tests|docs|docker|scripts|examples|benchmarks"
FILE = re.compile(rf"(?:{FOLDERS})/[\w./-]+\.\w+")
LINK = re.compile(r"\]\(([^)\s]+)\)")


def anchor_of(heading: str) -> str:
    """A heading as a browser is led to it."""
    plain = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading.strip().lower())
    return re.sub(r"[^\w\- ]", "", plain).replace(" ", "-")


@cache
def anchors(page: Path) -> frozenset[str]:
    """The anchors of a page's headings."""
    return frozenset(map(anchor_of, re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)))


def broken_links(page: Path) -> Iterator[str]:
    """Links to no file, or to no heading of it."""
    for link in LINK.findall(page.read_text(encoding="utf-8")):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, anchor = link.partition("#")
        target = (page.parent / path).resolve() if path else page
        if not target.exists() or (anchor and target.suffix == ".md" and anchor not in anchors(target)):
            yield link


def missing_files(page: Path) -> Iterator[str]:
    """Files named in backticks by their path from the root that are not there."""
    for code in re.findall(r"`([^`\n]+)`", page.read_text(encoding="utf-8")):
        for word in code.split():
            found = FILE.fullmatch(word.split("::")[0].strip(",;:()\"'"))
            if found and not (ROOT / found.group()).exists():
                yield word


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_to_files_and_headings_that_are_there(page: Path) -> None:
    assert list(broken_links(page)) == []


@pytest.mark.parametrize("page", [page for page in PAGES if page not in OF_THEIR_TIME], ids=lambda page: page.name)
def test_files_that_a_page_names_are_there(page: Path) -> None:
    assert list(missing_files(page)) == []

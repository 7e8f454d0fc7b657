"""Sentences of pages and of docstrings, with the line on which each begins."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from scripts.syntax import parsed

FENCE = re.compile(r"^\s*(?P<marks>`{3,}|~{3,})(?P<info>.*)$")
BLOCK = re.compile(r"^\s*([-*+>]|\d+\.|#+)\s+")
END = re.compile(r"(?<=[.!?:;])\s+(?=[A-Z*`\"(\[])")


class Sentence(NamedTuple):
    """A sentence as it is read: code is `code`, a link its text."""

    line: int
    text: str


def of_page(text: str) -> Iterator[Sentence]:
    """The sentences of a Markdown page, without code blocks; each cell of a table is a paragraph."""
    fence, begun = "", 0
    paragraph: list[str] = []
    text = re.sub(r"<!--.*?-->", lambda comment: "\n" * comment[0].count("\n"), text, flags=re.DOTALL)
    for number, line in enumerate([*text.splitlines(), ""], 1):
        mark = FENCE.match(line)
        opens, closes = bool(mark and not fence), bool(mark and fence and _closes(mark, fence))
        hidden = bool(fence) or opens
        if mark and opens:
            fence = mark["marks"]
        elif closes:
            fence = ""
        table = not hidden and line.lstrip().startswith("|")
        if hidden or not line.strip() or table or BLOCK.match(line):
            yield from _sentences(" ".join(paragraph), begun)
            paragraph = []
        if table:
            for cell in re.split(r"(?<!\\)\|", line):
                yield from _sentences(cell, number)
        elif line.strip() and not hidden:
            begun = begun if paragraph else number
            paragraph.append(BLOCK.sub("", line).strip())


def _closes(mark: re.Match[str], fence: str) -> bool:
    """A fence ends by at least as many of its own marks, alone on their line."""
    return mark["marks"].startswith(fence) and not mark["info"].strip()


def of_code(text: str) -> Iterator[Sentence]:
    """The sentences of a module's docstrings, those of fields and constants included."""
    for node in ast.walk(parsed(text)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            for paragraph in re.split(r"\n\s*\n|\n\s*-\s", node.value.value):
                yield from _sentences(" ".join(paragraph.split()), node.lineno)


def of_file(file: Path) -> Iterator[Sentence]:
    """By the kind of file."""
    text = file.read_text(encoding="utf-8")
    return of_code(text) if file.suffix == ".py" else of_page(text)


def _sentences(paragraph: str, line: int) -> Iterator[Sentence]:
    plain = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", re.sub(r"`[^`]*`", "`code`", paragraph))
    yield from (Sentence(line, each.strip()) for each in END.split(plain) if each.strip())

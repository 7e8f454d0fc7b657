"""Sentences of pages and of docstrings, with the line on which each begins."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

FENCE = re.compile(r"^\s*(```|~~~)")
BLOCK = re.compile(r"^\s*([-*+>]|\d+\.|#+)\s+")
END = re.compile(r"(?<=[.!?:;])\s+(?=[A-Z*`\"(\[])")


class Sentence(NamedTuple):
    """A sentence as it is read: code is `code`, a link its text."""

    line: int
    text: str


def of_page(text: str) -> Iterator[Sentence]:
    """The sentences of a Markdown page, without code blocks; each cell of a table is a paragraph."""
    fenced, begun = False, 0
    paragraph: list[str] = []
    for number, line in enumerate([*text.splitlines(), ""], 1):
        if FENCE.match(line):
            fenced = not fenced
        table = line.startswith("|")
        if fenced or FENCE.match(line) or not line.strip() or table or BLOCK.match(line) or line.startswith("<!--"):
            yield from _sentences(" ".join(paragraph), begun)
            paragraph = []
        if table:
            for cell in re.split(r"(?<!\\)\|", line):
                yield from _sentences(cell, number)
        elif line.strip() and not fenced and not FENCE.match(line) and not line.startswith("<!--"):
            begun = begun if paragraph else number
            paragraph.append(BLOCK.sub("", line).strip())


def of_code(text: str) -> Iterator[Sentence]:
    """The sentences of a module's docstrings, those of fields and constants included."""
    for node in ast.walk(ast.parse(text)):
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

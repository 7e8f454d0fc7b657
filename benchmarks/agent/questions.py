"""The questions, and how an answer is scored: the tools that were called, and the facts that were told."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import msgspec

FILE = Path(__file__).with_name("questions.toml")


class Fact(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A value of the result by its path, and the words of which one must stand in the answer."""

    path: str
    said: tuple[str, ...]
    is_: Any = msgspec.field(name="is", default=None)

    def told(self, answer: str) -> bool:
        """Whether the answer holds one of the words; a number is not found within a longer one."""
        text = " ".join(answer.split()).casefold()
        return any(re.search(rf"(?<![\d.]){re.escape(word.casefold())}(?!\.?\d)", text) for word in self.said)


class Call(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """How the scripted client asks."""

    tool: str
    arguments: dict[str, Any]


class Question(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A question in natural words. `tools`: what should be called, `a|b` where either will do."""

    id: str
    by: str
    ask: str
    tools: tuple[str, ...]
    call: Call
    fact: tuple[Fact, ...]


class _File(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    version: int
    question: tuple[Question, ...]


class Scored(msgspec.Struct, frozen=True, kw_only=True):
    """One question's outcome."""

    id: str
    tools: float
    """Share of the tools that should be called and were."""
    facts: float
    """Share of the facts that the answer holds."""
    called: tuple[str, ...]
    answer: str


def questions(file: Path = FILE) -> tuple[int, tuple[Question, ...]]:
    """The file's version, and its questions."""
    read = msgspec.toml.decode(file.read_bytes(), type=_File)
    return read.version, read.question


def scored(question: Question, called: Iterable[str], answer: str) -> Scored:
    """The outcome of an answer that was given after these calls."""
    names = tuple(called)
    right = [not set(each.split("|")).isdisjoint(names) for each in question.tools]
    told = [fact.told(answer) for fact in question.fact]
    return Scored(
        id=question.id, tools=sum(right) / len(right), facts=sum(told) / len(told), called=names, answer=answer
    )


def value_at(result: Any, path: str) -> Any:
    """A value by its path. Raises LookupError for a path that leads nowhere."""
    for step in path.split("."):
        result = result[int(step)] if isinstance(result, list) else result[step]
    return result

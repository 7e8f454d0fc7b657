"""What a sentence may not hold; words and abbreviations stand in `vocabulary.toml`."""

import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from scripts.prose.text import Sentence

MOST_WORDS = 40
"""Of a sentence; a longer one says more than one thing."""
VOCABULARY = tomllib.loads(Path(__file__).with_name("vocabulary.toml").read_text(encoding="utf-8"))
WORDS: tuple[tuple[re.Pattern[str], str], ...] = tuple(
    (re.compile(rf"\b(?:{pattern})\b", re.IGNORECASE), advice) for pattern, advice in VOCABULARY["words"].items()
)
ABBREVIATIONS: Mapping[str, str] = MappingProxyType(VOCABULARY["abbreviations"])
KNOWN = frozenset(ABBREVIATIONS) | frozenset(VOCABULARY["names"]["known"])
ABBREVIATION = re.compile(r"\b[A-Z][A-Z0-9]*[A-Z][A-Z0-9]*\b")
QUOTED = re.compile(r"`[^`]*`|\"[^\"]*\"|“[^”]*”|\*[^*]*\*")


class Finding(NamedTuple):
    """A rule that a sentence breaks, and what to do."""

    line: int
    rule: str
    says: str


def words(text: str) -> Iterator[str]:
    """Words that the project does not use."""
    for pattern, advice in WORDS:
        if found := pattern.search(QUOTED.sub("", text)):
            yield f"{found[0]!r}: {advice}"


def who(text: str) -> Iterator[str]:
    """A subject that is a relative clause."""
    if re.match(r"(Who|Whoever|Whom)\b", text) and not text.endswith("?"):
        yield f"{text[:30]!r}: name the subject, for example 'A rider is ...'"


def length(text: str) -> Iterator[str]:
    """More words than a sentence needs."""
    if (count := len(text.split())) > MOST_WORDS:
        yield f"{count} words from {text[:30]!r} on: at most {MOST_WORDS}, one claim a sentence"


def names(text: str) -> Iterator[str]:
    """Abbreviations that no reader can look up."""
    for name in sorted({*ABBREVIATION.findall(QUOTED.sub("", text))} - KNOWN):
        yield f"{name}: explain it in scripts/prose/vocabulary.toml, from which the glossary is made, or write it out"


RULES: Mapping[str, Callable[[str], Iterator[str]]] = MappingProxyType(
    {"words": words, "who": who, "length": length, "names": names}
)


def findings(sentence: Sentence) -> Iterator[Finding]:
    """What is wrong with one sentence."""
    for rule, broken in RULES.items():
        yield from (Finding(sentence.line, rule, says) for says in broken(sentence.text))

"""What the Rules service says in its own words, in the driver's language: one table a language below `phrases`."""

import tomllib
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

from domain.languages import spoken_language

FOLDER = Path(__file__).parent / "phrases"
MOST_NAMED = 3


@cache
def _table(language: str) -> dict[str, dict[str, str]]:
    table: dict[str, dict[str, str]] = tomllib.loads((FOLDER / f"{language}.toml").read_text(encoding="utf-8"))
    return table


def say(key: str, language: str, **values: str) -> str:
    """A sentence of the table, filled."""
    return _table(spoken_language(language))["said"][key].format(**values)


def country(code: str, language: str) -> str:
    """A country's name; its code where we have no name for it, `?` where that is no code."""
    return _table(spoken_language(language))["country"].get(code[:3]) or _code(code[:3])


def part(code: str, language: str) -> str:
    """The name of a part of a country; its code where we have no name for it."""
    return _table(spoken_language(language))["part"].get(code, code)


def named_packs(ids: Sequence[str], language: str) -> str:
    """Packs by name; how many, where they are too many to be named."""
    return ", ".join(ids) if len(ids) <= MOST_NAMED else say("packs", language, count=str(len(ids)))


def _code(text: str) -> str:
    return text if text.isascii() and text.isalpha() else "?"


def text_in(texts: Mapping[str, str], language: str) -> str:
    """A text of a pack in the driver's language, else in English, else in any."""
    return texts.get(spoken_language(language)) or texts.get("en") or next(iter(texts.values()), "")

"""What the Rules service says in its own words, in the driver's language: one table a language below `phrases`."""

import tomllib
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

from domain.languages import spoken_language
from services.rules.book import RuleBook
from services.rules.packs.format import Manifest
from services.rules.packs.loading import Pack

FOLDER = Path(__file__).parent / "phrases"
MOST_NAMED = 3


@cache
def _table(language: str) -> dict[str, dict[str, str]]:
    table: dict[str, dict[str, str]] = tomllib.loads((FOLDER / f"{language}.toml").read_text(encoding="utf-8"))
    return table


def say(key: str, language: str, **values: str) -> str:
    """A sentence of the table, filled."""
    return _table(spoken_language(language))["said"][key].format(**values)


def country(book: RuleBook, code: str, language: str) -> str:
    """A country's name in a sentence; `this country` where no pack names it."""
    return _place(book, code[:3], language, "a_country")


def part(book: RuleBook, code: str, language: str) -> str:
    """The name of a part of a country in a sentence."""
    return _place(book, code, language, "a_part")


def named_packs(book: RuleBook, packs: Sequence[Pack], language: str) -> str:
    """Packs by their places; how many, where they are too many to be named."""
    if len(packs) > MOST_NAMED:
        return say("packs", language, count=str(len(packs)))
    return ", ".join(dict.fromkeys(place(book, pack.manifest, language) for pack in packs))


def place(book: RuleBook, manifest: Manifest, language: str) -> str:
    """Whose law a pack is, by name."""
    known = book.name_of(manifest.jurisdiction, language)
    return known.in_a_sentence if known is not None else country(book, manifest.jurisdiction, language)


def _place(book: RuleBook, code: str, language: str, otherwise: str) -> str:
    known = book.name_of(code, language)
    return known.in_a_sentence if known is not None else say(otherwise, language)


def text_in(texts: Mapping[str, str], language: str) -> str:
    """A text of a pack in the driver's language, else in English, else in any."""
    return texts.get(spoken_language(language)) or texts.get("en") or next(iter(texts.values()), "")

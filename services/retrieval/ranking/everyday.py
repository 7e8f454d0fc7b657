"""The law's words for what a driver says: "Transit" is a van, "permis depuis un an" a novice; table in `everyday.toml`."""

import re
import tomllib
from functools import lru_cache
from pathlib import Path

import msgspec

PATH = Path(__file__).parent / "everyday.toml"


class Matter(msgspec.Struct, frozen=True):
    """One matter of the law: how it is said in any language, and its words language by language."""

    said: re.Pattern[str]
    law: dict[str, str]


@lru_cache(1)
def matters() -> tuple[Matter, ...]:
    """The table. Raises OSError or ValueError: it is part of the program."""
    raw = tomllib.loads(PATH.read_text(encoding="utf-8"))
    return tuple(
        Matter(re.compile(rf"(?<!\w)(?<!\d[.,])(?:{entry.pop('said')})(?!\w)", re.IGNORECASE), entry)
        for entry in raw.values()
    )


@lru_cache(512)
def _spoken_of(text: str) -> tuple[tuple[Matter, tuple[str, ...]], ...]:
    """The matters that a question speaks of, each with the parts that say it."""
    found = ((matter, tuple(match.group() for match in matter.said.finditer(text))) for matter in matters())
    return tuple((matter, parts) for matter, parts in found if parts)


def law_words(text: str, language: str) -> str:
    """The law's words, in a language, for the matters that a question speaks of; empty where the table has none."""
    return " ".join(matter.law[language] for matter, _ in _spoken_of(text) if language in matter.law)


def matters_in(text: str) -> int:
    """How many matters of the table a question speaks of."""
    return len(_spoken_of(text))


_SIGN = re.compile(
    r"\b(?:signs?|\w*schild(?:er)?|verkehrszeichen|zeichen|signal|panneaux?|panonceaux?|\w*bord(?:en|je)?|znak\w*|segnal[ei]|cartell[oi]|señal(?:es)?)\b",
    re.IGNORECASE,
)


def names_a_sign(text: str) -> bool:
    """Whether a question says that it is about a sign."""
    return _SIGN.search(text) is not None


def said_words(text: str, language: str) -> str:
    """Those parts of a question that the table has words for in a language."""
    found = [part for matter, parts in _spoken_of(text) if language in matter.law for part in parts]
    return " ".join(found).lower()

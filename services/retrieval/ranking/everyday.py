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
    alone: bool = False
    """Whether a question that speaks of it is answered by a passage that speaks of it, or by none: a horn, a tow rope, alcohol.

    One without words of the law, as the price of something, is no matter of the law itself.
    """

    def is_in(self, passage: str) -> bool:
        """Whether a passage speaks of it: as drivers say it, or by the first of the law's words in any language."""
        return bool(self.said.search(passage) or (self.law and _begins(tuple(self.law.values())).search(passage)))


@lru_cache(64)
def _begins(law: tuple[str, ...]) -> re.Pattern[str]:
    first = "|".join(re.escape(words.split()[0]) for words in law)
    return re.compile(rf"(?<!\w)(?:{first})\w{{0,2}}(?!\w)", re.IGNORECASE)


@lru_cache(1)
def matters() -> tuple[Matter, ...]:
    """The table. Raises OSError or ValueError: it is part of the program."""
    raw = tomllib.loads(PATH.read_text(encoding="utf-8"))
    return tuple(
        Matter(
            said=re.compile(rf"(?<!\w)(?<!\d[.,])(?:{entry.pop('said')})(?!\w)", re.IGNORECASE),
            alone=entry.pop("alone", False),
            law=entry,
        )
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


def alone_in(text: str) -> tuple[Matter, ...]:
    """The matters that a question speaks of and that only a passage on the same matter answers."""
    return tuple(matter for matter, _ in _spoken_of(text) if matter.alone)


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

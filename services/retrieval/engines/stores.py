"""What an engine must be able to do: keep collections of points, and find the nearest among those that a filter lets through."""

import hashlib
from collections.abc import Iterable, Sequence
from typing import Any, Literal, Protocol

import msgspec

from drivemcp.errors import DriveMcpError
from services.retrieval.corpus import Text
from services.retrieval.encoding.encoders import Vectors
from services.retrieval.engines.terms import Sparse
from services.retrieval.ranking.filters import Filter

MEANING, WORDS = "meaning", "words"
EVERYWHERE = "*"
"""The road type of what holds on every road."""
FIRST_DAY, LAST_DAY = 0, 99_991_231
KEYWORDS, NUMBERS = ("tongue", "corpus", "roads"), ("begin", "end")
"""The fields of a point that filters look at."""


class StoreError(DriveMcpError, ConnectionError):
    """The engine cannot be reached, or will not do what it was asked."""


class Point(msgspec.Struct, frozen=True):
    """One passage: its place among the texts is its number."""

    number: int
    words: Sparse
    meaning: Vectors
    fields: dict[str, Any]


class Ask(msgspec.Struct, frozen=True, kw_only=True):
    """The nearest points to one vector."""

    using: Literal["meaning", "words"]
    vector: Sparse | Vectors
    keep: Filter
    limit: int
    among: frozenset[int] | None = None
    """These alone, by number."""


class Store(Protocol):
    """Methods raise StoreError. Safe to call from several threads."""

    def holds(self, name: str, count: int) -> bool:
        """Whether a collection is there, with that many points."""

    def fill(self, name: str, size: int, points: Iterable[Point]) -> None:
        """Make a collection (anew) of points with meanings of that size; returns when it can be searched."""

    def ask(self, name: str, asks: Sequence[Ask]) -> list[list[tuple[int, float]]]:
        """For each the numbers and dot products, the nearest first; all in one go."""

    def close(self) -> None:
        """Let go of it."""


def fields(text: Text) -> dict[str, Any]:
    """What of a passage the filters look at."""
    begin, end = text.effective
    return {
        "tongue": text.tongue,
        "corpus": text.corpus,
        "roads": sorted(text.road_types) or [EVERYWHERE],
        "begin": _day(begin, FIRST_DAY),
        "end": _day(end, LAST_DAY),
    }


def conditions(models: Any, interval: Any, ask: Ask) -> Any:
    """The ask's filter in Qdrant's words; server and embedded engine name them alike but for `interval`."""
    keep = ask.keep
    must = [
        models.FieldCondition(key=key, match=models.MatchAny(any=values))
        for key, values in (
            ("tongue", sorted(keep.tongues)),
            ("corpus", [keep.corpus] if keep.corpus else []),
            ("roads", [keep.road_type, EVERYWHERE] if keep.road_type is not None else []),
        )
        if values
    ]
    if keep.on:
        day = _day(keep.on, FIRST_DAY)
        must.append(models.FieldCondition(key="begin", range=interval(lte=day)))
        must.append(models.FieldCondition(key="end", range=interval(gte=day)))
    return must


def collection(jurisdiction: str, texts: Sequence[Text], rows: Vectors) -> str:
    """A name that only these texts with these embeddings have."""
    content = hashlib.sha256(rows.tobytes())
    for text in texts:
        content.update(f"{text.passage_id}\0{text.indexed}\0{fields(text)}\0".encode())
    return f"{prefix(jurisdiction)}{content.hexdigest()[:16]}"


def prefix(jurisdiction: str) -> str:
    """How the names of a country's collections begin."""
    return f"drivemcp-{jurisdiction.lower()}-"


def _day(iso: str | None, unknown: int) -> int:
    return int(iso[:10].replace("-", "")) if iso else unknown

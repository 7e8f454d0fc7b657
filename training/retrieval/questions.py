"""A pack's labelled questions (`queries.json`): what lambda is tuned on, and what a ranking is tested on.

Which of the two a question serves is decided by the hash of its words, so that neither grows at the other's expense.
"""

import hashlib
from collections.abc import Iterator, Mapping, Set
from pathlib import Path
from typing import Literal

import msgspec

from drivemcp.errors import MALFORMED
from services.retrieval.corpus import CorpusError, Text
from services.retrieval.library import Request

FILE = "queries.json"
DEPTH = 10
Split = Literal["development", "test", "fresh"]
Kind = Literal["sign", "right_of_way", "limit", "conduct", "colloquial", "misspelt", "out_of_scope", "near_miss"]
OUTSIDE = ("out_of_scope", "near_miss")
"""Kinds without an answer in the law; a near miss has a driver's words: tax, insurance, wages, cleaning, mechanics, history."""


class Question(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A question in a driver's words, and the provisions or signs (`sign:<code>`) of which any answers it."""

    query: str
    language: str
    kind: Kind
    expect: tuple[str, ...] = ()
    """Empty for what has no answer in the law and must be refused."""
    use: Split | None = None
    """Which split it is for, where the hash does not say: `test` for questions of other authors, `fresh` for those written after tuning."""
    jurisdiction: str = ""
    """The pack's, filled in when it is read."""

    @property
    def split(self) -> Split:
        """As said, else by the first byte of the SHA-256 of its words: two in five for development."""
        return self.use or ("development" if hashlib.sha256(self.query.encode()).digest()[0] % 5 < 2 else "test")


def asked(question: Question) -> Request:
    """A question as a driver's, who does not know where the answer stands."""
    return Request(
        query=question.query, jurisdiction=question.jurisdiction, corpus="all", language=question.language, k=DEPTH
    )


def read_questions(packs: Mapping[Path, tuple[Text, ...]]) -> tuple[Question, ...]:
    """The questions of all packs whose texts are given; an answer may stand in any pack of the country. Raises CorpusError."""
    known = {(text.jurisdiction, text.name) for texts in packs.values() for text in texts}
    return tuple(
        question
        for folder, texts in packs.items()
        if texts and (folder / FILE).is_file()
        for question in _read(folder / FILE, texts[0].jurisdiction, known)
    )


def _read(path: Path, jurisdiction: str, known: Set[tuple[str, str]]) -> Iterator[Question]:
    try:
        found = msgspec.json.decode(path.read_bytes(), type=list[Question])
    except MALFORMED as error:
        raise CorpusError(f"{path}: {error}") from None
    for at, question in enumerate(found):
        missing = [name for name in question.expect if not known & {(jurisdiction, name), (jurisdiction[:3], name)}]
        if missing:
            raise CorpusError(
                f"{path}: [{at}].expect: no provision or sign {missing[0]!r} in the packs of {jurisdiction}"
            )
        if bool(question.expect) == (question.kind in OUTSIDE):
            raise CorpusError(f"{path}: [{at}].expect: is to be empty just where kind is {' or '.join(OUTSIDE)}")
        yield msgspec.structs.replace(question, jurisdiction=jurisdiction)

"""A pack's labelled questions (`queries.json`): what lambda is tuned on, and what a ranking is tested on.

Which of the two a question serves is decided by the hash of its words, so that neither grows at the other's expense.
"""

import hashlib
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import Literal

import msgspec

from drivemcp.errors import MALFORMED
from services.retrieval.corpus import CorpusError, Text

FILE = "queries.json"
Split = Literal["development", "test"]
Kind = Literal["sign", "right_of_way", "limit", "conduct", "colloquial", "misspelt", "out_of_scope"]


class Question(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A question in a driver's words, and the provisions or signs (`sign:<code>`) of which any answers it."""

    query: str
    language: str
    kind: Kind
    expect: tuple[str, ...] = ()
    """Empty for what has no answer in the law and must be refused."""
    jurisdiction: str = ""
    """The pack's, filled in when it is read."""

    @property
    def split(self) -> Split:
        """By the first byte of the SHA-256 of its words: two in five for development."""
        return "development" if hashlib.sha256(self.query.encode()).digest()[0] % 5 < 2 else "test"


def read_questions(packs: Mapping[Path, tuple[Text, ...]]) -> tuple[Question, ...]:
    """The questions of all packs whose texts are given; an answer may stand in any pack of the country. Raises CorpusError."""
    known = {(text.jurisdiction, text.name) for texts in packs.values() for text in texts}
    return tuple(
        question
        for folder, texts in packs.items()
        if texts and (folder / FILE).is_file()
        for question in _read(folder / FILE, texts[0].jurisdiction, known)
    )


def _read(path: Path, jurisdiction: str, known: Collection[tuple[str, str]]) -> Iterator[Question]:
    try:
        found = msgspec.json.decode(path.read_bytes(), type=list[Question])
    except MALFORMED as error:
        raise CorpusError(f"{path}: {error}") from None
    for at, question in enumerate(found):
        missing = [name for name in question.expect if (jurisdiction, name) not in known]
        if missing:
            raise CorpusError(
                f"{path}: [{at}].expect: no provision or sign {missing[0]!r} in the packs of {jurisdiction}"
            )
        if bool(question.expect) == (question.kind == "out_of_scope"):
            raise CorpusError(f"{path}: [{at}].expect: is to be empty just where kind is out_of_scope")
        yield msgspec.structs.replace(question, jurisdiction=jurisdiction)

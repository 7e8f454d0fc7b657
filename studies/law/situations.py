"""The situations with known answers, and the book of all rulepacks that restate real law."""

from pathlib import Path
from typing import Any, Literal

import msgspec

from drivemcp.paths import data
from services.rules.book import RuleBook, load_book
from services.rules.errors import PackError
from services.rules.packs.format import Case

TABLE = Path(__file__).parent / "situations.json"
MADE_UP = frozenset({"TEST-v1"})
"""Packs of no real country; loaded beside the others they would answer where the country is unknown."""


class Situation(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One entry of `situations.json`: a pack's case, the pack whose law answers, and where that law says so."""

    name: str
    pack: str
    tool: Literal["applicable_limit", "interpret_sign", "right_of_way"]
    ask: dict[str, Any]
    expect: dict[str, Any]
    source: str

    @property
    def case(self) -> Case:
        """As the rule book is asked."""
        return Case(name=self.name, tool=self.tool, ask=self.ask, expect=self.expect)


def situations() -> list[tuple[str, Case]]:
    """Pack and case of every entry of the table, which was written from the law."""
    return [(entry.pack, entry.case) for entry in read_table()]


def read_table() -> list[Situation]:
    """The table as it stands. Raises msgspec.ValidationError where an entry has another form."""
    return msgspec.json.decode(TABLE.read_bytes(), type=list[Situation])


def own_cases(book: RuleBook) -> list[tuple[str, Case]]:
    """Pack and case of what the packs say of themselves."""
    return [(name, case) for name, pack in book.packs.items() for case in pack.cases]


def every_book() -> RuleBook:
    """All rulepacks of real law. Raises PackError where one cannot be used."""
    folders = sorted(path.parent for path in data("rulepacks").glob("*/manifest.json"))
    book, refused = load_book([folder for folder in folders if folder.name not in MADE_UP])
    if refused:
        raise PackError("; ".join(refused))
    return book

"""Pack against table, cell by cell, and which differences are explained."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import msgspec

from domain.units import to_mps
from proto.rules import LegalLimit
from services.rules.book import RuleBook
from services.rules.limits.limit_answer import applicable_limit
from studies.default_limits.cells import MINIMUM, ROADS, VEHICLES, WEATHERS, Cell, cells, code, question
from studies.default_limits.speeds import Speed, limit_of, minimum_of
from studies.default_limits.table import Table

EXPLAINED = Path(__file__).parent / "explained.json"
ROUNDING_MPS = 1e-6
WALKS_MPS = to_mps(10.0, "km/h")
"""The law's walking pace lies between 4 and 10 km/h: of two such limits neither is above the other."""
Result = Literal["agree", "below", "above"]
NONE = "none"


class Found(msgspec.Struct, frozen=True, kw_only=True):
    """A cell with both limits in words, `none` where there is no limit; below: the pack allows less."""

    cell: Cell
    table: str
    ours: str
    result: Result


class Explanation(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One entry of `explained.json`: the cells of all these places, roads, classes and weathers, which differ alike."""

    pack: str
    places: tuple[str, ...]
    roads: tuple[str, ...]
    vehicles: tuple[str, ...]
    weathers: tuple[str, ...] = tuple(WEATHERS)
    table: str
    ours: str
    right: Literal["pack", "table", "both"]
    """Whose value is the law's; both: the law has two, and the pack takes the lower. A pack is never above the law."""
    law: str
    """Where the law says so."""
    why: str

    def cells(self) -> Iterator[Cell]:
        """All that it explains."""
        for place in self.places:
            for road in self.roads:
                for vehicle in self.vehicles:
                    yield from (Cell(self.pack, place, road, vehicle, weather) for weather in self.weathers)


class Compared(msgspec.Struct, frozen=True, kw_only=True):
    """All cells, and what of their differences is not as explained."""

    found: tuple[Found, ...]
    unexplained: tuple[str, ...]
    outdated: tuple[str, ...]
    """Explanations of cells that do not differ, or differ otherwise."""

    def counts(self) -> dict[str, Counter[Result]]:
        """By pack."""
        counts = dict[str, Counter[Result]]()
        for each in self.found:
            counts.setdefault(each.cell.pack, Counter())[each.result] += 1
        return counts


def read_explained(path: Path = EXPLAINED) -> list[Explanation]:
    """Raises msgspec.ValidationError where an entry has another form."""
    return msgspec.json.decode(path.read_bytes(), type=list[Explanation])


def compare(book: RuleBook, table: Table, explained: list[Explanation]) -> Compared:
    """Ask the rules for every cell. A cell that is explained twice counts as outdated."""
    found = tuple(_found(book, table, cell) for cell in cells(book, table))
    differing = {each.cell: each for each in found if each.result != "agree"}
    asked = {each.cell.pack for each in found}
    by_cell, outdated = dict[Cell, Explanation](), list[str]()
    for explanation in explained:
        for cell in explanation.cells() if explanation.pack in asked else ():
            there = differing.get(cell)
            same = there is not None and (there.table, there.ours) == (explanation.table, explanation.ours)
            if not same or cell in by_cell or (there is not None and _excuses_too_much(there, explanation)):
                outdated.append(f"{cell}: explained as table {explanation.table}, pack {explanation.ours}")
            by_cell[cell] = explanation
    unexplained = [_told(each) for cell, each in sorted(differing.items()) if cell not in by_cell]
    return Compared(found=found, unexplained=tuple(unexplained), outdated=tuple(outdated))


def _excuses_too_much(found: Found, explanation: Explanation) -> bool:
    """A pack above the table's limit is right only where the pack's value is the law's."""
    return found.result == "above" and explanation.right != "pack"


def _found(book: RuleBook, table: Table, cell: Cell) -> Found:
    row = table.row(code(cell.place), ROADS[cell.road].tags)
    tags = row.tags if row is not None else {}
    answer = applicable_limit(book, question(cell))
    if cell.vehicle == MINIMUM:
        theirs, ours = minimum_of(tags), answer.minimum
    else:
        theirs = limit_of(tags, VEHICLES[cell.vehicle][0], WEATHERS[cell.weather])
        ours = answer.limit if answer.limit is not None and not answer.limit.advisory else None
    without = 0.0 if cell.vehicle == MINIMUM else float("inf")
    return Found(cell=cell, table=_shown(theirs), ours=_shown(ours), result=_result(theirs, ours, without))


def _result(theirs: Speed | None, ours: LegalLimit | None, without: float) -> Result:
    left = ours.mps if ours is not None else without
    right = theirs.mps if theirs is not None else without
    if left == right or abs(left - right) < ROUNDING_MPS or max(left, right) < WALKS_MPS:
        return "agree"
    return "below" if left < right else "above"


def _shown(speed: Speed | LegalLimit | None) -> str:
    return NONE if speed is None else f"{speed.value:g} {speed.unit}"


def _told(found: Found) -> str:
    return f"{found.cell}: {found.result}: table {found.table}, pack {found.ours}"

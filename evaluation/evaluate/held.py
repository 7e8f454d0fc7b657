"""What holds and what does not, by the goals of all tables, in few lines. Pure."""

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from evaluation.guard.table import Cell
from evaluation.isa.table import Row, judged
from evaluation.tables import goals
from evaluation.tables.tables import Table

MOST_LINES = 30
HOLDS, UNKNOWN = "holds", "not measured"


class Goal(NamedTuple):
    """One goal of one table."""

    what: str
    wanted: str
    found: str
    verdict: str


Part = tuple[str, Sequence[Goal]]
"""A table's name and its goals."""


def of_isa(rows: Iterable[Row]) -> Iterator[Goal]:
    """The rows of speed assistance that have a goal."""
    for row in rows:
        if row[2]:
            yield Goal(row[0], row[2], row[1], judged(row) or UNKNOWN)


def of_guard(cells: Iterable[Cell]) -> Iterator[Goal]:
    """The cells of which something is asked."""
    for cell in cells:
        if cell.verdict or not cell.runs:
            verdict = HOLDS if cell.verdict == HOLDS else "missed" if cell.runs else UNKNOWN
            yield Goal(f"{cell.scene}, {cell.ground}, {cell.speed_kmh} km/h", HOLDS, cell.verdict or "-", verdict)


def of_tables(tables: Sequence[Table]) -> Iterator[Goal]:
    """What is wanted of the paper's tables."""
    for each in goals.judged(tables):
        yield Goal(each.what, each.bound, each.found, each.verdict)


def lines(parts: Sequence[Part], most: int = MOST_LINES) -> list[str]:
    """Markdown: of each table how many goals hold, then those that are missed, as many of each table as there is room for."""
    heads = [f"- **{name}**: {_counted(found)}." for name, found in parts]
    missed = [[goal for goal in found if goal.verdict.startswith("missed")] for _, found in parts]
    room, total = most - len(heads), sum(map(len, missed))
    shares = [0] * len(parts)
    for _ in range(min(total, room if total <= room else room - 1)):
        shares[_behind(shares, missed)] += 1
    told = [
        _missed(name, goal)
        for (name, _), share, goals in zip(parts, shares, missed, strict=True)
        for goal in goals[:share]
    ]
    more = total - len(told)
    return [*heads, *told, *([f"- and {more} more, below."] if more else [])]


def _behind(shares: Sequence[int], goals: Sequence[Sequence[Goal]]) -> int:
    """The table with the smallest share that has more to tell."""
    return min((at for at, share in enumerate(shares) if share < len(goals[at])), key=lambda at: shares[at])


def _counted(found: Sequence[Goal]) -> str:
    verdicts = [goal.verdict for goal in found]
    others = [name for name in dict.fromkeys(verdicts) if name != HOLDS]
    return "; ".join(
        [f"{verdicts.count(HOLDS)} of {len(found)} goals hold", *(f"{verdicts.count(name)} {name}" for name in others)]
    )


def _missed(name: str, goal: Goal) -> str:
    return f"- {name}, {goal.verdict}: {goal.what}; wanted {goal.wanted}, found {goal.found}."

"""Rows beside one another: run by run in the same places, and in the paper's orders, where absolute numbers cannot be compared."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import combinations
from statistics import fmean
from typing import Literal

import msgspec

from evaluation.campaign.plan import FAULTY, OURS, SOUND
from evaluation.statistics import CHANCE, chance_of, paired
from evaluation.tables.assumed import assumed
from evaluation.tables.columns import COLUMNS, Column
from evaluation.tables.tables import Table, TableRow, Value, by_number, mean_of

AGAINST = "Place by place: each row less DriveMCP, or less its group's first"
WITH_FAULTS = "The same scene, with and without the fault: each method in the faulty car less itself in the sound one"
HOW_AGAINST = (
    "The mean difference over the places in which both have the number (how many), with Student's 95 % interval; bold where a "
    f"randomisation of the pairs comes as far by chance in fewer than {CHANCE * 100:g} % of cases, for which eight places, "
    "and the mean, have to differ by half of the last digit shown."
)
Verdict = Literal["as in the paper", "the other way round", "without a significant difference", "not measured"]


class Difference(msgspec.Struct, frozen=True, kw_only=True):
    """One number of two rows: the mean difference over the places in which both have it, first less second."""

    group: str
    first: str
    second: str
    column: Column
    value: Value
    places: int
    chance: float | None
    """How often chance alone parts two rows as far (`evaluation.statistics.chance_of`); None: no place in common."""
    assumed: bool = False
    """Of a latency that was not measured: there is no difference."""

    @property
    def told_apart(self) -> bool:
        """Whether it is more than chance, and more than nothing to a reader."""
        seen = self.value.value is not None and abs(self.value.value) >= self.column.least
        return seen and self.chance is not None and self.chance < CHANCE


class Order(msgspec.Struct, frozen=True, kw_only=True):
    """Two rows that the paper puts in an order in one column, and what ours say."""

    group: str
    column: str
    first: str
    """Larger in the paper."""
    second: str
    paper_ratio: float | None
    """First over second; None: over nothing."""
    our_ratio: float | None
    """Of the means over the places in which both have the number, as the verdict."""
    places: int
    verdict: Verdict
    assumed: bool = False
    """Of a latency that was not measured: no verdict."""


def summary(found: Sequence[Order]) -> str:
    """How many of each verdict, and why latencies have none."""
    verdicts = [one.verdict for one in found]
    counts = ", ".join(f"{verdicts.count(verdict)} {verdict}" for verdict in dict.fromkeys(verdicts))
    without = sum(one.assumed for one in found)
    why = (
        f" ({without} of them latencies that are assumed: none of the tools that a row's advice waits for was measured)"
    )
    return counts + (why if without else "")


def told_of(found: Difference) -> str:
    """The difference with its sign, its 95 % interval, and of how many places."""
    value, places = found.value, found.column.places
    if value.value is None:
        return "-"
    low, high = value.low, value.high
    interval = "" if low is None or high is None else f" [{low:+.{places}f}, {high:+.{places}f}]"
    return f"{value.value:+.{places}f}{interval} ({found.places})"


def lines_of(found: Sequence[Difference]) -> Iterator[tuple[str, str, list[Difference]]]:
    """(group, which less which, its differences by column) of each row that has a place in common with the other."""
    for pair in dict.fromkeys((one.group, one.first, one.second) for one in found):
        line = [one for one in found if (one.group, one.first, one.second) == pair]
        if any(one.places for one in line):
            yield pair[0], f"{pair[1]} less {pair[2]}", line


def against(table: Table) -> tuple[Difference, ...]:
    """Each row less DriveMCP's of its group, or less the group's first where that has none: all columns that the paper has."""
    found = list[Difference]()
    for rows in table.groups.values():
        ours = next((row for row in rows if row.row.label == OURS), rows[0])
        found += [
            difference(table, column, row, ours)
            for row in rows if row is not ours
            for column in table.columns if column in COLUMNS[table.name]
        ]  # fmt: skip
    return tuple(found)


def with_and_without_faults(table: Table) -> tuple[Difference, ...]:
    """Each method in the faulty car less the same method in the sound one; none in a table without faults."""
    rows = {row.row.key: row for row in table.rows} if table.name == "can-fault" else {}
    return tuple(
        msgspec.structs.replace(
            difference(table, column, rows[f"{method}/{FAULTY}"], rows[f"{method}/{SOUND}"]),
            group=method, first="in the faulty car", second="in the sound one",
        )
        for method in dict.fromkeys(key.partition("/")[0] for key in rows)
        for column in table.columns if column in COLUMNS[table.name]
    )  # fmt: skip


def comparisons(table: Table) -> tuple[tuple[str, tuple[Difference, ...]], ...]:
    """(what is compared, row by row) of all that page and report tell place by place."""
    return (AGAINST, against(table)), (WITH_FAULTS, with_and_without_faults(table))


def difference(table: Table, column: Column, one: TableRow, other: TableRow) -> Difference:
    """The first less the second, place by place; a latency that was not measured has no difference."""
    unmeasured = any(assumed(column, row.row.spec) for row in (one, other))
    mine, theirs = ({}, {}) if unmeasured else (by_number(column, one), by_number(column, other))
    both = sorted(mine.keys() & theirs.keys())
    values = [mine[number] for number in both], [theirs[number] for number in both]
    return Difference(
        group=one.row.group, first=table.label(one), second=table.label(other), column=column, value=mean_of(paired(*values)),
        places=len(both), chance=chance_of(*values, column.least), assumed=unmeasured,
    )  # fmt: skip


def orders(table: Table) -> tuple[Order, ...]:
    """Every pair of rows of a group, in every column that the paper has."""
    return tuple(
        order
        for group in table.groups.values()
        for at, column in enumerate(table.columns)
        for order in _of_column(table, column, at, [row for row in group if row.row.paper])
    )


def _of_column(table: Table, column: Column, at: int, rows: Iterable[TableRow]) -> Iterator[Order]:
    for pair in combinations(rows, 2):
        numbers = [row.values[at].paper for row in pair]
        if None in numbers or numbers[0] == numbers[1]:
            continue
        large, small = sorted(pair, key=lambda row: -(row.values[at].paper or 0.0))
        one, other = large.values[at], small.values[at]
        apart = difference(table, column, large, small)
        ours = None if apart.assumed else _ratio_of_means(by_number(column, large), by_number(column, small))
        yield Order(
            group=large.row.group, column=column.title, first=large.row.label, second=small.row.label, places=apart.places,
            paper_ratio=_ratio(one.paper, other.paper), our_ratio=ours,
            verdict=_verdict(apart), assumed=apart.assumed,
        )  # fmt: skip


def _ratio_of_means(one: Mapping[int, float], other: Mapping[int, float]) -> float | None:
    both = one.keys() & other.keys()
    return _ratio(*(fmean(each[number] for number in sorted(both)) for each in (one, other))) if both else None


def _ratio(one: float | None, other: float | None) -> float | None:
    return one / other if one is not None and other else None


def _verdict(apart: Difference) -> Verdict:
    if apart.value.value is None:
        return "not measured"
    if not apart.told_apart:
        return "without a significant difference"
    return "as in the paper" if apart.value.value > 0.0 else "the other way round"

"""Ours beside the paper's where absolute numbers cannot be compared: orderings and ratios."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations
from typing import Literal

import msgspec

from evaluation.evaluate.assumed import assumed
from evaluation.evaluate.columns import Column
from evaluation.evaluate.tables import Table, TableRow, Value

Verdict = Literal["as in the paper", "the other way round", "not told apart", "not measured"]


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
    verdict: Verdict
    assumed: bool = False
    """Of a latency that nobody measured: no verdict."""


def summary(found: Sequence[Order]) -> str:
    """How many of each verdict, and why latencies have none."""
    verdicts = [one.verdict for one in found]
    counts = ", ".join(f"{verdicts.count(verdict)} {verdict}" for verdict in dict.fromkeys(verdicts))
    without = sum(one.assumed for one in found)
    why = (
        f" ({without} of them latencies that are assumed: none of the tools that a row's advice waits for was measured)"
    )
    return counts + (why if without else "")


def orders(table: Table) -> tuple[Order, ...]:
    """Every pair of rows of a group, in every column that the paper has."""
    return tuple(
        order
        for rows in _groups(table)
        for at, column in enumerate(table.columns)
        for order in _of_column(column, at, rows)
    )


def _groups(table: Table) -> Iterator[list[TableRow]]:
    told = [row for row in table.rows if row.row.paper]
    for group in dict.fromkeys(row.row.group for row in told):
        yield [row for row in told if row.row.group == group]


def _of_column(column: Column, at: int, rows: Iterable[TableRow]) -> Iterator[Order]:
    for pair in combinations(rows, 2):
        numbers = [row.values[at].paper for row in pair]
        if None in numbers or numbers[0] == numbers[1]:
            continue
        large, small = sorted(pair, key=lambda row: -(row.values[at].paper or 0.0))
        one, other = large.values[at], small.values[at]
        unmeasured = any(assumed(column, row.row.spec) for row in pair)
        yield Order(
            group=large.row.group, column=column.title, first=large.row.label, second=small.row.label,
            paper_ratio=_ratio(one.paper, other.paper), our_ratio=None if unmeasured else _ratio(one.value, other.value),
            verdict="not measured" if unmeasured else _verdict(one, other), assumed=unmeasured,
        )  # fmt: skip


def _ratio(one: float | None, other: float | None) -> float | None:
    return one / other if one is not None and other else None


def _verdict(one: Value, other: Value) -> Verdict:
    """Told apart are intervals that do not overlap: stricter than a test at 5 %."""
    if one.value is None or other.value is None:
        return "not measured"
    if one.low is None or one.high is None or other.low is None or other.high is None:
        return "not told apart"
    if one.low > other.high:
        return "as in the paper"
    if one.high < other.low:
        return "the other way round"
    return "not told apart"

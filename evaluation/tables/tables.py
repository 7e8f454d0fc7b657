"""Rows of runs become numbers with 95 % intervals, beside the paper's. Pure."""

from collections.abc import Mapping, Sequence
from statistics import fmean, median
from typing import Any

import msgspec

from evaluation.campaign.names import TableName
from evaluation.campaign.plan import Row
from evaluation.campaign.store import Kept
from evaluation.metrics import RATES
from evaluation.run.methods import made_with
from evaluation.run.spec import Sensors
from evaluation.statistics import Spread, binomial_ci, mean_sd_ci, poisson_ci, ratio_ci
from evaluation.tables.columns import Column, columns_of
from evaluation.tables.paper import paper_rows

INTERVALS = (
    "Rates have the exact Poisson interval of all runs together (which takes events for independent: it is too narrow for infractions and "
    "nags, of which some drives have many, and what differs place by place tells more), shares the exact binomial one, seconds an hour "
    "Student's for the ratio of sums, other numbers Student's for the mean over runs"
)
"""What page and report say of `Value.low` and `high`."""


class Value(msgspec.Struct, frozen=True, kw_only=True):
    """A number of a table, and its 95 % interval."""

    value: float | None = None
    sd: float | None = None
    """Over the runs."""
    low: float | None = None
    high: float | None = None
    of: str = ""
    """What it is made of: `3 in 12.4 km`, `5 runs`."""
    paper: float | None = None
    paper_spread: float | None = None


class Ran(msgspec.Struct, frozen=True, kw_only=True):
    """One run behind a row."""

    key: str
    number: int
    seed: int
    kept: Kept | None
    problem: str = ""
    seconds: float = 0.0
    """How long it was asked to drive; 0: the whole route."""


class TableRow(msgspec.Struct, frozen=True, kw_only=True):
    """A row with its numbers, by column."""

    row: Row
    runs: tuple[Ran, ...]
    values: tuple[Value, ...]
    km: float
    missing: int
    """Runs that were asked for and are not there."""

    @property
    def backend(self) -> str:
        """Which made its advice."""
        return made_with(self.row.spec)


class Table(msgspec.Struct, frozen=True, kw_only=True):
    """A whole table."""

    name: TableName
    sensors: Sensors
    backend: str
    """Those of the rows, comma between them."""
    columns: tuple[Column, ...]
    rows: tuple[TableRow, ...]

    @property
    def groups(self) -> dict[str, list[TableRow]]:
        """The rows by group, in the order of the table."""
        groups: dict[str, list[TableRow]] = {}
        for row in self.rows:
            groups.setdefault(row.row.group, []).append(row)
        return groups

    def label(self, row: TableRow) -> str:
        """A row's, with its backend where not all rows have the same."""
        return row.row.label if row.backend == self.backend else f"{row.row.label} ({row.backend})"


def table_of(name: TableName, rows: Sequence[Row], ran: Mapping[str, Sequence[Ran]]) -> Table:
    """The table; `ran` has each row's runs by the row's key."""
    columns = columns_of(name)
    found = tuple(_row(row, tuple(ran.get(row.key, ())), columns) for row in rows)
    sensors: Sensors = rows[0].spec.sensors
    backend = ", ".join(dict.fromkeys(row.backend for row in found))
    return Table(name=name, sensors=sensors, backend=backend, columns=columns, rows=found)


def _row(row: Row, runs: tuple[Ran, ...], columns: Sequence[Column]) -> TableRow:
    measured = [run.kept.metrics for run in runs if run.kept is not None]
    paper = paper_rows(row.table).get(row.paper, {})
    values = tuple(_beside(value_of(column, measured), column, paper) for column in columns)
    km = sum(metrics.get("distance_m") or 0.0 for metrics in measured) / 1000
    return TableRow(row=row, runs=runs, values=values, km=km, missing=len(runs) - len(measured))


def _beside(value: Value, column: Column, paper: Mapping[str, float]) -> Value:
    return msgspec.structs.replace(value, paper=paper.get(column.paper), paper_spread=paper.get(column.paper_spread))


def value_of(column: Column, measured: Sequence[Mapping[str, Any]]) -> Value:
    """A column's number of some runs' metrics."""
    if column.rate:
        return _rate(column.rate, measured)
    if all(column.share):
        return _share(column.share, measured)
    return _mean(column, measured)


def _rate(name: str, measured: Sequence[Mapping[str, Any]]) -> Value:
    rate = RATES[name]
    counted = [
        (run[rate.count], run[rate.exposure])
        for run in measured
        if None not in map(run.get, (rate.count, rate.exposure))
    ]
    count, over = sum(each for each, _ in counted), sum(each for _, each in counted)
    sd = mean_sd_ci([each / over_run * rate.per for each, over_run in counted if over_run]).sd
    if rate.exposure == "seconds":
        of = f"{count:.0f} s in {over / 3600:.2f} h"
        spread = ratio_ci([each * rate.per for each, _ in counted], [each for _, each in counted])
        return Value(value=spread.mean, sd=sd, low=_from_zero(spread.low), high=spread.high, of=of)
    exact = poisson_ci(count, over, rate.per)
    return Value(value=exact.value, sd=sd, low=exact.low, high=exact.high, of=f"{count} in {over / 1000:.1f} km")


def _from_zero(end: float | None) -> float | None:
    """Nothing that we measure can be negative, and no interval of it need reach there."""
    return None if end is None else max(0.0, end)


def _share(counts: tuple[str, str], measured: Sequence[Mapping[str, Any]]) -> Value:
    pairs = [tuple(measure_of(run, name) for name in counts) for run in measured]
    known = [pair for pair in pairs if None not in pair]
    part, whole = (sum(pair[at] for pair in known) for at in (0, 1))
    exact = binomial_ci(part, whole)
    scaled = [None if each is None else each * 100 for each in (exact.value, exact.low, exact.high)]
    return Value(value=scaled[0], low=scaled[1], high=scaled[2], of=f"{part} of {whole}")


def _mean(column: Column, measured: Sequence[Mapping[str, Any]]) -> Value:
    values = [each for each in (per_run(column, run) for run in measured) if each is not None]
    spread = mean_sd_ci(values)
    high = None if spread.high is None else min(spread.high, column.most)
    return Value(value=spread.mean, sd=spread.sd, low=_from_zero(spread.low), high=high, of=f"{spread.n} runs")


def measure_of(run: Mapping[str, Any], name: str) -> Any:
    """A run's measure by its name in a column; None: it has none, or none of that kind."""
    field, _, kind = name.partition(".")
    value = run.get(field)
    return (value or {}).get(kind) if kind else value


def per_run(column: Column, run: Mapping[str, Any]) -> float | None:
    """The column's number of one run; None: nothing of the kind happened, or it could not be measured."""
    if column.rate:
        rate = RATES[column.rate]
        count, over = run.get(rate.count), run.get(rate.exposure)
        return count / over * rate.per if count is not None and over else None
    if all(column.share):
        part, whole = (measure_of(run, name) for name in column.share)
        return part / whole * 100 if part is not None and whole else None
    value = measure_of(run, column.field)
    if isinstance(value, list | tuple):
        value = (fmean if column.of == "mean" else median)(value) if value else None
    return value * column.scale if value is not None else None


def mean_of(pairs: Spread) -> Value:
    """The mean of differences in pairs."""
    return Value(value=pairs.mean, sd=pairs.sd, low=pairs.low, high=pairs.high, of=f"{pairs.n} pairs")


def by_number(column: Column, row: TableRow) -> dict[int, float]:
    """The column's number of each run of a row that has one, by the run's number: the same place, driver and traffic in all rows."""
    values = {run.number: per_run(column, run.kept.metrics) for run in row.runs if run.kept is not None}
    return {number: value for number, value in values.items() if value is not None}

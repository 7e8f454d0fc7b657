"""What we want to read for DriveMCP with the calibrated profile, and whether what was driven shows it."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from statistics import fmean
from typing import Literal

import msgspec

from evaluation.campaign.names import TableName
from evaluation.campaign.plan import FAMILIES, OURS
from evaluation.metrics import RATES
from evaluation.run.methods import OBEDIENT
from evaluation.statistics import poisson_ci
from evaluation.tables.assumed import assumed
from evaluation.tables.columns import (
    COLLISIONS,
    F1,
    FALSE,
    INFRACTIONS,
    LATENCY_P50,
    NAGS,
    OVERSPEED,
    RESPONSE,
    TOOLS,
    TTC,
    UNTOLD,
    Column,
)
from evaluation.tables.compare import difference
from evaluation.tables.tables import Table, TableRow, Value, by_number

Verdict = Literal["holds", "holds in the mean, not proven", "missed in the mean, not proven", "missed", "not measured"]
NO_EVENT = poisson_ci(0, 1.0).high or 0.0
"""With no event in D the upper end of the rate's interval, by which goals are judged, is 3.7/D."""


MOST_PLACES = 6
"""So many show on which side of its bound a number is."""


class Goal(msgspec.Struct, frozen=True, kw_only=True):
    """A bound on one number of one row."""

    table: TableName
    row: str
    column: Column
    bound: float
    strict: bool = False


class Judged(msgspec.Struct, frozen=True, kw_only=True):
    """A goal and what was found."""

    what: str
    bound: str
    found: str
    verdict: Verdict
    distance: str = ""
    """What the distance allows, for rates."""


_FAMILY_GOALS = {"urb-rain": (0.15, 0.45), "cross-border": (0.10, 0.35), "dynamic-vsl": (0.10, 0.30)}


def _goals() -> Iterator[Goal]:
    for family, (infractions, overspeed) in _FAMILY_GOALS.items():
        row = f"{family}/{OURS}"
        yield Goal(table="results", row=row, column=INFRACTIONS, bound=infractions)
        yield Goal(table="results", row=row, column=OVERSPEED, bound=overspeed)
        yield Goal(table="results", row=row, column=RESPONSE, bound=0.5)
        yield Goal(table="results", row=row, column=TTC, bound=2.5)
        yield Goal(table="results", row=row, column=LATENCY_P50, bound=0.1)
        yield Goal(table="results", row=row, column=F1, bound=97.0)
        yield Goal(table="results", row=row, column=TOOLS, bound=97.0)
        yield Goal(table="results", row=row, column=NAGS, bound=1.0, strict=True)
        yield Goal(table="results", row=row, column=FALSE, bound=2.0)
        yield Goal(table="results", row=f"{family}/{OBEDIENT.label}", column=UNTOLD, bound=0.2)
    for row, least in (("clean", 97.0), ("sign_miss_30", 85.0)):
        yield Goal(table="corruption", row=row, column=F1, bound=least)
        yield Goal(table="corruption", row=row, column=TOOLS, bound=least)


GOALS: tuple[Goal, ...] = tuple(_goals())


def judged(tables: Sequence[Table]) -> tuple[Judged, ...]:
    """All goals whose rows were asked for."""
    by_name = {table.name: table for table in tables}
    asked = {(table.name, row.row.key) for table in tables for row in table.rows}
    told = [_judge(goal, by_name[goal.table]) for goal in GOALS if (goal.table, goal.row) in asked]
    return (*told, *(_against(by_name["results"]) if "results" in by_name else ()))


def _judge(goal: Goal, table: Table) -> Judged:
    rows = {row.row.key: row for row in table.rows}
    column, row = goal.column, rows[goal.row]
    value = Value(value=None) if assumed(column, row.row.spec) else _value(table, row, column)
    verdict, found = _verdict(value, goal), told(value, _shown(value, goal))
    if column is RESPONSE:
        verdict, found = _of_those_answered(verdict, row), f"{found}{_answered(row)}"
    sign = ">=" if column.better == "more" else "<" if goal.strict else "<="
    named = row.row.group if table.name == "results" else row.row.label
    named += f", {row.row.label}" if row.row.label == OBEDIENT.label else ""
    return Judged(
        what=f"{named}, {column.title}",
        bound=f"{sign} {goal.bound:g} {column.unit}", found=found, verdict=verdict,
        distance=_distance(goal, row) if column.rate else "",
    )  # fmt: skip


def _answered(row: TableRow, numbers: Collection[int] | None = None) -> str:
    """Of how many hazards a response is told: one that was never answered has none."""
    answered, hazards = _hazards(row, numbers)
    return f", {answered} of {hazards} answered" if hazards else ""


def _of_those_answered(verdict: Verdict, row: TableRow, numbers: Collection[int] | None = None) -> Verdict:
    """A verdict on the responses that there were; with hazards that were never answered they prove nothing of all."""
    answered, hazards = _hazards(row, numbers)
    return "holds in the mean, not proven" if verdict == "holds" and answered < hazards else verdict


def _hazards(row: TableRow, numbers: Collection[int] | None) -> tuple[int, int]:
    """How many hazards were answered, and met, in the numbered runs of a row, or in all."""
    runs = [run.kept.metrics for run in row.runs if run.kept is not None and (numbers is None or run.number in numbers)]
    answered, hazards = (sum(run.get(name) or 0 for run in runs) for name in ("hazards_answered", "hazards"))
    return answered, hazards


def _value(table: Table, row: TableRow, column: Column) -> Value:
    at = [(each.title, each.unit) for each in table.columns].index((column.title, column.unit))
    return row.values[at]


def _shown(value: Value, goal: Goal) -> Column:
    """The goal's column, with as many places as it takes to see on which side of the bound the number is."""
    places = goal.column.places
    while value.value not in (None, goal.bound) and places < MOST_PLACES and round(value.value, places) == goal.bound:
        places += 1
    return msgspec.structs.replace(goal.column, places=places)


def told(value: Value, column: Column) -> str:
    """A number with its interval, in words."""
    if value.value is None:
        return "-"
    text = f"{value.value:.{column.places}f}"
    return text if value.low is None else f"{text} [{value.low:.{column.places}f}, {value.high:.{column.places}f}]"


def papers(value: Value) -> str:
    """The paper's number with its spread."""
    spread = f"±{value.paper_spread:g}" if value.paper_spread is not None else ""
    return f"{value.paper:g}{spread}" if value.paper is not None else ""


def _verdict(value: Value, goal: Goal) -> Verdict:
    if value.value is None:
        return "not measured"
    sign = -1.0 if goal.column.better == "more" else 1.0
    bound, found = sign * goal.bound, sign * value.value
    inside = found < bound if goal.strict else found <= bound
    if value.low is None or value.high is None:
        return "holds in the mean, not proven" if inside else "missed in the mean, not proven"
    worst, best = max(sign * value.low, sign * value.high), min(sign * value.low, sign * value.high)
    if inside:
        return "holds" if worst <= bound else "holds in the mean, not proven"
    return "missed" if best > bound else "missed in the mean, not proven"


def _distance(goal: Goal, row: TableRow) -> str:
    per_km = RATES[goal.column.rate].per / 1000
    if row.km <= 0.0:
        return "nothing was driven"
    least, needed = NO_EVENT / row.km * per_km, NO_EVENT / goal.bound * per_km
    can = "can" if least <= goal.bound else "cannot"
    return (
        f"{row.km:.1f} km: with no event at all the 95 % interval would end at {least:.2g} {goal.column.unit}; this distance "
        f"{can} prove {goal.bound:g} (that takes {needed:.0f} km without one)"
    )


def _against(results: Table) -> Iterator[Judged]:
    rows: Mapping[str, TableRow] = {row.row.key: row for row in results.rows}
    for family, name in FAMILIES.items():
        ours, rival, floor = (rows.get(f"{family}/{key}") for key in (OURS, "VLM-Tools-NoArbiter", "No-assistant"))
        if ours is not None and rival is not None:
            yield _no_slower(name, results, ours, rival)
        if ours is not None and floor is not None:
            yield _collisions(name, ours, floor)


def _no_slower(name: str, results: Table, ours: TableRow, rival: TableRow) -> Judged:
    """Run by run: DriveMCP may have driven many places that the other has not."""
    mine, other = (by_number(RESPONSE, row) for row in (ours, rival))
    both = mine.keys() & other.keys()
    apart = difference(results, RESPONSE, ours, rival)
    goal = Goal(table="results", row=ours.row.key, column=RESPONSE, bound=0.0)
    shown = _shown(apart.value, goal)
    means = [f"{fmean(each[number] for number in both):.{shown.places}f}" for each in (mine, other) if both]
    return Judged(
        what=f"{name}, hazard response", bound="<= VLM-Tools-NoArbiter's",
        found=f"{' against '.join(means) or '-'}, difference {told(apart.value, shown)}, of {apart.places} runs in which both "
        f"answered a hazard{_answered(ours, both)}",
        verdict=_of_those_answered(_verdict(apart.value, goal), ours, both),
    )  # fmt: skip


def _collisions(name: str, ours: TableRow, floor: TableRow) -> Judged:
    """Of the runs that both drove; where only ours did, what the driver alone would have met is not known."""
    both = _driven(ours) & _driven(floor)
    mine, other, alone = _collided(ours) & both, _collided(floor) & both, _collided(ours) - both
    found = f"runs {sorted(mine)} against {sorted(other)}" if mine or other else "none in either"
    found += f", of {len(both)} that both drove" + (
        f"; in {sorted(alone)}, which DriveMCP alone drove" if alone else ""
    )
    return Judged(
        what=f"{name}, {COLLISIONS.title}", bound="none that No-assistant does not have", found=found,
        verdict="missed" if mine - other else "holds in the mean, not proven" if both and not alone else "not measured",
    )  # fmt: skip


def _driven(row: TableRow) -> set[int]:
    return {run.number for run in row.runs if run.kept is not None}


def _collided(row: TableRow) -> set[int]:
    return {run.number for run in row.runs if run.kept is not None and run.kept.metrics.get("collisions")}

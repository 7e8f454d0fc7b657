"""The table: neighbours beside the floor and ours, on the same places, seeds, drivers and traffic."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import msgspec

from evaluation.campaign.plan import FAMILIES, TEST_SEED, as_asked
from evaluation.run.latencies import Latencies
from evaluation.run.methods import METHODS, applied
from evaluation.run.spec import RunSpec
from evaluation.scenarios import Family
from evaluation.tables.columns import COLLISIONS, INFRACTIONS, NEAR, OURS, Column
from evaluation.tables.tables import Value, value_of
from studies.neighbours.drive import NEIGHBOURS
from studies.output import Sheet

WITH_SERVICES = ("No-assistant", "DriveMCP")
LABELS = (WITH_SERVICES[0], *NEIGHBOURS, WITH_SERVICES[1])
TIME = Column(title="time", unit="s/km", better="", field="s_per_km", places=1)
_OURS = (
    "overspeed, true limit",
    "headway, median",
    "headway below 1 s",
    "hardest braking",
    "hard brakings",
    "jerk, rms",
)
COLUMNS = (COLLISIONS, NEAR, INFRACTIONS, *(column for column in OURS if column.title in _OURS), TIME)


class Cell(msgspec.Struct, frozen=True, kw_only=True):
    """One row: a label in one family, or in all of them."""

    family: str
    label: str
    runs: int
    km: float
    collisions: int
    values: tuple[Value, ...]
    """By column."""


def specs(
    label: str,
    families: Iterable[Family],
    runs: int,
    seconds: float = 0.0,
    latencies: Latencies | None = None,
    settings: Sequence[str] = (),
) -> list[RunSpec]:
    """A row's runs: those of `drivemcp evaluate results --sensors model`, with the same latencies and settings, whose kept ones
    are not driven again. Neighbours have no services, so that neither is theirs."""
    base = RunSpec(scenario="", sensors="model", method=label)
    spec = base if label in NEIGHBOURS else as_asked(applied(METHODS[label], base), latencies, settings)
    return [
        msgspec.structs.replace(spec, scenario=f"{family}/test/{number}", seed=TEST_SEED + number, seconds=seconds)
        for number in range(runs)
        for family in families
    ]


def cells(measured: Mapping[tuple[str, str], Sequence[Mapping[str, Any]]]) -> list[Cell]:
    """(family, label) -> its runs' metrics, to rows: each family's, then all together."""
    families = list(dict.fromkeys(family for family, _ in measured))
    found = [_cell(FAMILIES[family], label, measured[family, label]) for family, label in measured]  # type: ignore[index]
    if len(families) > 1:
        for label in dict.fromkeys(label for _, label in measured):
            found.append(_cell("all", label, [run for family in families for run in measured[family, label]]))
    return found


def _cell(family: str, label: str, runs: Sequence[Mapping[str, Any]]) -> Cell:
    timed = [{**run, TIME.field: _s_per_km(run)} for run in runs]
    return Cell(
        family=family,
        label=label,
        runs=len(runs),
        km=sum(run["distance_m"] or 0.0 for run in runs) / 1000.0,
        collisions=sum(run["collisions"] or 0 for run in runs),
        values=tuple(value_of(column, timed) for column in COLUMNS),
    )


def _s_per_km(run: Mapping[str, Any]) -> float | None:
    """Of runs that came through: a wreck stands for good."""
    return None if run["collisions"] or not run["distance_m"] else run["seconds"] / run["distance_m"] * 1000.0


def sheet(rows: Sequence[Cell], title: str = "") -> Sheet:
    """As the docs show it."""
    columns: tuple[str | Column, ...] = ("family", "row", "runs", Column(title="km", places=1), *COLUMNS)
    return Sheet(columns, [(row.family, row.label, row.runs, row.km, *row.values) for row in rows], title=title)

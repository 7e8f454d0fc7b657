"""Outcomes of cells as a table: what was avoided, beside what is permitted and what physics allows. Pure."""

from collections.abc import Iterator, Mapping, Sequence
from statistics import fmean
from types import MappingProxyType
from typing import Any

import msgspec

from evaluation.campaign.pages import csv_text
from evaluation.guard.outcome import Outcome
from evaluation.guard.scenes import SCENES, Ground, Kind

_FLOAT = 1e-6


class Beside(msgspec.Struct, frozen=True, kw_only=True):
    """The same cell with another in the guard's place (`beside.py`)."""

    runs: int
    missing: int
    contacts: int
    impact_mean_kmh: float | None
    impact_worst_kmh: float | None
    braked: int


class Cell(msgspec.Struct, frozen=True, kw_only=True):
    """A scene at a speed on a ground, over its seeds. Speeds in km/h; None: nothing of the kind happened, or no limit is known."""

    scene: str
    kind: Kind
    ground: Ground
    speed_kmh: int
    runs: int
    missing: int
    contacts: int
    impact_mean_kmh: float | None
    impact_worst_kmh: float | None
    permitted_kmh: float | None
    physics_kmh: float | None
    braked: int
    """Runs with any command to brake."""
    warned_least_s: float | None
    demanded_mps2: float | None
    """The hardest command (m/s2) of the run that braked least; of the run that braked most in a scene of false reactions."""
    verdict: str
    """`holds`, or what does not; empty where nothing is asked."""
    beside: dict[str, Beside] = {}
    """By method, where the table was asked for them."""


def beside_of(outcomes: Sequence[Outcome], missing: int) -> Beside:
    """What another in the guard's place came to."""
    impacts = [each.impact_kmh for each in outcomes]
    return Beside(
        runs=len(outcomes),
        missing=missing,
        contacts=sum(each > 0.0 for each in impacts),
        impact_mean_kmh=round(fmean(impacts), 1) if impacts else None,
        impact_worst_kmh=max(impacts, default=None),
        braked=sum(each.braked for each in outcomes),
    )


def cell_of(
    scene: str, speed_kmh: int, ground: Ground, outcomes: Sequence[Outcome], missing: int,
    beside: Mapping[str, Beside] = MappingProxyType({}),
) -> Cell:  # fmt: skip
    """The cell of its runs."""
    plan, ours = SCENES[scene], beside_of(outcomes, missing)
    warned = [each.warned_s for each in outcomes if each.warned_s is not None]
    braked = [each.demanded_mps2 for each in outcomes if each.braked]
    cell = Cell(
        scene=scene, kind=plan.kind, ground=ground, speed_kmh=speed_kmh, **msgspec.structs.asdict(ours), beside=dict(beside),
        permitted_kmh=plan.speeds[speed_kmh],
        physics_kmh=round(fmean(each.physics_kmh for each in outcomes), 1) if outcomes else None,
        warned_least_s=round(min(warned), 2) if warned else None,
        demanded_mps2=round((max if plan.kind == "pass" else min)(braked), 1) if braked else None,
        verdict="",
    )  # fmt: skip
    return msgspec.structs.replace(cell, verdict=verdict(cell))


def verdict(cell: Cell) -> str:
    """`holds`, or what does not; empty without runs, or where nothing is asked."""
    if not cell.runs:
        return ""
    if cell.kind == "pass":
        return "false reaction" if cell.braked else "holds"
    if cell.ground == "dry":
        if cell.permitted_kmh is None:
            return ""
        return "holds" if (cell.impact_worst_kmh or 0.0) <= cell.permitted_kmh + _FLOAT else "harder than permitted"
    return (
        "holds"
        if (cell.impact_mean_kmh or 0.0) <= (cell.physics_kmh or 0.0) + 5.0
        else "more than 5 km/h above physics"
    )


ROW = (
    "scene", "ground", "speed_kmh", "runs", "contacts", "impact_mean_kmh", "impact_worst_kmh", "permitted_kmh", "physics_kmh",
    "braked", "warned_least_s", "demanded_mps2", "verdict",
)  # fmt: skip
TITLES = (
    "scene", "ground", "km/h", "runs", "contacts", "impact, mean km/h", "worst", "permitted", "physics", "runs that braked",
    "warned before, least s", "demanded, m/s²", "verdict",
)  # fmt: skip


def titles(cells: Sequence[Cell]) -> list[str]:
    """The columns' titles: those of the guard, then one for each that is put beside it."""
    return [*TITLES, *(f"{method}: impact, mean (worst) km/h" for method in cells[0].beside)] if cells else [*TITLES]


def shown(cell: Cell) -> Iterator[str]:
    """A row's texts, in the order of `titles`."""
    for name in ROW:
        value = getattr(cell, name)
        yield "" if value is None else f"{value:g}" if isinstance(value, float) else str(value)
    for other in cell.beside.values():
        yield _shown_beside(cell.kind, other)


def _shown_beside(kind: Kind, other: Beside) -> str:
    if not other.runs:
        return ""
    if kind == "pass":
        return f"{other.braked} of {other.runs} runs braked"
    return f"{other.impact_mean_kmh:g} ({other.impact_worst_kmh:g}), {other.contacts} of {other.runs} hit"


def as_csv(cells: Sequence[Cell]) -> str:
    """All fields of all cells."""
    return csv_text(_flat(cell) for cell in cells)


def _flat(cell: Cell) -> dict[str, Any]:
    row = msgspec.structs.asdict(cell)
    for method, other in row.pop("beside").items():
        row |= {f"{method}: {name}": value for name, value in msgspec.structs.asdict(other).items()}
    return row


def values(cells: Sequence[Cell]) -> dict[str, Any]:
    """What the page shows."""
    scenes = [SCENES[name] for name in dict.fromkeys(cell.scene for cell in cells)]
    return {"scenes": scenes, "titles": titles(cells), "rows": [list(shown(cell)) for cell in cells]}

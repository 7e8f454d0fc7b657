"""Tables made of runs with known numbers."""

from collections.abc import Callable, Mapping
from typing import Any

import msgspec

from evaluation.campaign.moments import Moment
from evaluation.campaign.names import TableName
from evaluation.campaign.plan import Row, rows_of, with_settings
from evaluation.campaign.store import Kept
from evaluation.tables.tables import Ran, Table, table_of

NUMBERS: dict[str, Any] = {
    "distance_m": 2000.0, "seconds": 120.0, "ticks": 1200, "infractions_total": 1, "overspeed_inferred_pct": 0.5,
    "hazard_response_s": (0.2, 0.4), "advisory_latency_s": (0.05, 0.07), "ttc_escalation_s": (3.0,), "event_f1": 0.9,
    "correct_tool_rate": 0.95, "interventions": 4, "false_interventions": 1, "near_collisions": 0, "collisions": 0,
    "nags": 0, "target_mean_mps": 20.0,
}  # fmt: skip


def kept(**numbers: Any) -> Kept:
    """A run's numbers; what is not told is as above."""
    return Kept(
        metrics={**NUMBERS, **numbers},
        moments=(),
        wall_s=60.0,
        cpu_s=50.0,
        machine="a test's machine",
        measured_by="test",
    )


def table(
    name: TableName,
    made: Callable[[Row, int], Kept | None],
    runs: int = 2,
    *,
    modelled_ms: Mapping[str, float] = {},
    settings: Mapping[str, dict[str, Any]] = {},
    seconds: float = 0.0,
) -> Table:
    """A table whose runs come from `made`; None is a run that failed. Latencies, settings and seconds asked are those of all rows."""
    rows = [_with(row, modelled_ms, settings) for row in rows_of(name, "rendered")]
    ran = {row.key: [_ran(row, number, made(row, number), seconds) for number in range(runs)] for row in rows}
    return table_of(name, rows, ran)


def _with(row: Row, modelled_ms: Mapping[str, float], settings: Mapping[str, dict[str, Any]]) -> Row:
    spec = msgspec.structs.replace(row.spec, modelled_ms=dict(modelled_ms))
    for service, asked in settings.items():
        spec = with_settings(spec, service, asked)
    return msgspec.structs.replace(row, spec=spec)


def _ran(row: Row, number: int, found: Kept | None, seconds: float) -> Ran:
    problem = "" if found else "Traceback\nits process ended with 9"
    return Ran(
        key=f"{abs(hash(row.key)):x}-{number}", number=number, seed=number, kept=found, problem=problem, seconds=seconds
    )


def moment(picture: str = "") -> Moment:
    """A bad one."""
    return Moment(kind="collision", time_s=12.0, tick=120, what="collision at 30 km/h", badness=8.3, picture=picture)


def far(row: Row, number: int) -> Kept:
    """DriveMCP has no infraction, the others have many."""
    infractions = 0 if row.spec.method == "DriveMCP" else 40
    return kept(distance_m=300_000.0, infractions_total=infractions)

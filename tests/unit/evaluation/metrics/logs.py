"""Small logs made by hand."""

from collections.abc import Callable
from typing import Any

from evaluation.metrics import At
from evaluation.metrics.record import Call, Tick
from proto.decision import Advisory, Decision, Event, SafetyMetrics
from proto.rules import LegalLimit
from proto.truth import TrueActor, TrueHazard, Truth

STEP_S = 0.05
PLAIN: dict[str, Any] = {
    "acceleration_mps2": 0.0,
    "law_limit_mps": 20.0,
    "jurisdiction": "DEU",
    "mu": 0.8,
    "gap_m": None,
    "closing_mps": None,
    "faults": (),
}


def truths(seconds: float, at: Callable[[float], dict[str, Any]], **always: Any) -> tuple[Truth, ...]:
    """20 instants a second; `at` says what is so at a time (speed_mps at least), the distance follows."""
    found, distance = [], 0.0
    for step in range(1, round(seconds / STEP_S) + 1):
        time_s = round(step * STEP_S, 6)
        now = {**PLAIN, **always, **at(time_s)}
        distance += now["speed_mps"] * STEP_S
        found.append(Truth(time_s=time_s, distance_m=distance, **now))
    return tuple(found)


def steady(seconds: float, speed_mps: float = 20.0, **always: Any) -> tuple[Truth, ...]:
    """A drive in which nothing changes."""
    return truths(seconds, lambda time_s: {"speed_mps": speed_mps}, **always)


def limit(mps: float, advisory: bool = False) -> LegalLimit:
    return LegalLimit(value=round(mps * 3.6), unit="km/h", mps=mps, advisory=advisory)


def said(time_s: float, kind: str = "SPEAK", **what: Any) -> At[Advisory]:
    """What the driver is told at a time."""
    plain: dict[str, Any] = {
        "directive": "x", "justification": "", "urgency": "info", "topic": "limit", "hazard": "", "target_mps": 20.0,
        "legal_limit": limit(20.0), "unit": "km/h", "language": "en", "confidence": 1.0,
    }  # fmt: skip
    stamp_ns = round(time_s * 1e9)
    return At(time_s, Advisory(tick=1, snapshot_stamp_ns=stamp_ns, kind=kind, **{**plain, **what}))  # type: ignore[arg-type]


def decided(time_s: float, kind: str, act_withheld: str = "") -> At[Decision]:
    decision = Decision(tick=1, kind=kind, reason="", metrics=SafetyMetrics(), act_withheld=act_withheld)  # type: ignore[arg-type]
    return At(time_s, decision)


def ticked(time_s: float, events: tuple[str, ...] = (), calls: tuple[str, ...] = ()) -> At[Tick]:
    """A tick with these events and these calls, all answered."""
    return At(
        time_s,
        Tick(
            tick=1,
            events=tuple(Event(kind=kind, g=1.0, eta=0.5) for kind in events),
            calls=tuple(Call(tool=tool, status="ok") for tool in calls),
        ),
    )


def hazard(kind: str, onset_s: float, distance_m: float | None = None) -> TrueHazard:
    return TrueHazard(kind=kind, onset_s=onset_s, distance_m=distance_m)


def person(
    x_m: float, closing_mps: float = 0.0, in_path: bool = True, number: int = 500, y_m: float = 0.0
) -> TrueActor:
    """Half a metre long; `x_m` is from middle to middle."""
    return TrueActor(
        actor_id=number, kind="pedestrian", x_m=x_m, y_m=y_m, vx_mps=-closing_mps, vy_mps=0.0, length_m=0.4,
        width_m=0.6, in_ego_path=in_path,
    )  # fmt: skip

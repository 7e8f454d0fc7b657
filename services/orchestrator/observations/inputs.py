"""The inputs of one tick: the newest message of each topic, all facts since the last tick, and the services that are missing.

It goes into the trace as it is, and the tick can be run again from it.
"""

from typing import Any, Generic, Literal, TypeVar

import msgspec

from drivemcp.finite import sound
from proto.decision import Feedback, Preferences
from proto.perception import Lanes, Tracks
from proto.scene import Facts
from proto.sensors import MapView, StopLine
from proto.tools import Effect, Outcome, ToolEntry
from proto.vehicle import Degradation, Ego
from proto.weather import Conditions

M = TypeVar("M", bound=msgspec.Struct)
Cause = Literal["snapshot", "watchdog", "query"]


class Stamped(msgspec.Struct, Generic[M], frozen=True, kw_only=True):
    """A message with its number and stamp."""

    seq: int
    stamp_ns: int
    message: M


class RoadAhead(msgspec.Struct, frozen=True, kw_only=True):
    """What the map says of the road ahead, without its geometry."""

    segment_id: str = ""
    stop_lines: tuple[StopLine, ...] = ()
    junction_m: float | None = None
    road_class: str = "unknown"
    carriageways_separated: bool | None = None
    nearest_only: bool = False
    """No line behind the nearest is told."""


class Expert(msgspec.Struct, frozen=True, kw_only=True):
    """A tool of a third party that asks to be routed to and fused: it may lower and widen, nothing else."""

    tool: str
    answers: tuple[str, ...]
    deadline_ms: float
    effect: Effect


class Method(msgspec.Struct, frozen=True, kw_only=True):
    """The advisor that a tick is advised by, and its settings."""

    name: str = "tools"
    """`tools`: experts, fusion, arbiter. Others are found by entry point (`services.orchestrator.advisor`)."""
    settings: dict[str, Any] = {}


class Observations(msgspec.Struct, frozen=True, kw_only=True):
    """One tick's inputs."""

    now_ns: int
    cause: Cause = "snapshot"
    tracks: Stamped[Tracks] | None = None
    lanes: Stamped[Lanes] | None = None
    ego: Stamped[Ego] | None = None
    road: Stamped[RoadAhead] | None = None
    position_m: tuple[float, float] | None = None
    utc_s: float | None = None
    """UTC now by the satellites, s since 1970."""
    conditions: Stamped[Conditions] | None = None
    degradation: Stamped[Degradation] | None = None
    facts: tuple[Stamped[Facts], ...] = ()
    unhealthy: tuple[str, ...] = ()
    """Topics that are missing, late or invalid."""
    absent: tuple[str, ...] = ()
    """Services that are expected and not there."""
    late: tuple[Outcome, ...] = ()
    """Tool results that missed their tick."""
    preferences: Preferences | None = None
    feedback: tuple[Feedback, ...] = ()
    experts: tuple[Expert, ...] = ()
    acknowledged: bool = False
    """The driver has ended a sound since the last tick."""
    query: str = ""
    method: Method = Method()
    thresholds: dict[str, float] = {}
    """Event -> threshold, where it is another than the table's."""


def road_ahead(view: MapView) -> RoadAhead:
    """A map view without its polylines."""
    return RoadAhead(
        segment_id=view.segment_id,
        stop_lines=view.stop_lines,
        junction_m=view.junction_distance_m,
        road_class=view.road_class,
        carriageways_separated=view.carriageways_separated,
    )


def along_lane(lanes: Lanes) -> RoadAhead:
    """The road ahead as the lanes tell it."""
    at_m, kind = lanes.stop_line_distance_m, lanes.stop_line_kind
    lines = () if at_m is None else (StopLine(distance_m=at_m, kind=kind),)  # type: ignore[arg-type]
    return RoadAhead(
        segment_id=lanes.segment_id,
        stop_lines=lines,
        junction_m=lanes.junction_distance_m,
        road_class=lanes.road_class,
        nearest_only=True,
    )


def clean(stamped: Stamped[M] | None) -> Stamped[M] | None:
    """The message without malformed tracks or facts; None where the message itself is malformed."""
    if stamped is None:
        return None
    message = sound(stamped.message)
    return msgspec.structs.replace(stamped, message=message) if message is not None else None


OWN_TOOLS = frozenset(
    {
        "applicable_limit", "interpret_sign", "right_of_way", "lookup_rule", "list_rulepacks", "assess_weather",
        "vehicle_health", "read_dtcs", "explain_dtc", "arbitrate", "explain_decision", "ask", "feedback",
        "set_preferences", "retrieve", "remember", "recall", "find_traces", "ask_scene", "describe_scene", "list_tracks",
        "answer_prompt",
    }
)  # fmt: skip
"""Tools that the orchestrator knows how to ask; they take no part as third parties."""


def experts(catalogue: dict[str, ToolEntry]) -> tuple[Expert, ...]:
    """The third parties of a catalogue: context tools that name events and an effect."""
    return tuple(
        Expert(tool=name, answers=meta.answers, deadline_ms=meta.deadline_ms, effect=meta.effect)
        for name, meta in sorted((name, entry.meta) for name, entry in catalogue.items())
        if name not in OWN_TOOLS and meta.effect is not None and meta.answers and meta.capability == "context"
    )

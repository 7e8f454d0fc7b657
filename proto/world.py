"""`world_state`: what the system believes of ego, environment and actors. Unset (None) is a legal state."""

from typing import Literal

import msgspec

from proto.observed import Observed
from proto.perception import Track
from proto.rules import PostedLimit
from proto.scene import Candidate, Unit
from proto.weather import Conditions


class EgoState(msgspec.Struct, frozen=True, kw_only=True):
    """The ego vehicle."""

    speed_mps: Observed[float] | None = None
    acceleration_mps2: Observed[float] | None = None
    yaw_rate_radps: Observed[float] | None = None
    lane_id: Observed[str] | None = None
    lateral_offset_m: Observed[float] | None = None
    position_m: Observed[tuple[float, float]] | None = None
    degradation_h: Observed[float] | None = None
    brake_envelope: Observed[float] | None = None
    dtcs: Observed[tuple[str, ...]] | None = None
    warning_lamps: Observed[tuple[str, ...]] | None = None


class SeenSign(msgspec.Struct, frozen=True, kw_only=True):
    """A sign ahead or just passed."""

    reading: str
    track_id: int
    distance_m: float | None
    candidates: tuple[Candidate, ...] = ()
    plates: tuple[str, ...] = ()
    believed: bool = True
    text: str = ""


class Environment(msgspec.Struct, frozen=True, kw_only=True):
    """The road, its rules as seen, and the weather."""

    lane_count: Observed[int] | None = None
    stop_line_m: Observed[float] | None = None
    stop_line_kind: str = ""
    junction_m: Observed[float] | None = None
    segment_id: Observed[str] | None = None
    light: Observed[Literal["red", "red_amber", "amber", "green", "off"]] | None = None
    light_distance_m: Observed[float] | None = None
    signs: tuple[Observed[SeenSign], ...] = ()
    posted_limit: Observed[PostedLimit] | None = None
    """The permanent limit believed in force; a ceiling until positive evidence ends it."""
    dynamic_limit: Observed[PostedLimit] | None = None
    conditional_limit: Observed[PostedLimit] | None = None
    zone_limit: Observed[PostedLimit] | None = None
    doubted_limit: Observed[PostedLimit] | None = None
    ended: tuple[str, ...] = ()
    conditions: Observed[Conditions] | None = None
    local_time: Observed[str] | None = None
    """ISO 8601 with the zone, in steps of 5 minutes; satellites tell UTC, the country tells the zone."""
    jurisdiction: Observed[str] | None = None
    units: Observed[Unit] | None = None
    traffic_side: Observed[Literal["left", "right"]] | None = None
    road_type: Observed[str] | None = None
    """By a sign that was passed, or a map."""
    road_evidence: tuple[Observed[str], ...] = ()
    """Where neither tells it: what pictures and speed tell of the kind of road, each a cue with its confidence."""
    assumed_road: Observed[str] | None = None
    """The kind that this evidence speaks for, or `unknown`; an assumption, on which nothing rests that is spoken or acts."""


class WorldState(msgspec.Struct, frozen=True, kw_only=True):
    """The typed state of one tick; the orchestrator alone writes it."""

    stamp_ns: int
    tick: int
    ego: EgoState = EgoState()
    environment: Environment = Environment()
    actors: Observed[tuple[Track, ...]] | None = None
    lead_track_id: int | None = None
    degraded: tuple[str, ...] = ()
    """Topics or services that were missing, late or invalid when this state was made."""

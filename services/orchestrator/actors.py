"""Who is in the way: gap, closing speed, time to collision, as the orchestrator sees them."""

from typing import NamedTuple

from proto.perception import Track
from proto.world import WorldState

EGO_HALF_M = 2.25
NEAR_PATH_M = 3.0
LOOK_AHEAD_M = 120.0
FLOOR = 0.15
"""Below this confidence perception itself says that there is probably nothing."""
PERSON_ON_MOTORWAY = 0.5
"""A person on a motorway is implausible; one that is doubted there bounds nothing."""


class Way(NamedTuple):
    """An actor ahead. `ttc_s` None: it is not met."""

    track: Track
    gap_m: float
    closing_mps: float
    ttc_s: float | None
    speed_mps: float | None
    """Over ground, along the road; None: the ego's own is unknown."""


def tracks(world: WorldState) -> tuple[Track, ...]:
    """All actors known."""
    if world.actors is None:
        return ()
    return tuple(track for track in world.actors.value if track.confidence >= _floor(world, track))


def _floor(world: WorldState, track: Track) -> float:
    road = world.environment.road_type
    motorway = road is not None and road.value == "motorway"
    return PERSON_ON_MOTORWAY if motorway and track.kind in ("pedestrian", "cyclist") else FLOOR


def lead(world: WorldState) -> Way | None:
    """The vehicle ahead in the ego's path that is met first, or else is nearest."""
    ahead = [way(world, t) for t in tracks(world) if t.kind != "pedestrian" and t.x_m > 0.0 and _in_path(world, t)]
    return min(ahead, key=lambda w: (w.ttc_s if w.ttc_s is not None else 1e6 + w.gap_m, w.track.track_id), default=None)


def pedestrian(world: WorldState) -> Way | None:
    """The nearest person in, or stepping into, the ego's path."""
    people = [way(world, t) for t in tracks(world) if t.kind in ("pedestrian", "cyclist") and crosses(t)]
    return min(people, key=lambda w: (w.gap_m, w.track.track_id), default=None)


def crosses(track: Track) -> bool:
    """In the path, or close beside it and moving towards it."""
    if not 0.0 < track.x_m < LOOK_AHEAD_M:
        return False
    if track.in_ego_path:
        return True
    towards = track.vy_mps * track.y_m < 0.0 and abs(track.vy_mps) > 0.4
    return towards and abs(track.y_m) - 2.0 * abs(track.vy_mps) < NEAR_PATH_M / 2.0


def way(world: WorldState, track: Track) -> Way:
    """Gap, closing speed and time to collision of one actor."""
    gap = track.x_m - track.length_m / 2.0 - EGO_HALF_M
    closing = -track.vx_mps
    ego = world.ego.speed_mps
    speed = ego.value + track.vx_mps if ego is not None else None
    ttc = 0.0 if gap <= 0.0 else gap / closing if closing > 0.1 else None
    return Way(track, gap, closing, ttc, speed)


def _in_path(world: WorldState, track: Track) -> bool:
    return track.in_ego_path or track.track_id == world.lead_track_id

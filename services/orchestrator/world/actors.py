"""Road users in the way: gap, closing speed, time to collision, as the orchestrator sees them."""

import math
from typing import Literal, NamedTuple

from domain.road_users import (
    Across,
    Sight,
    crosses_over,
    hides_others,
    is_passed,
    is_vehicle_there,
    least_gap_m,
    seen_well,
    shows_beyond_others,
    shrinking_mps,
)  # fmt: skip
from proto.observed import value_of
from proto.perception import Track
from proto.world import WorldState
from services.orchestrator.state import GapSeen

EGO_HALF_M, EGO_WIDTH_M = 2.25, 1.9
BENDS_M = 1.0
"""By how much the way that the ego's lane takes must miss a place straight ahead."""
NEAR_PATH_M = 3.0
LOOK_AHEAD_M = 120.0
WITHIN_S, SURELY_WITHIN_S, WALKS_MPS = 2.0, 3.0, 1.0
"""A road user who reaches the path so soon crosses it; the longer time is for one known for 1 s who surely walks: at 54 km/h two
seconds are one reaction and too little braking."""
FLOOR = 0.15
"""Below this confidence perception itself says that there is probably nothing."""
CERTAIN = 0.7
"""As the arbiter's profile: below it an actor is doubted and supports no ACT."""
PERSON_ON_MOTORWAY = 0.5
"""A person on a motorway is implausible; below this confidence the person bounds nothing."""
KNOWN_S, KNOWN_CONFIDENCE = 1.0, 0.5
YOUNG_S, LOST_S, FAINT, SPEED_KNOWN_MPS = 0.3, 0.3, 0.45, 3.0
CROSSES_MPS = 2.0
"""Slower sideways a vehicle changes its lane, or is measured badly."""
ACROSS_SIGMAS = 4.0
"""Faster sideways than this many standard deviations a vehicle surely moves: crossing vehicles mostly show 12 and more."""
SIGHT, ACROSS = Sight(YOUNG_S, LOST_S, CERTAIN, KNOWN_S), Across(CROSSES_MPS, ACROSS_SIGMAS)
WATCHED_S, KEPT_S, HARDLY = 0.25, 0.7, 0.25
MOST_GAPS = 400
"""Of all actors: a crowd pushes no sighting out before its road user is confirmed."""
CONFIRMING = 3
"""Ticks of the last `KEPT_S` in which a doubted person has to be well seen in the way: ghosts of people last one or two."""
STANDING_MPS = 1.0
"""A slower ego has nothing to brake."""
SPEED_SIGMAS = 3.0
"""Closing slower than this many standard deviations may be no closing at all."""
CRAWL_MPS, QUEUED_M = 5.0, 2.0
"""Below this speed one crawls in a queue; so much farther than the nearest is still beside it."""
STANDS_MPS = 2.0


class Way(NamedTuple):
    """An actor ahead. `ttc_s` None: it is not met."""

    track: Track
    gap_m: float
    closing_mps: float
    ttc_s: float | None
    speed_mps: float | None
    """Over ground, along the road; None: the ego's own is unknown."""

    @property
    def least_m(self) -> float:
        """The gap where a guessed field of view makes all things seem farther than they are; a time to collision has no part in that."""
        return least_gap_m(self.track, self.gap_m)


def tracks(world: WorldState) -> tuple[Track, ...]:
    """All actors known."""
    motorway = value_of(world.environment.road_type) == "motorway"
    person = PERSON_ON_MOTORWAY if motorway else FLOOR
    least = {"vehicle": FLOOR, "pedestrian": person, "cyclist": person}
    return tuple(track for track in value_of(world.actors) or () if track.confidence >= least[track.kind])


def vehicles(world: WorldState) -> tuple[Way, ...]:
    """All vehicles ahead in the ego's path: those that are met, the soonest first, then the others by their gap."""
    ahead = [way(world, t) for t in tracks(world) if t.kind != "pedestrian" and t.x_m > 0.0 and _in_path(world, t)]
    return tuple(sorted(ahead, key=lambda w: (w.ttc_s if w.ttc_s is not None else 1e6 + w.gap_m, w.track.track_id)))


def _in_path(world: WorldState, track: Track) -> bool:
    return track.in_ego_path or track.track_id == world.lead_track_id


def people(world: WorldState) -> tuple[Way, ...]:
    """All people in, or stepping into, the ego's path, the nearest first."""
    crossing = [way(world, track) for track in tracks(world) if track.kind != "vehicle" and crosses(track)]
    return tuple(sorted(crossing, key=lambda w: (w.gap_m, w.track.track_id)))


def lead(world: WorldState) -> Way | None:
    """The vehicle ahead in the ego's path that is met first, or else is nearest."""
    return next(iter(vehicles(world)), None)


def pedestrian(world: WorldState) -> Way | None:
    """The nearest person in, or stepping into, the ego's path."""
    return next(iter(people(world)), None)


def crosses(track: Track) -> bool:
    """Whether a road user is in the path, or close beside it and moving towards it.

    The path is that of the ego's lane, where it is known: in a bend it leads past a place straight ahead. On which side of it
    a road user is, is unknown then, so that any motion sideways counts as towards it.
    """
    if not 0.0 < track.x_m < LOOK_AHEAD_M:
        return False
    if track.in_ego_path:
        return True
    sideways, straight_m = abs(track.vy_mps), abs(track.y_m)
    room_m = track.clearance_m
    aside_m = straight_m if room_m is None else room_m + (EGO_WIDTH_M + track.width_m) / 2.0
    towards = abs(aside_m - straight_m) > BENDS_M or track.vy_mps * track.y_m < 0.0
    surely = sideways >= WALKS_MPS and track.confidence >= CERTAIN and track.age_s >= KNOWN_S
    within_s = SURELY_WITHIN_S if surely else WITHIN_S
    return towards and sideways > 0.4 and aside_m - within_s * sideways < NEAR_PATH_M / 2.0


def way(world: WorldState, track: Track) -> Way:
    """Gap, closing speed and time to collision of one actor."""
    gap, closing = track.x_m - track.length_m / 2.0 - EGO_HALF_M, -track.vx_mps
    ego_mps = value_of(world.ego.speed_mps)
    ttc = 0.0 if gap <= 0.0 else gap / closing if closing > 0.1 else None
    return Way(track, gap, closing, ttc, ego_mps + track.vx_mps if ego_mps is not None else None)


def known(track: Track) -> bool:
    """Whether an actor was seen for long enough, and surely enough, to be missed for long."""
    return track.age_s >= KNOWN_S and track.confidence >= KNOWN_CONFIDENCE


def watch(gaps: tuple[GapSeen, ...], world: WorldState) -> tuple[GapSeen, ...]:
    """The sightings of the last moments with those of this picture.

    A vehicle of the other lane that seems to drift towards ours, by a speed sideways that is hardly measured, is not seen well in the way.
    """
    if world.actors is None:
        return gaps
    stamp_ns = world.actors.stamp_ns
    known = {gap.track_id for gap in gaps if gap.stamp_ns == stamp_ns}
    new = (
        GapSeen(
            track_id=t.track_id, x_m=t.x_m, stamp_ns=stamp_ns, well=well_seen(t) and (t.in_ego_path or not t.oncoming)
        )
        for t in tracks(world)
        if t.track_id not in known and crosses(t)
    )
    return tuple(gap for gap in (*gaps, *new) if stamp_ns - gap.stamp_ns <= KEPT_S * 1e9)[-MOST_GAPS:]


def well_seen(track: Track) -> bool:
    """Whether an actor is old, clear, in sight and measured enough to be spoken of; any other may still lower the target."""
    return track.confidence >= FAINT and track.sigma_vx_mps <= SPEED_KNOWN_MPS and seen_well(track, SIGHT)


def _seen(gaps: tuple[GapSeen, ...], way: Way) -> list[GapSeen]:
    return [gap for gap in gaps if gap.track_id == way.track.track_id]


def confirmed(gaps: tuple[GapSeen, ...], way: Way) -> bool:
    """Whether an actor is certain, or was seen well in the way often enough."""
    return way.track.confidence >= CERTAIN or _often(gaps, way)


def _often(gaps: tuple[GapSeen, ...], way: Way) -> bool:
    return sum(gap.well for gap in _seen(gaps, way)) >= CONFIRMING


def contradicted(gaps: tuple[GapSeen, ...], way: Way) -> bool:
    """Whether the actor was watched for long enough and hardly came nearer: part of the car ahead, not a person."""
    rate = shrinking_mps([(gap.stamp_ns, gap.x_m) for gap in _seen(gaps, way)], WATCHED_S)
    return rate is not None and rate < HARDLY * way.closing_mps


def met(world: WorldState) -> tuple[Way, ...]:
    """The vehicles that may be met, in the order of `vehicles`: behind one that surely is before us those alone that surely show
    beyond it, and in a crawling queue none."""
    ways, ego_mps = vehicles(world), value_of(world.ego.speed_mps)
    hiding = (way.gap_m for way in ways if _hides(way))
    least_hidden_m = min(hiding, default=math.inf) + QUEUED_M
    crawls = ego_mps is not None and ego_mps < CRAWL_MPS
    return tuple(
        way for way in ways if way.gap_m <= least_hidden_m or (not crawls and shows_beyond_others(way.track, SIGHT))
    )


def _hides(way: Way) -> bool:
    """Whether a vehicle may hide what is behind it; one that the ego passes beside its way hides nothing in it."""
    return hides_others(way.track, way.gap_m, SIGHT) and well_seen(way.track) and not passed(way)


def passed(way: Way) -> bool:
    """Whether the ego passes a vehicle beside its way."""
    return is_passed(way.track, way.gap_m, way.speed_mps, stands_mps=STANDS_MPS, across_mps=CROSSES_MPS)


def stands(world: WorldState) -> bool:
    """Whether the ego is known to have nothing to brake."""
    return world.ego.speed_mps is not None and world.ego.speed_mps.value < STANDING_MPS


def surely_nears(way: Way) -> bool:
    """Whether an actor comes nearer by more than what may be no closing at all."""
    return way.closing_mps > SPEED_SIGMAS * way.track.sigma_vx_mps


def clear(gaps: tuple[GapSeen, ...], way: Way) -> bool:
    """Whether an actor is seen well enough to be spoken of, and stands or comes in the way rather than beside it.

    A vehicle that the ego passes close by lowers the target and is no hazard. One that comes towards the ego has to be seen in its way
    often enough: a lorry of the other lane lies in ours for a look or two, by its measured width.
    """
    there = well_seen(way.track) and is_vehicle_there(way.track, way.speed_mps, SIGHT, ACROSS)
    meets = not way.track.oncoming or _often(gaps, way)
    return there and meets and not passed(way) and not contradicted(gaps, way)


def comes_from(way: Way) -> Literal["left", "right"] | None:
    """From which side a vehicle drives across the ego's way; None: it does not, it is through, or that is unknown."""
    track = way.track
    crossing = track.kind == "vehicle" and way.speed_mps is not None and crosses_over(track, way.speed_mps, ACROSS)
    if not crossing or track.y_m * track.vy_mps >= 0.0:
        return None
    return "left" if track.y_m > 0.0 else "right"

"""Observations become `world_state`: typed, stamped, with confidences that fall once a field's validity is over."""

import math
from collections.abc import Callable
from typing import Literal, TypeVar, cast

import msgspec

from proto.observed import Observed, Source
from proto.perception import Lanes, Track, Tracks
from proto.rules import PostedLimit
from proto.scene import Unit
from proto.vehicle import Degradation, Ego
from proto.world import EgoState, Environment, SeenSign, WorldState
from services.orchestrator.observations.inputs import Observations, Stamped
from services.orchestrator.observations.motion import Motion, motion_of
from services.orchestrator.observations.validity import (
    MOST_PLAUSIBLE,
    SECOND,
    VALID_NS,
    confidence_at,
    fresh,
    newer,
    number,
    sane_health,
)
from services.orchestrator.signs import signs as sign_memory
from services.orchestrator.signs.limits import value_kmh
from services.orchestrator.state import Believed, Held, InForce, Light, Limiter, Onset, SignAhead, Signs, State
from services.orchestrator.world.actors import watch
from services.orchestrator.world.conditions import settle
from services.orchestrator.world.giving_way import by_map
from services.orchestrator.world.lights import light_ahead
from services.orchestrator.world.stop_lines import halted, halted_at_line, on_map, stop_line

T = TypeVar("T")
LightState = Literal["red", "red_amber", "amber", "green", "off"]
GONE_EXPERT_NS = 60 * SECOND
"""For how long a restriction outlives its time when the expert that made it is gone."""


def observe(state: State, seen: Observations) -> State:
    """The state with the observations taken in: world, signs, light, stop line, and the experts' last words."""
    ego = fresh(seen.ego, VALID_NS["speed"], seen.now_ns)
    motion = motion_of(state, ego, seen)
    facts = tuple(fact for stamped in seen.facts for fact in stamped.message.facts)
    signs = sign_memory.update(state.signs, facts, motion, seen.now_ns)
    light = light_ahead(state.light, facts, motion, ego, seen.now_ns)
    told = on_map(seen)
    line = stop_line(state, told, motion)
    held = _held(state.held, seen)
    after = msgspec.structs.replace(
        state,
        tick=state.tick + 1,
        now_ns=seen.now_ns,
        signs=signs,
        light=light,
        stop_m=line[0],
        stop_kind=line[1],
        give_way=by_map(state.give_way, told, motion),
        halted_ns=halted(state, signs, line, ego, seen.now_ns),
        line_halted_ns=halted_at_line(state, line, ego, seen.now_ns),
        held=held,
        preferences=seen.preferences if seen.preferences is not None else state.preferences,
        missing=_missing(state, degraded(seen), seen.now_ns),
        effects=tuple((expert.tool, expert.effect) for expert in seen.experts),
    )
    world = _world(after, seen, motion)
    return msgspec.structs.replace(after, world=world, gaps=watch(state.gaps, world))


def _missing(state: State, names: tuple[str, ...], now_ns: int) -> tuple[Onset, ...]:
    known = {onset.kind: onset for onset in state.missing}
    return tuple(
        Onset(kind=name, since_ns=known[name].since_ns if name in known else now_ns, last_ns=now_ns) for name in names
    )


def _held(held: Held, seen: Observations) -> Held:
    conditions, degradation = seen.conditions, seen.degradation
    if conditions is not None and newer(conditions.stamp_ns, held.conditions_ns, seen.now_ns):
        settled = settle(held.conditions, conditions.message)
        held = msgspec.structs.replace(held, conditions=settled, conditions_ns=conditions.stamp_ns)
    told = degradation is not None and newer(degradation.stamp_ns, held.degradation_ns, seen.now_ns)
    if degradation is not None and told and sane_health(degradation.message):
        car = _with_envelope(degradation.message, held.degradation)
        held = msgspec.structs.replace(held, degradation=car, degradation_ns=degradation.stamp_ns)
    return msgspec.structs.replace(held, limiters=tuple(each for each in held.limiters if _stands(each, seen)))


def _with_envelope(told: Degradation, before: Degradation | None) -> Degradation:
    """An envelope that is no longer told is the one last told: silence heals no brakes."""
    if told.brake_envelope is not None or before is None:
        return told
    return msgspec.structs.replace(told, brake_envelope=before.brake_envelope)


def _stands(limiter: Limiter, seen: Observations) -> bool:
    """Until it runs out; where its expert is gone and cannot say more, for some time on."""
    here = any(expert.tool == limiter.tool for expert in seen.experts)
    return seen.now_ns < limiter.until_ns + (0 if here else GONE_EXPERT_NS)


# -- the world -------------------------------------------------------------------------------------------------------


def _world(state: State, seen: Observations, motion: Motion) -> WorldState:
    tracks = fresh(seen.tracks, VALID_NS["tracks"], seen.now_ns)
    return WorldState(
        stamp_ns=seen.tracks.stamp_ns if seen.tracks is not None and seen.cause == "snapshot" else seen.now_ns,
        tick=state.tick,
        ego=_ego(state, seen),
        environment=_environment(state, seen, motion),
        actors=_actors(tracks, seen.now_ns),
        lead_track_id=tracks.message.lead_track_id if tracks is not None else None,
        degraded=degraded(seen),
    )


def degraded(seen: Observations) -> tuple[str, ...]:
    """What this tick had to do without."""
    names = {*seen.unhealthy, *seen.absent}
    if seen.cause == "watchdog":
        names.add("snapshot")
    return tuple(sorted(names))


def _actors(tracks: Stamped[Tracks] | None, now_ns: int) -> Observed[tuple[Track, ...]] | None:
    if tracks is None:
        return None
    known = tuple(track for track in tracks.message.tracks if sane(track))
    seen: Observed[tuple[Track, ...]] | None = _observed(
        known, 1.0, "perception", tracks.stamp_ns, VALID_NS["tracks"], now_ns
    )
    return seen


def sane(track: Track) -> bool:
    """A track with numbers that a road can hold; any other is no track."""
    numbers = (
        track.x_m, track.y_m, track.vx_mps, track.vy_mps, track.ax_mps2, track.length_m, track.width_m,
        track.sigma_x_m, track.sigma_vx_mps, track.confidence, track.age_s, track.unseen_s,
        track.steady_s or 0.0,
    )  # fmt: skip
    return all(math.isfinite(number) and abs(number) <= MOST_PLAUSIBLE for number in numbers)


def _ego(state: State, seen: Observations) -> EgoState:
    def signal(of: Callable[[Ego], float | None]) -> Observed[float] | None:
        value = number(of(seen.ego.message)) if seen.ego is not None else None
        if value is None or seen.ego is None:
            return None
        return _observed(value, 1.0, "can", seen.ego.stamp_ns, VALID_NS["speed"], seen.now_ns)

    held, lanes = state.held, fresh(seen.lanes, VALID_NS["lanes"], seen.now_ns)
    car, stamp_ns = held.degradation, held.degradation_ns or 0

    def health(value: T | None) -> Observed[T] | None:
        return None if value is None else _observed(value, 1.0, "can", stamp_ns, VALID_NS["degradation"], seen.now_ns)

    return EgoState(
        speed_mps=signal(lambda ego: ego.speed_mps),
        acceleration_mps2=signal(lambda ego: ego.acceleration_mps2),
        yaw_rate_radps=signal(lambda ego: ego.yaw_rate_radps),
        lane_id=_of_lanes(lanes, lambda each: each.ego_lane_id, seen.now_ns),
        lateral_offset_m=_of_lanes(lanes, lambda each: each.lateral_offset_m, seen.now_ns),
        position_m=_observed(seen.position_m, 0.9, "map", seen.now_ns, VALID_NS["position"], seen.now_ns)
        if seen.position_m is not None
        else None,
        degradation_h=health(car.h if car is not None else None),
        brake_envelope=health(car.brake_envelope if car is not None else None),
        dtcs=health(car.dtcs if car is not None else None),
        warning_lamps=health(car.warning_lamps if car is not None else None),
    )


def _environment(state: State, seen: Observations, motion: Motion) -> Environment:
    signs, now_ns, held = state.signs, seen.now_ns, state.held
    lanes = fresh(seen.lanes, VALID_NS["lanes"], now_ns)
    road = fresh(seen.road, VALID_NS["lanes"], now_ns)
    segment = (road.message.segment_id if road is not None else "") or (
        lanes.message.segment_id if lanes is not None else ""
    )
    conditions = held.conditions
    return Environment(
        lane_count=_of_lanes(lanes, lambda each: each.lane_count, now_ns),
        stop_line_m=_map(state.stop_m, now_ns),
        stop_line_kind=state.stop_kind,
        junction_m=_map(motion.junction_m, now_ns),
        segment_id=_map(segment or None, now_ns),
        light=_observed_light(state.light, now_ns),
        light_distance_m=_map(state.light.distance_m, now_ns) if state.light is not None else None,
        signs=tuple(_observed_sign(sign, now_ns) for sign in signs.ahead),
        posted_limit=_limit(signs.permanent, now_ns),
        dynamic_limit=_limit(signs.gantry, now_ns),
        conditional_limit=_limit(signs.conditional[-1] if signs.conditional else None, now_ns),
        zone_limit=_limit(signs.zone, now_ns),
        doubted_limit=_doubted(signs, now_ns),
        ended=signs.ended,
        conditions=_observed(
            conditions, conditions.confidence, "weather", held.conditions_ns or 0, VALID_NS["conditions"], now_ns
        )
        if conditions is not None
        else None,
        jurisdiction=_believed(signs.jurisdiction, now_ns),
        units=cast("Observed[Unit] | None", _believed(signs.units, now_ns)),
        traffic_side=cast("Observed[Literal['left', 'right']] | None", _believed(signs.traffic_side, now_ns)),
        road_type=_believed(_road_type(signs, seen), now_ns),
    )


def _road_type(signs: Signs, seen: Observations) -> Believed | None:
    """From signs; where none was seen yet, what the map calls the road."""
    if signs.road_type is not None:
        return signs.road_type
    lanes = fresh(seen.lanes, VALID_NS["lanes"], seen.now_ns)
    road = fresh(seen.road, VALID_NS["lanes"], seen.now_ns)
    for name in (road.message.road_class if road is not None else "", lanes.message.road_class if lanes else ""):
        if name in ("urban", "rural", "motorway"):
            return Believed(value=name, confidence=0.7, since_ns=seen.now_ns)
    return None


def _observed(
    value: T, confidence: float, source: Source, stamp_ns: int, valid_ns: int, now_ns: int
) -> Observed[T] | None:
    """The observation, at the confidence its age leaves; None once that is nothing."""
    left = confidence_at(confidence, now_ns - stamp_ns, valid_ns)
    if left <= 0.0 and confidence > 0.0:
        return None
    return Observed(value=value, confidence=left, source=source, stamp_ns=stamp_ns, valid_for_ns=valid_ns)


def _of_lanes(lanes: Stamped[Lanes] | None, of: Callable[[Lanes], T], now_ns: int) -> Observed[T] | None:
    if lanes is None:
        return None
    confidence = 0.95 if lanes.message.source == "map" else 0.5
    source: Source = "map" if lanes.message.source == "map" else "perception"
    return _observed(of(lanes.message), confidence, source, lanes.stamp_ns, VALID_NS["lanes"], now_ns)


def _map(value: T | None, now_ns: int) -> Observed[T] | None:
    return None if value is None else _observed(value, 0.95, "map", now_ns, VALID_NS["lanes"], now_ns)


def _believed(believed: Believed | None, now_ns: int) -> Observed[str] | None:
    if believed is None:
        return None
    # Restated from time to time by the front end; what was believed does not wear off by itself.
    return Observed(
        value=believed.value,
        confidence=believed.confidence,
        source="drivelm",
        stamp_ns=believed.since_ns,
        evidence=believed.evidence,
        valid_for_ns=VALID_NS["stated"],
    )


def _limit(limit: InForce | None, now_ns: int) -> Observed[PostedLimit] | None:
    if limit is None:
        return None
    posted = msgspec.structs.replace(limit.posted, age_s=round((now_ns - limit.since_ns) / 1e9, 1))
    return Observed(
        value=posted,
        confidence=posted.confidence,
        source="drivelm",
        stamp_ns=limit.since_ns,
        valid_for_ns=VALID_NS["limit"],
        evidence=f"track {limit.track_id}",
    )


def _doubted(signs: Signs, now_ns: int) -> Observed[PostedLimit] | None:
    doubted = [sign for sign in signs.ahead if sign.kind == "limit" and not sign.believed and sign.value is not None]
    sign = min(doubted, key=lambda each: value_kmh(each.value or 0.0, each.unit), default=None)
    if sign is None or sign.value is None:
        return None
    posted = PostedLimit(value=sign.value, unit=sign.unit or "km/h", confidence=sign.confidence, reading=sign.reading)
    seen: Observed[PostedLimit] | None = _observed(
        posted, sign.confidence, "drivelm", sign.seen_ns, VALID_NS["sign"], now_ns
    )
    return seen


def _observed_sign(sign: SignAhead, now_ns: int) -> Observed[SeenSign]:
    seen = SeenSign(
        reading=sign.reading,
        track_id=sign.track_id,
        distance_m=sign.distance_m,
        candidates=sign.candidates,
        plates=sign.plates,
        believed=sign.believed,
        text=sign.text,
    )
    left = confidence_at(sign.confidence, now_ns - sign.seen_ns, VALID_NS["sign"])
    return Observed(
        value=seen,
        confidence=left,
        source="drivelm",
        stamp_ns=sign.seen_ns,
        valid_for_ns=VALID_NS["sign"],
        evidence=f"track {sign.track_id}",
    )


def _observed_light(light: Light | None, now_ns: int) -> Observed[LightState] | None:
    if light is None:
        return None
    state = cast(LightState, light.state)
    return _observed(state, light.confidence, "drivelm", light.seen_ns, VALID_NS["light"], now_ns)

"""Observations become `world_state`: typed, stamped, with confidences that fall once a field's validity is over."""

from typing import Literal, NamedTuple, TypeVar, cast

import msgspec

from domain import ego_speed
from proto.observed import Observed, Source, value_of
from proto.perception import Lanes, Track
from proto.rules import PostedLimit
from proto.scene import Fact, Unit
from proto.vehicle import Degradation
from proto.world import EgoState, Environment, SeenSign, WorldState
from services.orchestrator.observations.inputs import Observations, Stamped
from services.orchestrator.observations.local_time import heard, local_time
from services.orchestrator.observations.validity import (
    MOST_PLAUSIBLE,
    SECOND,
    VALID_NS,
    Motion,
    believed_speed,
    confidence_at,
    fresh,
    looked_ns,
    looked_to_ns,
    motion_of,
    newer,
    roads,
    sane_health,
    step_of_clock_ns,
    yaw_rate,
)
from services.orchestrator.signs import signs as sign_memory
from services.orchestrator.state import Believed, Held, InForce, Limiter, Onset, SignAhead, Signs, State
from services.orchestrator.world.actors import watch
from services.orchestrator.world.conditions import settle
from services.orchestrator.world.giving_way import by_map
from services.orchestrator.world.lights import light_ahead
from services.orchestrator.world.road_kind import assumed, evidence, fast_since
from services.orchestrator.world.stop_lines import halted, halted_at_line, on_map, stop_line, with_line

T = TypeVar("T")
GONE_EXPERT_NS = 60 * SECOND
"""For how long a restriction outlives its time when the expert that made it is gone."""


def observe(state: State, seen: Observations) -> State:
    """The state with the observations taken in: world, signs, light, stop line, and the experts' last words."""
    now_ns, motion = seen.now_ns, motion_of(state, seen)
    facts = tuple(fact for stamped in seen.facts for fact in stamped.message.facts)
    signs = sign_memory.update(state.signs, facts, motion, now_ns)
    mapped = on_map(seen)
    line = stop_line(state, mapped, motion)
    after = msgspec.structs.replace(
        state,
        tick=state.tick + 1,
        now_ns=now_ns,
        signs=signs,
        light=with_line(light_ahead(state.light, facts, motion, now_ns), line),
        stop_m=line[0],
        stop_kind=line[1],
        give_way=by_map(state.give_way, mapped, motion),
        halted_ns=halted(state, signs, line, motion, now_ns),
        line_halted_ns=halted_at_line(state, line, motion, now_ns),
        looked_ns=looked_ns(state, seen),
        looked_to_ns=looked_to_ns(state, seen),
        held=_held(state, seen, motion),
        preferences=seen.preferences or state.preferences,
        missing=_missing(state, _degraded(seen), now_ns),
        utc=heard(state.utc, seen.utc_s, now_ns, step_ns=step_of_clock_ns(state, seen)),
        effects=tuple((expert.tool, expert.effect) for expert in seen.experts),
    )
    world = _world(after, seen, motion)
    return _of_road_kind(
        msgspec.structs.replace(after, world=world, gaps=watch(state.gaps, world)), state, facts, motion
    )


def _of_road_kind(after: State, before: State, facts: tuple[Fact, ...], motion: Motion) -> State:
    """With the evidence for the kind of road, where neither a sign nor a map tells it."""
    world, now_ns, here = after.world, after.now_ns, before.world.environment
    tracks = value_of(world.actors) or ()
    fast_ns = fast_since(before.fast_since_ns, motion.speed_mps, tracks, now_ns)
    after = msgspec.structs.replace(after, fast_since_ns=fast_ns)
    if world.environment.road_type is not None:
        return after
    found = evidence(here.road_evidence, facts, tracks, motion.speed_mps, fast_ns, now_ns)
    environment = msgspec.structs.replace(world.environment, road_evidence=found, assumed_road=assumed(found))
    return msgspec.structs.replace(after, world=msgspec.structs.replace(world, environment=environment))


def _degraded(seen: Observations) -> tuple[str, ...]:
    """What this tick had to do without."""
    silent = ("snapshot",) if seen.cause == "watchdog" else ()
    return tuple(sorted({*seen.unhealthy, *seen.absent, *silent}))


def _missing(state: State, names: tuple[str, ...], now_ns: int) -> tuple[Onset, ...]:
    since = {onset.kind: onset.since_ns for onset in state.missing}
    return tuple(Onset(kind=name, since_ns=since.get(name, now_ns), last_ns=now_ns) for name in names)


def _held(state: State, seen: Observations, motion: Motion) -> Held:
    held = state.held
    left_ns = max(0, held.doubted_for_ns - motion.read_ns)
    held = msgspec.structs.replace(held, doubted_for_ns=left_ns, road=state.road or held.road)
    conditions, car = seen.conditions, seen.degradation
    if conditions is not None and newer(conditions.stamp_ns, held.conditions_ns, seen.now_ns):
        settled = settle(held.conditions, conditions.message)
        held = msgspec.structs.replace(held, conditions=settled, conditions_ns=conditions.stamp_ns)
    if car is not None and newer(car.stamp_ns, held.degradation_ns, seen.now_ns) and sane_health(car.message):
        degradation = _with_envelope(car.message, held.degradation)
        held = msgspec.structs.replace(held, degradation=degradation, degradation_ns=car.stamp_ns)
    if motion.known:
        held = msgspec.structs.replace(held, speed=believed_speed(held, seen))
    later = (_later(each, step_of_clock_ns(state, seen)) for each in held.limiters)
    return msgspec.structs.replace(held, limiters=tuple(each for each in later if _stands(each, seen)))


def _with_envelope(told: Degradation, before: Degradation | None) -> Degradation:
    """With the last known brake envelope where none is told: silence heals no brakes."""
    if told.brake_envelope is not None or before is None:
        return told
    return msgspec.structs.replace(told, brake_envelope=before.brake_envelope)


def _later(limiter: Limiter, by_ns: int) -> Limiter:
    return msgspec.structs.replace(limiter, until_ns=limiter.until_ns + by_ns)


def _stands(limiter: Limiter, seen: Observations) -> bool:
    """Until it runs out; for longer where its expert is gone and cannot renew it."""
    here = any(expert.tool == limiter.tool for expert in seen.experts)
    return seen.now_ns < limiter.until_ns + (0 if here else GONE_EXPERT_NS)


# -- the world -------------------------------------------------------------------------------------------------------


class _Told(NamedTuple):
    """One source's word, as sure as it is and at the age that it has now."""

    source: Source
    confidence: float
    stamp_ns: int
    valid_ns: int
    now_ns: int

    def observed(self, value: T | None) -> Observed[T] | None:
        """The value, at the confidence its age leaves; None once that is nothing."""
        left = confidence_at(self.confidence, self.now_ns - self.stamp_ns, self.valid_ns)
        if value is None or left <= 0.0 < self.confidence:
            return None
        return Observed(
            value=value, confidence=left, source=self.source, stamp_ns=self.stamp_ns, valid_for_ns=self.valid_ns
        )


def _world(state: State, seen: Observations, motion: Motion) -> WorldState:
    tracks = fresh(seen.tracks, VALID_NS["tracks"], seen.now_ns)
    lanes = fresh(seen.lanes, VALID_NS["lanes"], seen.now_ns)
    world = WorldState(
        stamp_ns=seen.tracks.stamp_ns if seen.tracks is not None and seen.cause == "snapshot" else seen.now_ns,
        tick=state.tick,
        ego=_ego(state, seen, motion, lanes),
        environment=_environment(state, seen, motion, lanes),
        degraded=_degraded(seen),
    )
    if tracks is None:
        return world
    told = _Told("perception", 1.0, tracks.stamp_ns, VALID_NS["tracks"], seen.now_ns)
    actors = told.observed(tuple(track for track in tracks.message.tracks if _is_sane(track)))
    return msgspec.structs.replace(world, actors=actors, lead_track_id=tracks.message.lead_track_id)


def _is_sane(track: Track) -> bool:
    """Whether its numbers are such as a road can hold."""
    numbers = (
        track.x_m, track.y_m, track.vx_mps, track.vy_mps, track.ax_mps2, track.length_m, track.width_m,
        track.sigma_x_m, track.sigma_vx_mps, track.confidence, track.age_s, track.unseen_s,
        track.steady_s or 0.0, track.range_spread,
    )  # fmt: skip
    sizes = (track.length_m, track.width_m, track.sigma_x_m, track.sigma_vx_mps, track.range_spread)
    return all(abs(number) <= MOST_PLAUSIBLE for number in numbers) and min(sizes) >= 0.0


def _by_lanes(lanes: Stamped[Lanes], now_ns: int) -> _Told:
    if lanes.message.source == "map":
        return _Told("map", 0.95, lanes.stamp_ns, VALID_NS["lanes"], now_ns)
    return _Told("perception", 0.5, lanes.stamp_ns, VALID_NS["lanes"], now_ns)


def _ego(state: State, seen: Observations, motion: Motion, lanes: Stamped[Lanes] | None) -> EgoState:
    car, now_ns = state.held.degradation, seen.now_ns
    ego = EgoState(position_m=_Told("map", 0.9, now_ns, VALID_NS["position"], now_ns).observed(seen.position_m))
    if seen.ego is not None:
        told, signals = _Told("can", 1.0, seen.ego.stamp_ns, VALID_NS["speed"], now_ns), seen.ego.message
        speed = believed_speed(state.held, seen)
        ego = msgspec.structs.replace(
            ego,
            speed_mps=told._replace(stamp_ns=speed.stamp_ns).observed(speed.mps) if speed is not None else None,
            acceleration_mps2=told.observed(
                ego_speed.acceleration_mps2(signals.acceleration_mps2, speed if motion.known else None)
            ),
            yaw_rate_radps=told.observed(yaw_rate(signals.yaw_rate_radps, motion.speed_mps)),
        )
    if lanes is not None:
        told, lane = _by_lanes(lanes, now_ns), lanes.message
        ego = msgspec.structs.replace(
            ego, lane_id=told.observed(lane.ego_lane_id), lateral_offset_m=told.observed(lane.lateral_offset_m)
        )
    if car is not None:
        told = _Told("can", 1.0, state.held.degradation_ns or 0, VALID_NS["degradation"], now_ns)
        ego = msgspec.structs.replace(
            ego,
            degradation_h=told.observed(car.h),
            brake_envelope=told.observed(car.brake_envelope),
            dtcs=told.observed(car.dtcs),
            warning_lamps=told.observed(car.warning_lamps),
        )
    return ego


def _environment(state: State, seen: Observations, motion: Motion, lanes: Stamped[Lanes] | None) -> Environment:
    signs, held, now_ns = state.signs, state.held, seen.now_ns
    mapped = _Told("map", 0.95, now_ns, VALID_NS["lanes"], now_ns)
    world = Environment(
        stop_line_m=mapped.observed(state.stop_m),
        stop_line_kind=state.stop_kind,
        junction_m=mapped.observed(motion.junction_m),
        segment_id=mapped.observed(next((road.segment_id for road in roads(seen) if road.segment_id), None)),
        signs=tuple(_sign(sign, now_ns) for sign in signs.ahead),
        posted_limit=_limit(signs.permanent, now_ns),
        dynamic_limit=_limit(signs.gantry, now_ns),
        conditional_limit=_limit(next(reversed(signs.conditional), None), now_ns),
        zone_limit=_limit(signs.zone, now_ns),
        doubted_limit=_doubted(signs, now_ns),
        ended=signs.ended,
        jurisdiction=_believed(signs.jurisdiction),
        units=cast("Observed[Unit] | None", _believed(signs.units)),
        traffic_side=cast("Observed[Literal['left', 'right']] | None", _believed(signs.traffic_side)),
        road_type=_believed(signs.road_type or _road_by_map(seen)),
    )
    if lanes is not None:
        lane_count = _by_lanes(lanes, now_ns).observed(lanes.message.lane_count)
        world = msgspec.structs.replace(world, lane_count=lane_count)
    if state.light is not None:
        told = _Told("drivelm", state.light.confidence, state.light.seen_ns, VALID_NS["light"], now_ns)
        distance_m = mapped.observed(state.light.distance_m)
        world = msgspec.structs.replace(world, light=told.observed(state.light.state), light_distance_m=distance_m)
    if (weather := held.conditions) is not None:
        told = _Told("weather", weather.confidence, held.conditions_ns or 0, VALID_NS["conditions"], now_ns)
        world = msgspec.structs.replace(world, conditions=told.observed(weather))
    if (local := local_time(state)) is not None:
        told = _Told("derived", 0.95, now_ns, VALID_NS["stated"], now_ns)
        world = msgspec.structs.replace(world, local_time=told.observed(local.isoformat(timespec="minutes")))
    return world


def _road_by_map(seen: Observations) -> Believed | None:
    """What the map calls the road, where no sign has told it yet."""
    names = (road.road_class for road in roads(seen) if road.road_class in ("urban", "rural", "motorway"))
    return next((Believed(value=name, confidence=0.7, since_ns=seen.now_ns) for name in names), None)


def _read(value: T, confidence: float, stamp_ns: int, valid: str, evidence: str) -> Observed[T]:
    """What the front end read; it does not wear off by itself."""
    return Observed(
        value=value,
        confidence=confidence,
        source="drivelm",
        stamp_ns=stamp_ns,
        valid_for_ns=VALID_NS[valid],
        evidence=evidence,
    )


def _believed(believed: Believed | None) -> Observed[str] | None:
    if believed is None:
        return None
    return _read(believed.value, believed.confidence, believed.since_ns, "stated", believed.evidence)


def _limit(limit: InForce | None, now_ns: int) -> Observed[PostedLimit] | None:
    if limit is None:
        return None
    posted = msgspec.structs.replace(limit.posted, age_s=round((now_ns - limit.since_ns) / 1e9, 1))
    return _read(posted, posted.confidence, limit.since_ns, "limit", f"track {limit.track_id}")


def _doubted(signs: Signs, now_ns: int) -> Observed[PostedLimit] | None:
    """The lowest limit that a doubted sign may show."""
    doubted = [sign for sign in signs.ahead if sign.doubted_limit and sign.value is not None]
    sign = min(doubted, key=lambda each: each.kmh, default=None)
    if sign is None or sign.value is None:
        return None
    told = _Told("drivelm", sign.confidence, sign.seen_ns, VALID_NS["sign"], now_ns)
    return told.observed(
        PostedLimit(value=sign.value, unit=sign.unit or "km/h", confidence=sign.confidence, reading=sign.reading)
    )


def _sign(sign: SignAhead, now_ns: int) -> Observed[SeenSign]:
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
    return _read(seen, left, sign.seen_ns, "sign", f"track {sign.track_id}")

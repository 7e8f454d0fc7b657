"""Observations become `world_state`: typed, stamped, with confidences that fall once a field's validity is over."""

import math
from typing import Any, Literal, TypeVar, cast

import msgspec

from proto.observed import Observed, Source
from proto.perception import Lanes, Track, Tracks
from proto.rules import PostedLimit
from proto.scene import Fact, Unit
from proto.vehicle import Degradation, Ego
from proto.weather import Conditions
from proto.world import EgoState, Environment, SeenSign, WorldState
from services.orchestrator import signs as sign_memory
from services.orchestrator.actors import watch
from services.orchestrator.inputs import Observations, Stamped
from services.orchestrator.signs import Motion
from services.orchestrator.state import Believed, Held, InForce, Light, Onset, SignAhead, Signs, State

T = TypeVar("T")
SECOND = 1_000_000_000
VALID_NS: dict[str, int] = {
    "speed": SECOND // 5, "tracks": 3 * SECOND // 10, "lanes": SECOND // 2, "conditions": 5 * SECOND,
    "degradation": 5 * SECOND // 2, "light": SECOND, "sign": 3 * SECOND, "limit": 600 * SECOND, "position": SECOND // 2,
    "stated": 3600 * SECOND,
}  # fmt: skip
"""How long an observation is taken at its word."""
UNSET_AFTER = 3.0
"""Validities after which a field is unset; on the way there its confidence falls to nothing."""
STOP_PASSED_M = -3.0
MAX_STEP_S = 1.0
MOST_PLAUSIBLE = 1000.0
"""Metres, m/s, seconds: nothing that a car's sensors see exceeds it."""
WEATHER_SURE = 0.4
"""Below this confidence a report of better weather changes nothing."""
_STATES = ("red", "red_amber", "amber", "green", "off")
PERMISSION = ("green", "off")
GREEN_LASTS_NS = 2 * SECOND
"""Permission wears off at once; a red that was believed stands until green is read or the light is passed."""
RED_LASTS_NS = 60 * SECOND
"""Of a red light whose distance nobody knows, while the ego moves; and the age at which a reading is none."""
STANDING_MPS = 0.5
LAMPS_APART_M = 15.0
"""Lamps of one junction, and the error of their ranges."""
NEXT_JUNCTION_M = 80.0
"""A red light so far behind a green one is of another junction: 17 m/s still come to a stand there at 2 m/s²."""


def observe(state: State, seen: Observations) -> State:
    """The state with the observations taken in: world, signs, light, stop line, and the experts' last words."""
    ego = fresh(seen.ego, VALID_NS["speed"], seen.now_ns)
    motion = _motion(state, ego, seen)
    facts = tuple(fact for stamped in seen.facts for fact in stamped.message.facts)
    signs = sign_memory.update(state.signs, facts, motion, seen.now_ns)
    light = _light(state.light, facts, motion, ego, seen.now_ns)
    stop_m, stop_kind = _stop_line(state, seen, motion)
    held = _held(state.held, seen)
    after = msgspec.structs.replace(
        state,
        tick=state.tick + 1,
        now_ns=seen.now_ns,
        signs=signs,
        light=light,
        stop_m=stop_m,
        stop_kind=stop_kind,
        halted_ns=_halted(state, ego, stop_m, seen.now_ns),
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


def confidence_at(confidence: float, age_ns: int, valid_ns: int) -> float:
    """As observed while valid, then falling in a straight line to nothing at `UNSET_AFTER` validities."""
    over = age_ns / valid_ns - 1.0
    return max(0.0, confidence * min(1.0, 1.0 - over / (UNSET_AFTER - 1.0)))


def fresh(stamped: Stamped[Any] | None, valid_ns: int, now_ns: int) -> Stamped[Any] | None:
    """The message unless it is older than a field may get, or comes from a future that clock skew does not explain."""
    if stamped is None or not -VALID_NS["speed"] <= now_ns - stamped.stamp_ns < UNSET_AFTER * valid_ns:
        return None
    return stamped


def _motion(state: State, ego: Stamped[Ego] | None, seen: Observations) -> Motion:
    step_s = min(MAX_STEP_S, max(0.0, (seen.now_ns - state.now_ns) / 1e9)) if state.now_ns else 0.0
    speed = _number(ego.message.speed_mps) if ego is not None else None
    yaw = _number(ego.message.yaw_rate_radps) if ego is not None else None
    lanes = fresh(seen.lanes, VALID_NS["lanes"], seen.now_ns)
    road = fresh(seen.road, VALID_NS["lanes"], seen.now_ns)
    junction = road.message.junction_m if road is not None else None
    if junction is None and lanes is not None:
        junction = lanes.message.junction_distance_m
    return Motion(
        travelled_m=max(0.0, speed or 0.0) * step_s,
        turned_rad=(yaw or 0.0) * step_s,
        junction_m=junction,
        lane_id=lanes.message.ego_lane_id if lanes is not None else "",
    )


def _number(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) and abs(value) <= MOST_PLAUSIBLE else None


def _light(
    light: Light | None, facts: tuple[Fact, ...], motion: Motion, ego: Stamped[Ego] | None, now_ns: int
) -> Light | None:
    if light is not None:
        light = _still_ahead(light, motion, ego, now_ns)
    read = [fact for fact in facts if fact.kind == "light" and fact.reading.startswith("light:")]
    for fact in sorted(read, key=lambda each: _lamp(each) not in PERMISSION):  # red has the last word
        light = _read_light(light, fact, now_ns)
    return light


def _lamp(fact: Fact) -> str:
    return fact.reading.partition(":")[2]


def _still_ahead(light: Light, motion: Motion, ego: Stamped[Ego] | None, now_ns: int) -> Light | None:
    """The light, nearer by the way travelled; None once it is passed."""
    age_ns = now_ns - light.seen_ns
    if light.state in PERMISSION and age_ns > GREEN_LASTS_NS:
        return None
    if light.distance_m is None:
        # Nothing tells when it is passed; while the ego stands it is not.
        speed = _number(ego.message.speed_mps) if ego is not None else None
        return None if age_ns > RED_LASTS_NS and speed is not None and speed >= STANDING_MPS else light
    moved = light.distance_m - motion.travelled_m
    return msgspec.structs.replace(light, distance_m=moved) if moved >= STOP_PASSED_M else None


def _read_light(light: Light | None, fact: Fact, now_ns: int) -> Light | None:
    state, age_ns = _lamp(fact), now_ns - fact.frame_stamp_ns
    if light is not None and _outdated(light, fact):
        return light
    if fact.passed:
        return None if light is not None and light.track_id == fact.track_id else light
    if state not in _STATES or not math.isfinite(fact.confidence) or age_ns > RED_LASTS_NS:
        return light
    # Green is permission: only a sure and fresh reading grants it. Red and amber are believed at once.
    if state in PERMISSION and not (
        fact.believed and fact.confidence >= sign_memory.SURE and -VALID_NS["speed"] <= age_ns <= GREEN_LASTS_NS
    ):
        return light
    if light is not None and not _supersedes(light, fact, state, now_ns):
        return light
    distance = fact.distance_m if fact.distance_m is not None else (light.distance_m if light is not None else None)
    return Light(
        state=state,
        confidence=min(1.0, max(0.0, fact.confidence)),
        seen_ns=min(fact.frame_stamp_ns, now_ns),
        distance_m=distance,
        track_id=fact.track_id,
    )


def _outdated(light: Light, fact: Fact) -> bool:
    """Whether a later frame was read already; a red lamp beside a green one counts whichever frame showed it."""
    beside = light.track_id != fact.track_id and light.state in PERMISSION and _lamp(fact) not in PERMISSION
    return fact.frame_stamp_ns < light.seen_ns and not beside


def _supersedes(light: Light, fact: Fact, state: str, now_ns: int) -> bool:
    """Whether a reading replaces the light held: of the same lamp, or of another one that rather counts."""
    if light.track_id == fact.track_id:
        return state not in PERMISSION or light.state in PERMISSION or fact.frame_stamp_ns > light.seen_ns
    beyond_m = _beyond_m(light, fact)
    if state not in PERMISSION and light.state in PERMISSION:
        return beyond_m <= NEXT_JUNCTION_M
    if state in PERMISSION and light.state not in PERMISSION and beyond_m < -NEXT_JUNCTION_M:
        return True
    # A lamp may be known under another number once it was out of sight.
    lost = now_ns - light.seen_ns > UNSET_AFTER * VALID_NS["light"]
    nearer = beyond_m <= 0.0 and (state in PERMISSION) == (light.state in PERMISSION)
    return nearer or (lost and beyond_m <= LAMPS_APART_M)


def _beyond_m(light: Light, fact: Fact) -> float:
    """How far behind the light held another one stands; 0 where a distance is unknown."""
    return fact.distance_m - light.distance_m if fact.distance_m is not None and light.distance_m is not None else 0.0


def _stop_line(state: State, seen: Observations, motion: Motion) -> tuple[float | None, str]:
    """From the map; where it falls silent the last known line comes nearer by the way travelled, until it is passed."""
    road = fresh(seen.road, VALID_NS["lanes"], seen.now_ns)
    if road is not None:
        line = min(road.message.stop_lines, key=lambda each: each.distance_m, default=None)
        return (line.distance_m, line.kind) if line is not None else (None, "")
    lanes = fresh(seen.lanes, VALID_NS["lanes"], seen.now_ns)
    if lanes is not None and lanes.message.source == "map":
        return lanes.message.stop_line_distance_m, lanes.message.stop_line_kind
    if state.stop_m is None or state.stop_m - motion.travelled_m < STOP_PASSED_M:
        return None, ""
    return state.stop_m - motion.travelled_m, state.stop_kind


def _halted(state: State, ego: Stamped[Ego] | None, stop_m: float | None, now_ns: int) -> int | None:
    speed = ego.message.speed_mps if ego is not None else None
    if stop_m is None or stop_m > 12.0:
        return None
    return now_ns if speed is not None and speed < 0.5 else state.halted_ns


def _held(held: Held, seen: Observations) -> Held:
    conditions, degradation = seen.conditions, seen.degradation
    if conditions is not None and conditions.stamp_ns != held.conditions_ns:
        settled = settle(held.conditions, conditions.message)
        held = msgspec.structs.replace(held, conditions=settled, conditions_ns=conditions.stamp_ns)
    if degradation is not None and degradation.stamp_ns != held.degradation_ns and sane_health(degradation.message):
        held = msgspec.structs.replace(held, degradation=degradation.message, degradation_ns=degradation.stamp_ns)
    limiters = tuple(each for each in held.limiters if each.until_ns > seen.now_ns)
    return msgspec.structs.replace(held, limiters=limiters)


def sane_health(car: Degradation) -> bool:
    """A degradation that is known and is one."""
    parts = [car.h, *([car.brake_envelope] if car.brake_envelope is not None else [])]
    return all(part is not None and math.isfinite(part) and 0.0 <= part <= 1.0 for part in parts)


def sane_conditions(conditions: Conditions) -> bool:
    """Numbers that weather can have."""
    numbers = (conditions.mu_low, conditions.mu_high, conditions.speed_factor, conditions.following_factor)
    if not all(math.isfinite(number) for number in (*numbers, conditions.confidence)):
        return False
    return 0.0 < conditions.mu_low <= conditions.mu_high <= 1.5 and conditions.speed_factor > 0.0


def settle(before: Conditions | None, after: Conditions) -> Conditions | None:
    """The new word on the weather. One that is hardly sure may tighten what was known, not loosen it; nonsense is none."""
    if not sane_conditions(after):
        return before
    if before is None or after.confidence >= WEATHER_SURE:
        return after
    return msgspec.structs.replace(
        after,
        mu_low=min(before.mu_low, after.mu_low),
        mu_high=max(before.mu_high, after.mu_high),
        speed_factor=min(before.speed_factor, after.speed_factor),
        following_factor=max(before.following_factor, after.following_factor),
    )


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
    )  # fmt: skip
    return all(math.isfinite(number) and abs(number) <= MOST_PLAUSIBLE for number in numbers)


def _ego(state: State, seen: Observations) -> EgoState:
    def signal(name: str) -> Observed[float] | None:
        if seen.ego is None:
            return None
        value = _number(getattr(seen.ego.message, name))
        return (
            None if value is None else _observed(value, 1.0, "can", seen.ego.stamp_ns, VALID_NS["speed"], seen.now_ns)
        )

    held, lanes = state.held, fresh(seen.lanes, VALID_NS["lanes"], seen.now_ns)
    car, stamp_ns = held.degradation, held.degradation_ns or 0

    def health(value: T | None) -> Observed[T] | None:
        return None if value is None else _observed(value, 1.0, "can", stamp_ns, VALID_NS["degradation"], seen.now_ns)

    return EgoState(
        speed_mps=signal("speed_mps"),
        acceleration_mps2=signal("acceleration_mps2"),
        yaw_rate_radps=signal("yaw_rate_radps"),
        lane_id=_of_lanes(lanes, "ego_lane_id", seen.now_ns),
        lateral_offset_m=_of_lanes(lanes, "lateral_offset_m", seen.now_ns),
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
        lane_count=_of_lanes(lanes, "lane_count", now_ns),
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


def _observed(value: T, confidence: float, source: Source, stamp_ns: int, valid_ns: int, now_ns: int) -> Any:
    """The observation, at the confidence its age leaves; None once that is nothing."""
    left = confidence_at(confidence, now_ns - stamp_ns, valid_ns)
    if left <= 0.0 and confidence > 0.0:
        return None
    return Observed(value=value, confidence=left, source=source, stamp_ns=stamp_ns, valid_for_ns=valid_ns)


def _of_lanes(lanes: Stamped[Lanes] | None, name: str, now_ns: int) -> Any:
    if lanes is None:
        return None
    confidence = 0.95 if lanes.message.source == "map" else 0.5
    source: Source = "map" if lanes.message.source == "map" else "perception"
    return _observed(getattr(lanes.message, name), confidence, source, lanes.stamp_ns, VALID_NS["lanes"], now_ns)


def _map(value: T | None, now_ns: int) -> Any:
    return None if value is None else _observed(value, 0.95, "map", now_ns, VALID_NS["lanes"], now_ns)


def _believed(believed: Believed | None, now_ns: int) -> Any:
    if believed is None:
        return None
    # Restated from time to time by the front end; what was believed does not wear off by itself.
    return Observed(
        value=believed.value,
        confidence=believed.confidence,
        source="drivelm",
        stamp_ns=believed.since_ns,
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
    sign = min(doubted, key=lambda each: sign_memory.value_kmh(each.value or 0.0, each.unit), default=None)
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


def _observed_light(light: Light | None, now_ns: int) -> Any:
    if light is None:
        return None
    return _observed(light.state, light.confidence, "drivelm", light.seen_ns, VALID_NS["light"], now_ns)

"""What inputs are worth: how long they count, which numbers are plausible, and how the ego moved by them."""

from typing import Any, NamedTuple

from domain import ego_speed
from domain.ego_speed import Believed
from proto.vehicle import Degradation
from services.orchestrator.observations.inputs import Observations, RoadAhead, Stamped, along_lane
from services.orchestrator.state import Held, State

SECOND = 1_000_000_000
VALID_NS: dict[str, int] = {
    "speed": SECOND // 5, "tracks": 3 * SECOND // 10, "lanes": SECOND // 2, "conditions": 5 * SECOND,
    "degradation": 5 * SECOND // 2, "light": SECOND, "sign": 3 * SECOND, "limit": 600 * SECOND, "position": SECOND // 2,
    "stated": 3600 * SECOND,
}  # fmt: skip
"""How long an observation is taken at its word."""
EXPERT_VALID_NS = 10 * SECOND
"""How long a third party's restriction stands."""
UNSET_AFTER = 3.0
"""Validities after which a field is unset; its confidence falls to nothing on the way."""
MOST_SKEW_NS = VALID_NS["speed"]
MOST_PLAUSIBLE = 1000.0
"""Metres, m/s, seconds: nothing that a car's sensors see exceeds it."""
BEHIND_M = 15.0
"""The error of a range: a lamp or a sign that is read may seem so far behind."""
MOST_YAW_RADPS = 2.0
"""No car turns faster on its wheels: a full turn takes 3 s."""
MAX_STEP_S = 1.0
LONGEST_LOOK_NS = SECOND
"""A look counts for no longer: what lies between two pictures that are further apart was not seen."""
FRONT_END = "drivelm"
STANDING_MPS = 0.5
"""A slower ego stands."""


def confidence_at(confidence: float, age_ns: int, valid_ns: int) -> float:
    """As observed while valid, then falling linearly to 0 at `UNSET_AFTER` validities; 0 beyond the clock skew ahead of now."""
    if age_ns < -MOST_SKEW_NS:
        return 0.0
    over = age_ns / valid_ns - 1.0
    return max(0.0, confidence * min(1.0, 1.0 - over / (UNSET_AFTER - 1.0)))


def fresh(stamped: Stamped[Any] | None, valid_ns: int, now_ns: int) -> Stamped[Any] | None:
    """The message unless it is `UNSET_AFTER` validities old, or stamped beyond the clock skew ahead of now."""
    return stamped if stamped is not None and is_fresh(stamped.stamp_ns, valid_ns, now_ns) else None


def is_fresh(stamp_ns: int, valid_ns: int, now_ns: int) -> bool:
    """Whether what was told then is not unset yet."""
    return -MOST_SKEW_NS <= now_ns - stamp_ns < UNSET_AFTER * valid_ns


def newer(stamp_ns: int, held_ns: int | None, now_ns: int) -> bool:
    """Whether a word comes after the one held; any comes after one from the future."""
    return held_ns is None or stamp_ns > held_ns or held_ns > now_ns


def fresh_ns(stamp_ns: int | None, valid_ns: int, now_ns: int) -> bool:
    """Whether something was told within its validity."""
    return stamp_ns is not None and -MOST_SKEW_NS <= now_ns - stamp_ns <= valid_ns


def sane_health(car: Degradation) -> bool:
    """Whether h is known, and h and the brake envelope are shares."""
    parts = (car.h, 1.0 if car.brake_envelope is None else car.brake_envelope)
    return all(part is not None and 0.0 <= part <= 1.0 for part in parts)


def number(value: float | None) -> float | None:
    """The value if it is one that a road can hold."""
    return value if value is not None and abs(value) <= MOST_PLAUSIBLE else None


def distance_ahead(told_m: float | None) -> float | None:
    """The distance of a lamp or a sign that is read; what is far behind the car is not in its pictures."""
    known_m = number(told_m)
    return known_m if known_m is not None and known_m >= -BEHIND_M else None


def yaw_rate(told_radps: float | None, speed_mps: float | None) -> float | None:
    """The yaw rate if a car can turn so fast at that speed: its tyres hold no more sideways than along."""
    if told_radps is None or not abs(told_radps) <= MOST_YAW_RADPS:
        return None
    return told_radps if abs(told_radps) * abs(speed_mps or 0.0) <= ego_speed.CHANGE_MPS2 else None


def roads(seen: Observations) -> tuple[RoadAhead, ...]:
    """The road ahead by the map, then by the lanes, as far as each is fresh."""
    lanes, road = (fresh(each, VALID_NS["lanes"], seen.now_ns) for each in (seen.lanes, seen.road))
    by_map = () if road is None else (road.message,)
    return by_map if lanes is None else (*by_map, along_lane(lanes.message))


def believed_speed(held: Held, seen: Observations) -> Believed | None:
    """The ego's speed as the car tells it or, where that is no speed, as it was last believed; None: the car tells none."""
    if seen.ego is None or seen.ego.message.speed_mps is None:
        return None
    told = Believed(seen.ego.message.speed_mps, seen.ego.stamp_ns)
    return ego_speed.believed(told, held.speed, seen.ego.message.acceleration_mps2)


class Motion(NamedTuple):
    """What the ego did since the last tick, with the junction and the lane that map or perception name now."""

    travelled_m: float = 0.0
    turned_rad: float = 0.0
    junction_m: float | None = None
    lane_id: str = ""
    speed_mps: float | None = None
    read_ns: int = 0
    """For how much of that time the front end read pictures of the road."""

    @property
    def known(self) -> bool:
        """Whether the car tells its speed."""
        return self.speed_mps is not None

    @property
    def stands(self) -> bool:
        """Whether the ego is known to stand, or to move backwards."""
        return self.speed_mps is not None and self.speed_mps < STANDING_MPS


def looked_ns(state: State, seen: Observations) -> int:
    """How much of the time since the last tick pictures tell of. A picture that is missing, or was seen already, is no look."""
    before, now = state.world.actors, fresh(seen.tracks, VALID_NS["tracks"], seen.now_ns)
    if before is None or now is None:
        return 0
    return min(LONGEST_LOOK_NS, max(0, now.stamp_ns - max(before.stamp_ns, _looked_to_ns(state, seen.now_ns))))


def looked_to_ns(state: State, seen: Observations) -> int:
    """The stamp of the newest picture that was looked at, this tick's among them."""
    now = fresh(seen.tracks, VALID_NS["tracks"], seen.now_ns)
    return max(_looked_to_ns(state, seen.now_ns), now.stamp_ns if now is not None else 0)


def _looked_to_ns(state: State, now_ns: int) -> int:
    """None (0) where the clock was set back behind it."""
    return state.looked_to_ns if state.looked_to_ns <= now_ns else 0


def step_of_clock_ns(state: State, seen: Observations) -> int:
    """By how much the time since the last tick exceeds what lies between two ticks: the clock was set forward, or the process stood."""
    return max(0, seen.now_ns - state.now_ns - round(MAX_STEP_S * SECOND)) if state.now_ns else 0


def motion_of(state: State, seen: Observations) -> Motion:
    """From the car's own speed and yaw rate; an unknown speed travels no way."""
    step_s = min(MAX_STEP_S, max(0.0, (seen.now_ns - state.now_ns) / 1e9)) if state.now_ns else 0.0
    ego, believed = fresh(seen.ego, VALID_NS["speed"], seen.now_ns), believed_speed(state.held, seen)
    young = believed is not None and is_fresh(believed.stamp_ns, VALID_NS["speed"], seen.now_ns)
    speed = believed.mps if believed is not None and young else None
    yaw = yaw_rate(ego.message.yaw_rate_radps, speed) if ego is not None else None
    lanes = fresh(seen.lanes, VALID_NS["lanes"], seen.now_ns)
    return Motion(
        travelled_m=max(0.0, speed or 0.0) * step_s,
        turned_rad=(yaw or 0.0) * step_s,
        junction_m=next((road.junction_m for road in roads(seen) if road.junction_m is not None), None),
        lane_id=lanes.message.ego_lane_id if lanes is not None else "",
        speed_mps=speed,
        read_ns=0 if FRONT_END in seen.absent else looked_ns(state, seen),
    )

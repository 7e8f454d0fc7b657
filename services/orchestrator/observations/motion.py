"""What the ego did since the last tick."""

from typing import NamedTuple

from proto.vehicle import Ego
from services.orchestrator.observations.inputs import Observations, Stamped
from services.orchestrator.observations.validity import VALID_NS, fresh, number
from services.orchestrator.state import State

MAX_STEP_S = 1.0
STANDING_MPS = 0.5
"""A slower ego stands."""


class Motion(NamedTuple):
    """Metres and radians; the junction and the lane are those that map or perception name now."""

    travelled_m: float = 0.0
    turned_rad: float = 0.0
    junction_m: float | None = None
    lane_id: str = ""
    known: bool = True
    """Whether the car tells its speed."""


def motion_of(state: State, ego: Stamped[Ego] | None, seen: Observations) -> Motion:
    """From the car's own speed and yaw rate; no way is travelled where nobody knows them."""
    step_s = min(MAX_STEP_S, max(0.0, (seen.now_ns - state.now_ns) / 1e9)) if state.now_ns else 0.0
    speed = number(ego.message.speed_mps) if ego is not None else None
    yaw = number(ego.message.yaw_rate_radps) if ego is not None else None
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
        known=speed is not None,
    )

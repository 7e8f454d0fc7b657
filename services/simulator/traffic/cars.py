"""Vehicles in highway-env: other traffic (IDM) and the ego, which steers itself and takes our longitudinal command."""

from dataclasses import dataclass

import numpy as np
from highway_env.road.road import Road
from highway_env.utils import not_zero, wrap_to_pi
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.controller import ControlledVehicle
from highway_env.vehicle.kinematics import Vehicle
from highway_env.vehicle.objects import RoadObject

from services.simulator.car.kinematics import FREE, clip_by_grip
from services.simulator.road.highway_env_road import LaneIndex, RouteLane, direction_of, lane_of
from services.simulator.road.spine import Array
from services.simulator.scene.scene import ActorKind


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """Kind, size in metres, and what chooses the looks."""

    kind: ActorKind
    length_m: float
    width_m: float
    height_m: float
    look_seed: int = 0
    mesh_family: int = 0


SIZES_M: dict[ActorKind, tuple[float, float, float]] = {
    "saloon": (4.6, 1.82, 1.45),
    "estate": (4.7, 1.84, 1.50),
    "van": (5.4, 2.00, 2.30),
    "lorry": (9.0, 2.50, 3.40),
    "bus": (11.5, 2.55, 3.10),
    "motorcycle": (2.2, 0.80, 1.60),
    "pedestrian": (0.5, 0.6, 1.75),
}
EGO_BODY = Body(kind="saloon", length_m=4.6, width_m=1.82, height_m=1.45)


def body(kind: ActorKind, look_seed: int) -> Body:
    """A body of that kind."""
    length, width, height = SIZES_M[kind]
    return Body(
        kind=kind, length_m=length, width_m=width, height_m=height, look_seed=look_seed, mesh_family=look_seed % 97
    )


def _within(value: float, most: float) -> float:
    return min(max(value, -most), most)


class _Grounded:
    """What both share: real size, place on the spine, grip, and no rolling backwards."""

    body: Body
    mu: float = 0.85
    applied_mps2: float = 0.0
    LENGTH: float
    WIDTH: float
    diagonal: float
    speed: float
    action: dict[str, float]
    lane: RouteLane
    lane_index: LaneIndex
    target_lane_index: LaneIndex
    position: Array
    heading: float
    road: Road
    KP_LATERAL: float
    KP_HEADING: float
    TAU_PURSUIT: float
    MAX_STEERING_ANGLE: float

    def settle(self, body: Body) -> None:
        """Give a fresh vehicle its size."""
        self.body = body
        self.LENGTH, self.WIDTH = body.length_m, body.width_m
        self.diagonal = (body.length_m**2 + body.width_m**2) ** 0.5

    def hold_to_the_ground(self, dt: float) -> None:
        """Clip the command by grip, and stop at standstill."""
        wanted = clip_by_grip(float(self.action["acceleration"]), self.mu)
        self.action["acceleration"] = max(wanted, -max(self.speed, 0.0) / dt)
        self.applied_mps2 = float(self.action["acceleration"])

    def steering_control(self, target_lane_index: LaneIndex) -> float:
        """highway-env's own, which spends most of its time on `np.clip` of single numbers."""
        lane = lane_of(self.road, target_lane_index)
        along, beside = lane.local_coordinates(self.position)
        speed = not_zero(self.speed)
        lateral_mps = -self.KP_LATERAL * beside
        swing = np.arcsin(_within(lateral_mps / speed, 1.0))
        wanted = lane.heading_at(along + self.speed * self.TAU_PURSUIT) + _within(swing, np.pi / 4)
        turn_radps = self.KP_HEADING * wrap_to_pi(wanted - self.heading)
        slip = np.arcsin(_within(self.LENGTH / 2 / speed * turn_radps, 1.0))
        return float(_within(np.arctan(2 * np.tan(slip)), self.MAX_STEERING_ANGLE))

    @property
    def s_m(self) -> float:
        """Place along the spine."""
        return self.lane.spine_place(self.position)[0]

    @property
    def spine_place(self) -> tuple[float, float]:
        """(s, d) on the spine."""
        return self.lane.spine_place(self.position)


class Car(_Grounded, IDMVehicle):  # type: ignore[misc]
    """One car of the traffic. `stop_mps2` is what a red light, a person or its part ahead demands."""

    COMFORT_ACC_MAX = 1.8
    COMFORT_ACC_MIN = -2.5
    DISTANCE_WANTED = 2.5
    TIME_WANTED = 1.4
    ACC_MAX = 7.5

    def __init__(self, road: Road, index: LaneIndex, longitudinal: float, speed: float, body: Body) -> None:
        lane = lane_of(road, index)
        place, heading = lane.position(longitudinal, 0.0), lane.heading_at(longitudinal)
        super().__init__(road, place, heading, speed, target_lane_index=index, enable_lane_change=False, timer=0.5)
        self.settle(body)
        self.stop_mps2, self.speed_bias, self.keeps_mps = FREE, 1.0, FREE
        self.number, self.blind = 0, False
        """Blind: it has seen what stands ahead, and brakes for nothing, because it will leave the lane in time."""

    def act(self, action: object = None) -> None:
        super().act()
        if self.blind:
            self.action["acceleration"] = self.acceleration(self)
        self.action["acceleration"] = min(self.action["acceleration"], self.stop_mps2)

    def step(self, dt: float) -> None:
        self.hold_to_the_ground(dt)
        super().step(dt)

    def handle_collisions(self, other: RoadObject, dt: float = 0) -> None:
        """None with a car that comes the other way: both keep to their lanes, but in a bend a lorry, rigid here, reaches over the line,
        and two that had touched would stand for good."""
        if not (isinstance(other, Car) and direction_of(other.lane_index) != direction_of(self.lane_index)):
            super().handle_collisions(other, dt)

    def lane_distance_to(self, other: RoadObject, lane: RouteLane | None = None) -> float:
        """Bumper to bumper along the lane, signed; highway-env measures from centre to centre."""
        between = float(super().lane_distance_to(other, lane))
        clear = abs(between) - (self.LENGTH + other.LENGTH) / 2
        return float(max(clear, 0.2) * (1.0 if between >= 0 else -1.0))


CREEPS_MPS = 1.0
"""Slower, the wheel is held as it is: highway-env's steering divides by the speed, and swings to and fro near standstill."""


class Ego(_Grounded, ControlledVehicle):  # type: ignore[misc]
    """The ego: highway-env's steering, our longitudinal command in `command_mps2`."""

    def __init__(self, road: Road, index: LaneIndex, longitudinal: float, speed: float) -> None:
        lane = lane_of(road, index)
        place, heading = lane.position(longitudinal, 0.0), lane.heading_at(longitudinal)
        super().__init__(road, place, heading, speed, target_lane_index=index)
        self.settle(EGO_BODY)
        self.command_mps2 = 0.0
        self.pull_rad = 0.0
        """By how much soft tyres steer it, positive to the left."""
        self._steering_rad = 0.0

    def act(self, action: object = None) -> None:
        if self.speed >= CREEPS_MPS:
            self._steering_rad = self.steering_control(self.target_lane_index)
        steering_rad = self._steering_rad - self.pull_rad
        Vehicle.act(self, {"steering": steering_rad, "acceleration": self.command_mps2})

    def step(self, dt: float) -> None:
        self.hold_to_the_ground(dt)
        super().step(dt)

"""The road as highway-env knows it, and the edge where its y (to the right) becomes ours (to the left)."""

import math
import os

os.environ.setdefault("SDL_VIDEODRIVER", "dummy")  # highway-env draws with pygame elsewhere; no screen is needed here

import numpy as np
from highway_env.road.lane import AbstractLane
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.kinematics import Vehicle

from services.simulator.road.cross_section import CrossSection, Direction, LaneLine, lane_line
from services.simulator.road.spine import Array, Spine
from services.simulator.scene.scene import Pose

LaneIndex = tuple[str, str, int]
_NODES: dict[Direction, tuple[str, str]] = {"forward": ("start", "end"), "oncoming": ("end", "start")}
_REMEMBERED = 2048
TOUCHING_M = 16.0
"""Vehicles whose middles are further apart cannot touch, two buses included."""
Neighbours = tuple[Vehicle | None, Vehicle | None]


def to_pose(position: Array, heading_rad: float) -> Pose:
    """Our pose of a highway-env place."""
    return Pose(x_m=float(position[0]), y_m=-float(position[1]), yaw_rad=-float(heading_rad))


def from_world(x_m: float, y_m: float) -> Array:
    """highway-env's place of a world point."""
    return np.array([x_m, -y_m])


class Projector:
    """Spine coordinates of highway-env places; all lanes ask for the same places many times a step."""

    def __init__(self, spine: Spine) -> None:
        self.spine = spine
        self._known: dict[tuple[float, ...], tuple[float, float]] = {}

    def __call__(self, position: Array) -> tuple[float, float]:
        """(s, d) with d to the left."""
        key = tuple(position.tolist())
        found = self._known.get(key)
        if found is None:
            if len(self._known) > _REMEMBERED:
                self._known.clear()
            found = self._known[key] = self.spine.project(key[0], -key[1])
        return found


class RouteLane(AbstractLane):  # type: ignore[misc]
    """One lane along the whole route; its longitudinal coordinate is the spine's s, from its own start."""

    def __init__(self, line: LaneLine, projector: Projector) -> None:
        self.line, self.spine_place = line, projector
        """`spine_place`: (s, d) of a place, whatever the lane."""
        self.length = line.spine.length_m
        self.forbidden, self.speed_limit, self.priority = False, None, 0
        self._back = line.direction == "oncoming"

    def s_of(self, longitudinal: float) -> float:
        """The spine's s of a longitudinal coordinate, and the other way round."""
        return float(self.length - longitudinal if self._back else longitudinal)

    def position(self, longitudinal: float, lateral: float) -> Array:
        s = self.s_of(longitudinal)
        side = lateral if self._back else -lateral
        return from_world(*self.line.spine.place(s, self.line.offset_at(s) + side))

    def local_coordinates(self, position: Array) -> tuple[float, float]:
        s, d = self.spine_place(position)
        left = d - self.line.offset_at(s)
        return self.s_of(s), left if self._back else -left

    def heading_at(self, longitudinal: float) -> float:
        return -self.line.yaw_at(self.s_of(longitudinal))

    def width_at(self, longitudinal: float) -> float:
        return self.line.width_m

    def to_config(self) -> dict[str, object]:
        raise NotImplementedError("made from a scenario file, not from a configuration")


class RouteNetwork(RoadNetwork):  # type: ignore[misc]
    """All lanes follow one spine, so the closest one needs no search."""

    def get_closest_lane_index(self, position: Array, heading: float | None = None) -> LaneIndex:
        """The lane whose centre is nearest among those that run the vehicle's way."""
        nearest: LaneIndex | None = None
        best = math.inf
        s, d = self.graph["start"]["end"][0].spine_place(position)
        for direction, (start, end) in _NODES.items():
            lanes: list[RouteLane] = self.graph[start][end]
            against = heading is not None and math.cos(heading + lanes[0].line.yaw_at(s)) < 0.0
            for lane in range(len(lanes)):
                beside = abs(d - lanes[lane].line.offset_at(s)) + (100.0 if against else 0.0)
                if beside < best:
                    nearest, best = lane_index(direction, lane), beside
        assert nearest is not None
        return nearest


class RouteRoad(Road):  # type: ignore[misc]
    """highway-env's road with its two quadratic searches told what cannot matter."""

    def step(self, dt: float) -> None:
        for vehicle in self.vehicles:
            vehicle.step(dt)
        places = np.array([vehicle.position for vehicle in self.vehicles])
        apart = ((places[:, None, :] - places[None, :, :]) ** 2).sum(axis=2)
        for one, other in zip(*np.nonzero(apart < TOUCHING_M**2), strict=True):
            if one < other:
                self.vehicles[one].handle_collisions(self.vehicles[other], dt)

    def neighbour_vehicles(self, vehicle: Vehicle, lane_index: LaneIndex | None = None) -> Neighbours:
        """The vehicles before and behind on a lane; each is on the lane it is closest to."""
        index = lane_index or vehicle.lane_index
        lane = lane_of(self, index)
        own = lane.s_of(lane.spine_place(vehicle.position)[0])
        front: tuple[float, Vehicle] | None = None
        rear: tuple[float, Vehicle] | None = None
        for other in self.vehicles:
            if other is vehicle or other.lane_index != index:
                continue
            along = lane.s_of(lane.spine_place(other.position)[0])
            if along >= own and (front is None or along < front[0]):
                front = (along, other)
            if along < own and (rear is None or along > rear[0]):
                rear = (along, other)
        return front[1] if front else None, rear[1] if rear else None


def build_road(section: CrossSection, seed: int) -> Road:
    """The network: every lane of both directions as one edge between the route's ends."""
    network, projector = RouteNetwork(), Projector(section.spine)
    for direction, (start, end) in _NODES.items():
        for lane in range(section.lanes):
            network.add_lane(start, end, RouteLane(lane_line(section, direction, lane), projector))
    return RouteRoad(network=network, vehicles=[], np_random=np.random.RandomState(seed))


def lane_index(direction: Direction, lane: int) -> LaneIndex:
    """highway-env's name of a lane."""
    return (*_NODES[direction], lane)


def direction_of(index: LaneIndex) -> Direction:
    """Which way a lane runs."""
    return "forward" if index[0] == "start" else "oncoming"


def lane_of(road: Road, index: LaneIndex) -> RouteLane:
    """The lane of that name."""
    lane: RouteLane = road.network.get_lane(index)
    return lane

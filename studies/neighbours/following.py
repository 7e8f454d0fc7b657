"""The ego driven by highway-env's own intelligent driver model, with its own constants, in place of the simulated human."""

import numpy as np
from highway_env.road.lane import StraightLane
from highway_env.road.road import Road, RoadNetwork
from highway_env.vehicle.behavior import IDMVehicle
from highway_env.vehicle.kinematics import Vehicle

from evaluation.metrics.conflicts import gap_m, person_ahead
from proto.truth import Truth
from services.simulator.driver.driver import NO_LIMIT_MPS, Advice, Driver, DriverView, Wish, pedals

LANE_M = 10_000.0
AT_THE_LINE_M = 4.0
"""The model stands 5 m behind what it follows; a line counts as a vehicle this far beyond the line, so that the model stands 1 m before."""


class Following(Driver):
    """Knows the law's limit, bends and the vehicle ahead, from truth, and nothing else. Hears no advice, is never distracted."""

    truth: Truth | None = None
    """The newest; the drive sets it before each step."""
    _model: "Model | None" = None

    def hear(self, advice: Advice, time_s: float) -> None:
        """Does nothing: there is no assistant, and the model does not listen."""

    def distracted(self, time_s: float) -> bool:
        """Never."""
        return False

    def drive(self, view: DriverView, dt: float) -> Wish:
        """What the model wishes, within its own bounds."""
        model = self._model = self._model or Model()
        truth = self.truth
        if truth is None:
            return pedals(0.0)
        limit_mps = NO_LIMIT_MPS if truth.law_limit_mps is None else truth.law_limit_mps
        wanted_mps = min(limit_mps, view.bend_mps)
        ahead = self.ahead(truth) or [None]
        return pedals(min(model.acceleration_mps2(view.speed_mps, wanted_mps, each) for each in ahead))

    def ahead(self, truth: Truth) -> list[tuple[float, float] | None]:
        """(gap, speed) of the vehicle that is followed."""
        if truth.gap_m is None or truth.closing_mps is None:
            return []
        return [(truth.gap_m, truth.speed_mps - truth.closing_mps)]


class FollowingAll(Following):
    """The same, to which people in its path and lines at which one has to stop now are vehicles that stand there."""

    def ahead(self, truth: Truth) -> list[tuple[float, float] | None]:
        """Vehicle, person and line, as far as they are there."""
        person = person_ahead(truth)
        still = [] if person is None else [gap_m(person)]
        still += [] if truth.stop_distance_m is None else [truth.stop_distance_m + AT_THE_LINE_M]
        return [*super().ahead(truth), *((max(each, 0.0), 0.0) for each in still)]


class Model:
    """highway-env's IDMVehicle on a straight lane, asked for its acceleration behind a vehicle."""

    def __init__(self) -> None:
        network = RoadNetwork()
        network.add_lane("a", "b", StraightLane(np.array([0.0, 0.0]), np.array([LANE_M, 0.0]), speed_limit=1e3))
        self._road = Road(network, np_random=np.random.RandomState(0))
        self._ego = IDMVehicle(self._road, np.array([0.0, 0.0]), target_lane_index=("a", "b", 0), timer=0.0)

    def acceleration_mps2(self, speed_mps: float, wanted_mps: float, ahead: tuple[float, float] | None) -> float:
        """At a speed, with a wished speed, behind a vehicle `ahead` (gap bumper to bumper, speed); `None`: no vehicle."""
        ego = self._ego
        ego.speed, ego.target_speed = speed_mps, max(wanted_mps, 0.1)
        front = None
        if ahead is not None:
            front = Vehicle(self._road, np.array([ahead[0] + ego.LENGTH, 0.0]), 0.0, ahead[1])
        wish = float(ego.acceleration(ego, front))
        most = float(IDMVehicle.ACC_MAX)
        return min(max(wish, -most), most)

"""Cars that change into the ego's lane: highway-env steers them, we say which car and when. The simulator's own never change lanes."""

from __future__ import annotations

from dataclasses import dataclass

from services.simulator.road.highway_env_road import direction_of
from services.simulator.traffic.cars import Car
from services.simulator.world import World

EVERY_S = 3.0
GAP_M = (8.0, 45.0)
"""From the ego's front to the car's rear."""


@dataclass(slots=True)
class CutIns:
    """Call `step` before each of the world's."""

    world: World
    _next_s: float = 1.0

    def step(self) -> None:
        """Every few seconds, tell the nearest car ahead in a lane beside ours to change into it."""
        if self.world.time_s < self._next_s:
            return
        beside = [car for car in self.world.traffic.cars if self._may(car)]
        if beside:
            chosen = min(beside, key=lambda car: car.s_m)
            chosen.target_lane_index = self.world.ego.lane_index
            self._next_s = self.world.time_s + EVERY_S

    def _may(self, car: Car) -> bool:
        ego = self.world.ego
        gap = car.s_m - ego.s_m - (car.LENGTH + ego.LENGTH) / 2
        beside = direction_of(car.lane_index) == "forward" and abs(car.lane_index[2] - ego.lane_index[2]) == 1
        return beside and car.target_lane_index == car.lane_index and GAP_M[0] < gap < GAP_M[1]

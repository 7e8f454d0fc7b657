"""The road ahead of a driver: vehicles in the path, lines at which to stop, people on the road."""

import math
from dataclasses import dataclass, field

from services.simulator.car.kinematics import FREE, stopping_mps2
from services.simulator.driver.driver import StopAhead
from services.simulator.people.in_the_way import SOON_S, person_ahead_m
from services.simulator.people.pedestrians import Person
from services.simulator.road.highway_env_road import direction_of
from services.simulator.road.stop_lines import Lights, Line, Stood, must_stop
from services.simulator.traffic.cars import Car, Ego
from services.simulator.traffic.cross_traffic import CrossCar, CrossTraffic
from services.simulator.traffic.flow import Traffic

SEES_LINE_M, SEES_CAR_M = 90.0, 200.0
PATH_MARGIN_M = 0.25
KEEPS_FROM_PEOPLE_M = 2.0
WAITS_S = 5.0
"""Drivers give way to a car out of a side road that would be in their way within this time."""
EGO = 0
"""The ego's number among the cars that stand at lines; the others count from 1."""


@dataclass(slots=True)
class RoadAhead:
    """The road ahead of the ego and of each car; `crossing` is set anew every step."""

    ego: Ego
    traffic: Traffic
    lines: tuple[Line, ...]
    lights: Lights
    cross: CrossTraffic
    stood: Stood = field(default_factory=Stood)
    crossing: tuple[Person, ...] = ()
    """People on their way over the road."""
    time_s: float = 0.0

    # For the ego ------------------------------------------------------------------------------------------------------

    @property
    def front_m(self) -> float:
        """Where the ego's front bumper is, along the spine."""
        return self.ego.s_m + self.ego.LENGTH / 2

    def lead(self) -> tuple[float, float] | None:
        """(gap, speed along the road) of the nearest vehicle in the ego's path, whichever way it faces."""
        found: tuple[float, float] | None = None
        ego_s_m, front_m = self.ego.s_m, self.front_m
        for car in self.traffic.cars:
            gap = car.s_m - ego_s_m - (car.LENGTH + self.ego.LENGTH) / 2
            if -1.0 < gap < SEES_CAR_M and self.in_path(car) and (found is None or gap < found[0]):
                found = (max(gap, 0.0), car.speed * math.cos(float(car.heading) - float(self.ego.heading)))
        for each in self.cross.on_the_road():
            gap = each.s_m - each.body.width_m / 2 - front_m
            if -1.0 < gap < SEES_CAR_M and self.crosses_path(each) and (found is None or gap < found[0]):
                found = (max(gap, 0.0), 0.0)
        return found

    @property
    def lane_d_m(self) -> float:
        """Where the ego's lane runs beside the spine."""
        return self.ego.lane.line.offset_at(self.ego.s_m)

    def crosses_path(self, car: CrossCar) -> bool:
        """Whether a car out of a side road stands in the ego's way."""
        return abs(car.d_m - self.lane_d_m) < (car.body.length_m + self.ego.WIDTH) / 2 + PATH_MARGIN_M

    def in_path(self, car: Car) -> bool:
        """Whether the ego would touch the car on its lane."""
        s, d = car.spine_place
        return abs(d - self.ego.lane.line.offset_at(s)) < (car.WIDTH + self.ego.WIDTH) / 2 + PATH_MARGIN_M

    def person_m(self) -> float | None:
        """Distance to a road user that crosses the ego's way or will soon, on foot or out of a side road."""
        person = person_ahead_m(self.crossing, self.front_m, self.lane_d_m, True)
        cars = [car.s_m - 1.0 - self.front_m for car in self.cross.cars if car.seen and self._comes(car)]
        ahead = [max(each, 0.05) for each in cars if -0.5 < each < SEES_LINE_M]
        return min(ahead + ([] if person is None else [person]), default=None)

    def _comes(self, car: CrossCar) -> bool:
        return car.comes_s(self.lane_d_m) < SOON_S

    def stop_ahead(self, visibility_m: float) -> StopAhead | None:
        """The next line at which the ego has to stop now."""
        speed, front_m = float(self.ego.speed), self.front_m
        for line in self.lines:
            distance = line.at_m - front_m
            if not -1.0 < distance < min(SEES_LINE_M, visibility_m):
                continue
            if line.kind == "stop_line" and not self.stood.watch(EGO, line, distance, speed, self.time_s):
                return StopAhead(key=line.key, distance_m=distance)
            if line.kind == "light" and must_stop(self.lights.state(line), speed, distance):
                return StopAhead(key=line.key, distance_m=distance)
            if line.kind == "yield" and (car := self.cross.coming(line, self.lane_d_m, WAITS_S)) and car.seen:
                return StopAhead(key=line.key, distance_m=distance)
        return None

    def stop_due(self) -> tuple[Line, float] | None:
        """The next line at which the ego has to stop or give way now, seen or not, and how far its front is from it."""
        front_m = self.front_m
        for line in self.lines:
            distance = line.at_m - front_m
            if -1.0 < distance < SEES_LINE_M and self.must_stop(line, distance):
                return line, distance
        return None

    def must_stop(self, line: Line, distance_m: float) -> bool:
        """Whether the ego may not cross a line now."""
        if line.kind == "light":
            return must_stop(self.lights.state(line), float(self.ego.speed), distance_m)
        if line.kind == "stop_line":
            return not self.has_stood(line)
        return self.cross.coming(line, self.lane_d_m) is not None

    def has_stood(self, line: Line) -> bool:
        """Whether the ego has stood at a stop sign's line."""
        return (EGO, line.key) in self.stood.served

    # For the other cars ----------------------------------------------------------------------------------------------------

    def stop_mps2(self, car: Car) -> float:
        """The deceleration that lines and people demand of a car."""
        return min(self._for_lines(car), self._for_people(car))

    def _for_lines(self, car: Car) -> float:
        forward, front = _front(car)
        demands = [FREE]
        for line in self.lines:
            at_m = line.at_m if forward else line.opposite_m
            if at_m is None:
                continue
            distance = at_m - front if forward else front - at_m
            if -1.0 < distance < SEES_LINE_M and self._bars(car, line, distance, not forward):
                demands.append(stopping_mps2(car.speed, distance, 1.8))
        return min(demands)

    def _bars(self, car: Car, line: Line, distance_m: float, oncoming: bool) -> bool:
        if line.kind == "light":
            return must_stop(self.lights.state(line, oncoming), car.speed, distance_m)
        if line.kind == "yield":
            return self.cross.coming(line, self.lane_d_m, WAITS_S) is not None
        return not self.stood.watch(car.number, line, distance_m, car.speed, self.time_s)

    def _for_people(self, car: Car) -> float:
        if not self.crossing:
            return FREE
        forward, front = _front(car)
        ahead = person_ahead_m(self.crossing, front, car.lane.line.offset_at(car.s_m), forward, 45.0)
        return FREE if ahead is None else stopping_mps2(car.speed, ahead - KEEPS_FROM_PEOPLE_M, 1.5)


def _front(car: Car) -> tuple[bool, float]:
    """Whether a car drives forward, and where its front bumper is."""
    forward = direction_of(car.lane_index) == "forward"
    return forward, car.s_m + (car.LENGTH / 2 if forward else -car.LENGTH / 2)

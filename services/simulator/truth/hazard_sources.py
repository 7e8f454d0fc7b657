"""Sources of hazards for the ego at this instant, and whether the truth has crossed the event's threshold.

Thresholds are those of the assistant's events (`services/orchestrator/events.py`; a test holds the two together): a
time to collision below 4 s, more than 0.4 m/s2 needed to stop at a line or to come down to a school's limit. Water is
a hazard when a sound tyre would float on it at the ego's speed.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial

from domain.kinematics import needed_mps2
from services.simulator.car import tyres
from services.simulator.driver.road_ahead import RoadAhead
from services.simulator.people.pedestrians import PERSON_IDS
from services.simulator.road.highway_env_road import to_pose
from services.simulator.road.route import Route
from services.simulator.road.stop_lines import Line
from services.simulator.scenario.law import Law, Legal, read_post
from services.simulator.scene.scene import Box, Pose, StaticWorld
from services.simulator.traffic.cars import Car
from services.simulator.truth.hazards import HazardSource
from services.simulator.truth.ledger import TOLERANCE_MPS

CLOSING_PER_S = 0.25
"""1 / time to collision."""
NEEDED_MPS2 = 0.4
PERSON_M, VEHICLE_M, QUEUE_M, SCHOOL_M = 70.0, 150.0, 200.0, 120.0
LEAVES_S = 0.8
"""A cut-in is over when the gap is longer than this and opens."""
QUEUE_SLOWER_MPS = 3.0
CREEPS_MPS, JOINED_M = 7.0, 120.0
"""A car this slow this near behind a queue has joined it."""
_LIGHT = (0.3, 0.35, 0.9, 2.3)
_FACE = (0.05, 0.75, 0.75, 2.05)
"""Length, width, height and foot of what one sees of lights and of a sign."""


@dataclass(frozen=True, slots=True)
class School:
    """A limit at a school: from its sign to where the limit is another one."""

    from_m: float
    to_m: float
    limit_mps: float


@dataclass(slots=True)
class HazardSources:
    """The hazard sources of a drive."""

    route: Route
    static: StaticWorld
    law: Law
    road_ahead: RoadAhead
    schools: tuple[School, ...] = field(init=False)

    def __post_init__(self) -> None:
        self.schools = tuple(_schools(self.law, self.route.length_m))

    def now(self, film_mm: float) -> Iterator[HazardSource]:
        """All of this instant."""
        yield from self._people()
        yield from self._vehicles()
        yield from self._tail()
        yield from self._lines()
        yield from self._at_schools()
        yield from self._water(film_mm)

    # Road users -----------------------------------------------------------------------------------------------------

    def _people(self) -> Iterator[HazardSource]:
        front_m = self.road_ahead.front_m
        for person in self.road_ahead.crossing:
            ahead = person.s_m - front_m
            if person.plan is not None and person.plan.hazard and -2.0 < ahead < PERSON_M:
                body = Box(self.route.pose(person.s_m, person.d_m), 0.45, 0.55, person.height_m)
                yield HazardSource(
                    kind="pedestrian",
                    key=person.number,
                    distance_m=ahead,
                    begins=True,
                    body=body,
                    actor_id=PERSON_IDS + person.number,
                    lit=self.route.stretch_at(person.s_m).lamps,
                )

    def _vehicles(self) -> Iterator[HazardSource]:
        for car, part in self.road_ahead.traffic.parts.items():
            gap = self._gap_m(car)
            if not -car.LENGTH < gap < VEHICLE_M or not self.road_ahead.in_path(car):
                continue
            if part.halting is not None and part.halting.hazard:
                yield self._vehicle("lead_brakes", car, gap)
            elif part.stands:
                yield self._vehicle("stopped_lead", car, gap)
            elif part.changed and part.plan.lane_change and part.plan.lane_change.hazard and self._presses(car, gap):
                yield self._vehicle("cut_in", car, gap)

    def _presses(self, car: Car, gap_m: float) -> bool:
        speed = float(self.road_ahead.ego.speed)
        return speed > car.speed or gap_m < LEAVES_S * speed

    def _tail(self) -> Iterator[HazardSource]:
        queue = [car for car in self.road_ahead.traffic.queue if self.road_ahead.in_path(car)]
        if not queue:
            return
        last_m = min(car.s_m for car in queue)
        cars = self.road_ahead.traffic.cars
        joined = [car for car in cars if car.speed < CREEPS_MPS and self.road_ahead.in_path(car)]
        tails = [(self._gap_m(car), car) for car in (*queue, *joined) if car.s_m > last_m - JOINED_M]
        ahead = [(gap, car) for gap, car in tails if -car.LENGTH < gap < QUEUE_M]
        if ahead:
            gap, car = min(ahead, key=lambda each: each[0])
            if float(self.road_ahead.ego.speed) - car.speed > QUEUE_SLOWER_MPS:
                yield self._vehicle("congestion_tail", car, gap, key=0)

    def _vehicle(self, kind: str, car: Car, gap_m: float, key: int | None = None) -> HazardSource:
        closing = float(self.road_ahead.ego.speed) - float(car.speed)
        shape = car.body
        return HazardSource(
            kind=kind,
            key=car.number if key is None else key,
            distance_m=gap_m,
            begins=closing / max(gap_m, 0.1) > CLOSING_PER_S,
            body=Box(to_pose(car.position, car.heading), shape.length_m, shape.width_m, shape.height_m),
            actor_id=car.number,
            lit=True,
        )

    def _gap_m(self, car: Car) -> float:
        return car.s_m - car.LENGTH / 2 - self.road_ahead.front_m

    # Lines ----------------------------------------------------------------------------------------------------------

    def _lines(self) -> Iterator[HazardSource]:
        due = self.road_ahead.stop_due()
        if due is None:
            return
        line, distance = due
        begins = self._needs(distance, 0.0)
        due_here = partial(HazardSource, key=line.key, distance_m=distance, begins=begins, lit=True)
        if line.kind == "yield":
            car = self.road_ahead.cross.coming(line, self.road_ahead.lane_d_m)
            if car is not None:
                shape = car.body
                body = Box(self.road_ahead.cross.pose(car), shape.length_m, shape.width_m, shape.height_m)
                yield due_here(kind="priority", body=body, actor_id=car.number)
            return
        yield due_here(kind="stop_line", body=self._mark(line))

    def _mark(self, line: Line) -> Box | None:
        """What tells of the line: the near head of its lights, or its sign, which headlamps light from afar."""
        if line.kind == "light":
            head = self.static.lights[3 * line.ordinal]
            return _upright(head.pose, _LIGHT)
        posts = self.static.signs[len(self.route.scenario.signs) :]
        return next((_upright(each.pose, _FACE) for each in posts if _at(each.pose, self.route, line.at_m)), None)

    def _needs(self, distance_m: float, down_to_mps: float) -> bool:
        return needed_mps2(float(self.road_ahead.ego.speed), distance_m, down_to_mps) > NEEDED_MPS2

    # Places ---------------------------------------------------------------------------------------------------------

    def _at_schools(self) -> Iterator[HazardSource]:
        front, speed = self.road_ahead.front_m, float(self.road_ahead.ego.speed)
        for number, school in enumerate(self.schools):
            distance = school.from_m - front
            if distance < SCHOOL_M and front < school.to_m and speed > school.limit_mps + TOLERANCE_MPS:
                sign = self.route.near(school.from_m) * (self.route.kerb_m(school.from_m) + 0.55)
                yield HazardSource(
                    kind="school_zone",
                    key=number,
                    distance_m=distance,
                    begins=distance <= 0.0 or self._needs(distance, school.limit_mps),
                    body=_upright(self.route.pose(school.from_m, sign), _FACE) if distance > 3.0 else None,
                    lit=True,
                )

    def _water(self, film_mm: float) -> Iterator[HazardSource]:
        front = self.road_ahead.front_m
        floats = float(self.road_ahead.ego.speed) > tyres.aquaplaning_mps(film_mm)
        for number, water in enumerate(self.route.scenario.water):
            if water.from_m <= front <= water.to_m + self.road_ahead.ego.LENGTH:
                yield HazardSource(kind="deep_water", key=number, distance_m=0.0, begins=floats)


def _upright(pose: Pose, size: tuple[float, float, float, float]) -> Box:
    length, width, height, foot = size
    return Box(pose, length, width, foot + height, foot)


def _at(pose: Pose, route: Route, at_m: float) -> bool:
    s, _ = route.section.spine.project(pose.x_m, pose.y_m)
    return abs(s - at_m) < 1.5


def _schools(law: Law, length_m: float) -> Iterator[School]:
    """Every post that speaks of children and of a limit, as long as that limit holds."""
    for number, post in enumerate(law.posts):
        if "children" not in post.codes or not any(code.startswith("limit:") for code in post.codes):
            continue
        legal = Legal(country=post.country, road_class=law.class_at(post.at_m))
        limit = read_post(legal, post.country, post.codes, legal.road_class).limit_mps(False)
        ends = [later.at_m for later in law.posts[number + 1 :] if law.at(later.at_m, {}).limit_mps(False) != limit]
        if limit is not None:
            yield School(post.at_m, min(ends, default=length_m), limit)

"""The cars around the ego: placed with gaps, kept near it, obeying lights, people and their own parts."""

import math
from dataclasses import dataclass, field

import numpy as np
from highway_env.road.road import Road

from services.simulator.car.kinematics import FREE, bend_speed_mps, stopping_mps2
from services.simulator.road.cross_section import Direction
from services.simulator.road.highway_env_road import LaneIndex, direction_of, lane_index, lane_of
from services.simulator.road.route import Route
from services.simulator.scenario.plan import HaltPlan, Scenario, VehiclePlan
from services.simulator.scene.scene import ActorKind
from services.simulator.traffic.cars import Car, Ego, body

FREE_MPS = 130 / 3.6
BEHIND_M, AHEAD_M, GONE_AHEAD_M = 170.0, 420.0, 650.0
LAST_ID = 480
FASTER_PER_LANE = 0.05
"""With each lane towards the median one drives this much faster."""
NEAR_M = 80.0
LEAST_GAP = 0.8
"""The least share of the scripted gap at which a car cuts in."""
BESIDE_M, BESIDE_S = 4.0, 1.5
"""Nor where another car of that lane is so near, bumper to bumper, or closes up within so long."""
LEAVES_MPS2 = 4.0
"""A car that leaves the lane does so at the latest where it would have to brake so hard for what is ahead. Where it cannot, it
brakes."""
PACES_PER_S = 1.0
"""Speed by which a car that keeps pace with the ego makes up for each metre that it is off."""
PACES_LEAST_MPS = 3.0
"""It never waits for an ego that stands: behind it, both would stand for good."""
_KINDS: tuple[ActorKind, ...] = ("saloon", "estate", "saloon", "van", "saloon", "motorcycle")


@dataclass(slots=True)
class ScriptedPart:
    """A scripted vehicle's part: the halts still to come, and how long it still stands."""

    plan: VehiclePlan
    halts: list[HaltPlan]
    changed: bool = False
    """Its change of lane has begun."""
    stands: bool = False
    near_s: float = 0.0
    """How long the ego has been near one that stands."""
    holds_s: float = 0.0
    halting: HaltPlan | None = None
    """The halt being made; the last one's hazard is counted from when braking began."""


@dataclass(slots=True)
class Traffic:
    """All cars but the ego."""

    route: Route
    road: Road
    ego: Ego
    seed: int
    parts: dict[Car, ScriptedPart] = field(default_factory=dict)
    queue: dict[Car, float] = field(default_factory=dict)
    """Cars of a congestion tail, and when it dissolves for each."""
    numbers: int = 0
    chance: np.random.Generator = field(init=False)

    def __post_init__(self) -> None:
        self.chance = np.random.default_rng([self.seed, 41])

    @property
    def cars(self) -> list[Car]:
        """The cars, in a fixed order."""
        return [vehicle for vehicle in self.road.vehicles if vehicle is not self.ego]

    # Placing ------------------------------------------------------------------------------------------------------------

    def fill(self, scenario: Scenario) -> None:
        """Scripted cars and queues first, then the rest where there is room."""
        for plan in scenario.vehicles:
            self._script(plan)
        for queue in scenario.queues:
            for row in range(queue.rows):
                for lane in range(self.route.section.lanes):
                    s = queue.tail_m + row * queue.spacing_m + float(self.chance.uniform(0.0, 3.0))
                    car = self.add("forward", lane, s, queue.speed_kmh / 3.6)
                    car.keeps_mps = max(queue.speed_kmh / 3.6, 0.1)
                    self.queue[car] = queue.dissolves_s + row * 1.5
        self._spread("forward", scenario.traffic.forward, scenario.traffic.gap_m)
        self._spread("oncoming", scenario.traffic.oncoming, scenario.traffic.gap_m)

    def add(self, direction: Direction, lane: int, s_m: float, speed: float, kind: ActorKind | None = None) -> Car:
        """A new car."""
        index = lane_index(direction, lane)
        shape = body(kind or self._kind(lane), int(self.chance.integers(1, 10_000)))
        car = Car(self.road, index, lane_of(self.road, index).s_of(s_m), speed, shape)
        self._name(car)
        self.road.vehicles.append(car)
        return car

    def _script(self, plan: VehiclePlan) -> None:
        car = self.add(plan.direction, plan.lane, plan.at_m, plan.speed_kmh / 3.6, plan.kind)
        car.keeps_mps = plan.keeps_kmh / 3.6 if plan.keeps_kmh is not None else FREE
        car.speed_bias = 1.0
        self.parts[car] = ScriptedPart(plan, list(plan.halts), stands=plan.stands_s is not None)

    def _spread(self, direction: Direction, count: int, gap_m: float) -> None:
        ego_s, lanes = self.ego.s_m, self.route.section.lanes
        low = ego_s + 60.0 if lanes == 1 or direction == "oncoming" else ego_s - 120.0
        for index in range(count):
            lane = index % lanes
            s = low + (index // lanes + float(self.chance.uniform(0.1, 0.9))) * gap_m
            if self.clear(direction, lane, s):
                self.add(direction, lane, s, self._pace(s, direction))

    def clear(self, direction: Direction, lane: int, s_m: float, room_m: float = 28.0) -> bool:
        """Whether a car may appear there."""
        span = self.route.section.span()
        crosses = span is not None and direction == "oncoming" and span[0] - 10.0 < s_m < span[1] + 70.0
        if crosses or not 5.0 < s_m < self.route.length_m - 40.0:  # past lights that hold it, or too near to stop
            return False
        index = lane_index(direction, lane)
        others = [*self.cars, self.ego]
        return all(abs(car.s_m - s_m) > room_m for car in others if index in (car.lane_index, car.target_lane_index))

    def _name(self, car: Car) -> None:
        self.numbers = self.numbers % LAST_ID + 1
        car.number = self.numbers
        car.speed_bias = float(np.clip(self.chance.normal(1.02, 0.07), 0.85, 1.2))

    def _kind(self, lane: int) -> ActorKind:
        outermost = lane == self.route.section.lanes - 1
        if outermost and self.chance.random() < self.route.scenario.traffic.lorries:
            return "lorry"
        return _KINDS[int(self.chance.integers(len(_KINDS)))]

    def _pace(self, s_m: float, direction: Direction) -> float:
        slow = {"urban": 11.0, "rural": 20.0, "motorway": 33.0}[self.route.stretch_at(s_m).road_class]
        line = lane_of(self.road, lane_index(direction, 0)).line
        return min(slow, bend_speed_mps(line.curvature_ahead(s_m - 5.0, 10.0)))

    # Keeping them near ----------------------------------------------------------------------------------------------------

    def recycle(self) -> None:
        """Cars that have fallen out of the ego's neighbourhood come into it again at its edge, as other cars."""
        ego_s = self.ego.s_m
        for car in self.cars:
            away, direction = car.s_m - ego_s, direction_of(car.lane_index)
            ended = not 3.0 < car.s_m < self.route.length_m - 8.0
            if not ended and -BEHIND_M < away < GONE_AHEAD_M:
                continue
            if away > 0 and not ended and (car in self.queue or car in self.parts or car.speed < 1.0):
                continue  # its part is still to come
            place = self._place(direction, ahead=away < 0 or ended or direction == "oncoming")
            if place is not None:
                self._replace(car, direction, *place)
            elif ended:
                self.road.vehicles.remove(car)

    def _place(self, direction: Direction, ahead: bool) -> tuple[int, float] | None:
        s = self.ego.s_m + (float(self.chance.uniform(AHEAD_M - 120.0, AHEAD_M)) if ahead else -BEHIND_M + 20.0)
        lane = int(self.chance.integers(self.route.section.lanes))
        return (lane, s) if self.clear(direction, lane, s) else None

    def _replace(self, car: Car, direction: Direction, lane: int, s_m: float) -> None:
        self.road.vehicles.remove(car)
        self.parts.pop(car, None)
        self.queue.pop(car, None)
        self.add(direction, lane, s_m, self._pace(s_m, direction))

    # Driving --------------------------------------------------------------------------------------------------------------

    def wish_speed(self, car: Car, lawful_mps: float | None, time_s: float) -> None:
        """Set a car's wished speed from the law, the bend ahead and its part."""
        if car in self.queue and time_s >= self.queue[car]:
            del self.queue[car]
            car.keeps_mps = FREE
        line, s = car.lane.line, car.s_m
        look = 12.0 + 2.0 * car.speed
        bend = bend_speed_mps(
            line.curvature_ahead(*((s, look) if direction_of(car.lane_index) == "forward" else (s, -look)))
        )
        part = self.parts.get(car)
        heeds = lawful_mps is not None and (part is None or part.plan.heeds_limits)
        faster = 1.0 + FASTER_PER_LANE * (self.route.section.lanes - 1 - int(car.lane_index[2]))
        law = (lawful_mps if heeds and lawful_mps is not None else FREE_MPS * 0.92) * car.speed_bias * faster
        lorry = 82 / 3.6 if car.body.kind in ("lorry", "bus") else FREE
        car.target_speed = max(min(law, bend, car.keeps_mps, lorry), 0.1)
        if part is not None:
            self._change_lane(car, part)

    def _change_lane(self, car: Car, part: ScriptedPart) -> None:
        """Keep pace with the ego until the place of the lane change, then make it."""
        change = part.plan.lane_change
        if change is None or part.changed:
            return
        late = change.paces_m is None and self._runs_up(car)
        car.blind = change.paces_m is None and not late
        gap = car.s_m - self.ego.s_m - (car.LENGTH + self.ego.LENGTH) / 2
        if late or self.ego.s_m >= change.when_ego_at_m:
            car.keeps_mps = min(car.keeps_mps, change.then_kmh / 3.6 if change.then_kmh else FREE)
            due = change.at_gap_m is None or LEAST_GAP * change.at_gap_m <= gap <= change.at_gap_m
            if due and self._room_beside(car, lane_index("forward", change.to_lane)):
                part.changed, car.blind, car.target_lane_index = True, False, lane_index("forward", change.to_lane)
        elif change.paces_m is not None:
            car.target_speed = max(float(self.ego.speed) + PACES_PER_S * (change.paces_m - gap), PACES_LEAST_MPS)

    def _runs_up(self, car: Car) -> bool:
        """Whether it has come so near to what drives or stands ahead that it has to do something about it."""
        ahead, _ = self.road.neighbour_vehicles(car, car.lane_index)
        closing_mps = float(car.speed - ahead.speed) if ahead is not None else 0.0
        return closing_mps > 0.0 and closing_mps**2 > 2.0 * LEAVES_MPS2 * car.lane_distance_to(ahead)

    def _room_beside(self, car: Car, lane: LaneIndex) -> bool:
        """Whether no other car of the traffic in that lane is beside it, nor closes up: the two would collide and stand for good."""
        for other in self.cars:
            if other is car or lane not in (other.lane_index, other.target_lane_index):
                continue
            away = other.s_m - car.s_m
            closing_mps = float(other.speed - car.speed) * (1.0 if away < 0.0 else -1.0)
            clear_m = abs(away) - (car.LENGTH + other.LENGTH) / 2
            if clear_m < BESIDE_M + BESIDE_S * max(closing_mps, 0.0):
                return False
        return True

    def halt_mps2(self, car: Car, dt: float) -> float:
        """What a scripted car's next halt demands; it brakes as late as its plan says."""
        part = self.parts.get(car)
        if part is None:
            return FREE
        if part.stands:
            return self._stand_mps2(car, part, dt)
        if part.holds_s > 0.0:
            part.holds_s -= dt
            return -max(car.speed * 4.0, 1.0)
        part.halting = part.halting if part.halts else None
        return self._next_halt(car, part) if part.halts else FREE

    def _stand_mps2(self, car: Car, part: ScriptedPart, dt: float) -> float:
        part.near_s += dt if 0.0 < car.s_m - self.ego.s_m < NEAR_M else 0.0
        part.stands = part.near_s < (part.plan.stands_s or 0.0)
        return -max(car.speed * 4.0, 1.0)

    def _next_halt(self, car: Car, part: ScriptedPart) -> float:
        halt = part.halts[0]
        front = halt.at_m - car.s_m if direction_of(car.lane_index) == "forward" else car.s_m - halt.at_m
        demand = stopping_mps2(car.speed, front, halt.brake_mps2 * 0.9)
        if demand is not FREE and demand != math.inf:
            part.halting = halt
        if car.speed < 0.15 and part.halting is halt:
            part.halts.pop(0)
            part.holds_s = halt.hold_s
        return demand if part.halting is halt else FREE

"""Cars out of side roads that have right of way: they come when the ego does, cross its road, and are gone.

They go straight on at their speed and brake only for a car that is already in their way, or for a halt that is planned. Other cars
let them pass, from both directions. They do not belong to highway-env, whose lanes all follow the ego's road.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

from services.simulator.car.kinematics import FREE, stopping_mps2
from services.simulator.road.layout import SIDE_ROAD_M
from services.simulator.road.route import JUNCTION_AFTER_LINE_M, Route
from services.simulator.road.stop_lines import Line
from services.simulator.scenario.plan import CrossCarPlan
from services.simulator.scene.scene import Actor, Pose
from services.simulator.traffic.cars import Body, Car, Ego, body

CROSS_IDS = 481
"""Actor ids of up to 19 of them."""
SIDE_LANE_M = 1.6
CORRIDOR_M = 1.2
"""Half the width of the ego's way that is kept clear of them."""
HALTS_BEFORE_M = 1.0
"""Between the road's edge and the front of one that halts."""
GIVES_WAY_S = 3.0
"""A car that comes to the ego's way within this time has to be let through; ours: the ego needs as long to be across."""
HARDEST_MPS2, SPEEDS_UP_MPS2 = 6.0, 1.5


@dataclass(slots=True, eq=False)
class CrossCar:
    """One car; (s, d) on the spine, `way` is +1 when it drives to the left as the ego sees it."""

    number: int
    line: Line
    plan: CrossCarPlan
    body: Body
    s_m: float
    d_m: float
    way: float
    gone_m: float
    speed_mps: float = 0.0
    applied_mps2: float = 0.0
    started: bool = False
    seen: bool = False
    """The ego has had half of it in sight."""

    @property
    def gone(self) -> bool:
        """Whether it has left."""
        return self.way * self.d_m > self.gone_m

    def gap_m(self, lane_d_m: float) -> float:
        """From its front to the ego's way."""
        return self.way * (lane_d_m - self.d_m) - self.body.length_m / 2 - CORRIDOR_M

    def passed(self, lane_d_m: float) -> bool:
        """Whether it has left the ego's way."""
        return self.way * (self.d_m - lane_d_m) - self.body.length_m / 2 > CORRIDOR_M

    def comes_s(self, lane_d_m: float) -> float:
        """Seconds until it is in the ego's way; FREE: it is not coming, or is through."""
        if not self.started or self.passed(lane_d_m):
            return FREE
        gap = self.gap_m(lane_d_m)
        return 0.0 if gap <= 0.0 else gap / self.speed_mps if self.speed_mps > 0.5 else FREE

    def drive(self, dt: float, stop_in_m: float | None) -> None:
        """A step on."""
        wanted = self.plan.speed_kmh / 3.6
        urgent_mps2 = self.plan.halts_mps2 or 2.0
        demand = stopping_mps2(self.speed_mps, stop_in_m, urgent_mps2) if stop_in_m is not None else FREE
        pull = min(SPEEDS_UP_MPS2, (wanted - self.speed_mps) / dt) if demand is FREE else demand
        self.applied_mps2 = max(pull, -HARDEST_MPS2, -self.speed_mps / dt)
        self.speed_mps += self.applied_mps2 * dt
        self.d_m += self.way * self.speed_mps * dt


@dataclass(slots=True)
class CrossTraffic:
    """All of them."""

    route: Route
    cars: list[CrossCar] = field(default_factory=list)

    def place(self, lines: Iterable[Line], seed: int) -> None:
        """Every car at its start, out in its side road."""
        for line in lines:
            if line.kind != "yield":
                continue
            for plan in self.route.scenario.yields[line.ordinal].cars:
                self.cars.append(self._car(line, plan, CROSS_IDS + len(self.cars), seed))

    def _car(self, line: Line, plan: CrossCarPlan, number: int, seed: int) -> CrossCar:
        way = 1.0 if plan.from_side == "right" else -1.0
        middle = line.at_m + JUNCTION_AFTER_LINE_M
        out_m = self.route.kerb_m(middle) + SIDE_ROAD_M - 6.0
        return CrossCar(
            number=number,
            line=line,
            plan=plan,
            body=body(plan.kind, 1 + (seed * 17 + number) % 9999),
            s_m=middle - SIDE_LANE_M * way * self.route.near(middle),
            d_m=-way * out_m,
            way=way,
            gone_m=out_m,
            speed_mps=plan.speed_kmh / 3.6,
        )

    def step(self, dt: float, ego: Ego, others: Iterable[Car]) -> None:
        """All of them a moment later."""
        if not self.cars:
            return
        near = [car for car in others if self._near(car.s_m)]
        for car in self.cars:
            distance = car.line.at_m - ego.s_m - ego.LENGTH / 2
            car.started = car.started or distance <= car.plan.when_ego_within_m
            if car.started and not car.gone:
                car.drive(dt, self._room_m(car, (ego, *near)))

    def _near(self, s_m: float) -> bool:
        return any(abs(s_m - car.s_m) < 25.0 for car in self.cars)

    def _room_m(self, car: CrossCar, others: Iterable[Car | Ego]) -> float | None:
        """How far it may still go: up to what is in its way, and up to its halt; `None`: as far as it likes."""
        ways = (self._blocked_m(car, others), self._to_halt_m(car))
        return min((way for way in ways if way is not None), default=None)

    def _to_halt_m(self, car: CrossCar) -> float | None:
        if car.plan.halts_mps2 is None:
            return None
        return -car.way * car.d_m - self.route.kerb_m(car.s_m) - HALTS_BEFORE_M - car.body.length_m / 2

    def _blocked_m(self, car: CrossCar, others: Iterable[Car | Ego]) -> float | None:
        """How far it may still go because another car is in its way; `None` without one."""
        blocked: float | None = None
        for other in others:
            s, d = other.spine_place
            beside = car.way * (d - car.d_m) - (car.body.length_m + other.WIDTH) / 2
            inside = abs(s - car.s_m) < (other.LENGTH + car.body.width_m) / 2 + 0.5
            if inside and beside > -0.5 and (blocked is None or beside < blocked):
                blocked = max(beside - 1.0, 0.0)
        return blocked

    def coming(self, line: Line, lane_d_m: float, within_s: float = GIVES_WAY_S) -> CrossCar | None:
        """The next car that has to be let through at a line."""
        found = [car for car in self.cars if car.line is line and car.comes_s(lane_d_m) <= within_s]
        return min(found, key=lambda car: car.comes_s(lane_d_m), default=None)

    def on_the_road(self) -> list[CrossCar]:
        """Those that are there to be seen."""
        return [car for car in self.cars if not car.gone]

    def actor(self, car: CrossCar, lights_on: bool) -> Actor:
        """One of them as it looks."""
        shape = car.body
        return Actor(
            id=car.number,
            kind=shape.kind,
            pose=self.pose(car),
            length_m=shape.length_m,
            width_m=shape.width_m,
            height_m=shape.height_m,
            look_seed=shape.look_seed,
            mesh_family=shape.mesh_family,
            braking=car.applied_mps2 < -0.5,
            lights_on=lights_on,
        )

    def pose(self, car: CrossCar) -> Pose:
        """Where it is."""
        return self.route.pose(car.s_m, car.d_m, car.way * math.pi / 2)

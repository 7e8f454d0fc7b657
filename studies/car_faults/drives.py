"""One drive: the simulated car on a course, with a fault from some second on; what its bus carries, step by step."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from domain.kinematics import GRAVITY_MPS2
from proto.sensors import CanFrame
from services.simulator.car import tyres
from services.simulator.car.braking import Ability, Braked, decelerate
from services.simulator.car.car import Car
from services.simulator.car.faults import Faults
from services.simulator.car.state import WHEELBASE_M, CarState, Controls
from services.simulator.driver.driver import pedals
from services.simulator.ecus.can_frames import FrameEncoder
from services.simulator.sensors.measurements import wiper_stage
from services.simulator.world import STEP_S
from studies.car_faults.courses import LATERAL_MPS2, Course, Stretch

NS = 1_000_000_000
STEP_NS = round(STEP_S * NS)
EPOCH_NS = 1000 * NS
PUSH_MPS2, JERK_MPS3, BEND_S = 1.6, 6.0, 1.5


@dataclass(frozen=True, slots=True)
class Onset:
    """A fault, how grave, and from which second on."""

    preset: str
    severity: float
    at_s: float


@dataclass(frozen=True, slots=True)
class Step:
    """What one step gives; `state` is how the car really is."""

    time_s: float
    now_ns: int
    frames: tuple[CanFrame, ...]
    state: CarState


@dataclass(slots=True)
class _Driving:
    """Motion and the driver's foot."""

    speed_mps: float
    wish_mps2: float = 0.0
    bend_per_m: float = 0.0
    braked: Braked = field(default_factory=lambda: Braked(0.0))

    def step(self, course: Course, stretch: Stretch, time_s: float, car: Ability) -> Controls:
        """One step of motion: what the car's units are told of it."""
        before = self.speed_mps
        self.wish_mps2 += _towards(_wish(self.speed_mps, stretch) - self.wish_mps2, JERK_MPS3 * STEP_S)
        mu = course.mu * tyres.grip_share(car.lacking, course.film_mm, before)
        asked = min(max(0.0, -self.wish_mps2), course.mu * GRAVITY_MPS2)
        self.braked = decelerate(asked, car, mu, course.film_mm, before, self.braked.locked)
        change = self.wish_mps2 if self.wish_mps2 > 0.0 else -self.braked.mps2
        self.speed_mps = max(0.0, before + change * STEP_S)
        self._bend(stretch)
        return self._controls(course, (self.speed_mps - before) / STEP_S, time_s, mu, car)

    def _bend(self, stretch: Stretch) -> None:
        widest = LATERAL_MPS2 / max(self.speed_mps, 1.0) ** 2
        wanted = min(max(stretch.bend_per_m, -widest), widest)
        self.bend_per_m += (wanted - self.bend_per_m) * min(1.0, STEP_S / BEND_S)

    def _controls(self, course: Course, change_mps2: float, time_s: float, mu: float, car: Ability) -> Controls:
        pressed, moving = pedals(self.wish_mps2), self.speed_mps > 0.0
        return Controls(
            speed_mps=self.speed_mps,
            acceleration_mps2=change_mps2,
            climb_mps2=course.climb(time_s),
            yaw_rate_radps=self.bend_per_m * self.speed_mps,
            road_wheel_rad=math.atan(WHEELBASE_M * self.bend_per_m) - tyres.pull_rad(car.lacking),
            accelerator=pressed.accelerator,
            brake=pressed.brake,
            abs_active=self.speed_mps > 1.5 and self.braked.at_limit and not self.braked.locked,
            locked=moving and self.braked.locked,
            mu=mu,
            wiper_stage=wiper_stage(course.rain_mm_h),
            rain_mm_h=course.rain_mm_h,
            light_lx=course.light_lx,
            outside_temperature_c=course.outside_c,
            headlamps=2 if course.night or course.rain_mm_h > 1.0 else 0,
        )


def drive(course: Course, seed: int, onset: Onset | None, dbc: Path) -> Iterator[Step]:
    """The frames of the whole drive."""
    faults, encoder = Faults(), FrameEncoder(dbc)
    car, motion = Car(seed, faults, course.outside_c), _Driving(course.start_mps)
    for number in range(1, int(course.seconds / STEP_S) + 1):
        time_s, now_ns = number * STEP_S, EPOCH_NS + number * STEP_NS
        if onset is not None and not faults.active and time_s >= onset.at_s:
            faults.activate(onset.preset, onset.severity)
        controls = motion.step(course, course.stretch(time_s), time_s, car.ability(now_ns))
        told = car.step(STEP_S, controls, now_ns)
        yield Step(time_s, now_ns, tuple(encoder.due(told.frames, now_ns, told.silent)), car.state)


def _wish(speed_mps: float, stretch: Stretch) -> float:
    return min(PUSH_MPS2, max(-stretch.brakes_mps2, (stretch.wanted_mps - speed_mps) * 0.8))


def _towards(gap: float, most: float) -> float:
    return min(max(gap, -most), most)

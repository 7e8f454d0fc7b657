"""Drives from plain kinematics with noise and the bus's resolution, and what can go wrong with a sensor or the car."""

import math
import random
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from services.can.health.crosscheck import SENSORS
from services.can.health.expected_values import WHEELS, Shape
from services.can.signals.field import Reading

NS = 1_000_000_000
STEP_S = 0.05
SHAPE = Shape(track_m=1.56, wheelbase_m=2.7, brake_bar_per_mps2=10.0, brake_bar_full_pedal=90.0)
TYRES = tuple(rule.field for rule in SENSORS if rule.field.startswith("tyre"))
NOMINAL = dict(zip(TYRES, (2.4, 2.4, 2.6, 2.6), strict=True))
RADIUS_SHARE = 0.03
"""How much faster a wheel turns without any pressure."""
SLOW_S: Mapping[str, float] = dict.fromkeys(TYRES, 1.0) | {"outside_temperature_c": 0.1}
RESOLUTION: Mapping[str, float] = (
    dict.fromkeys((*WHEELS, "speed_mps"), 0.01 / 3.6)
    | dict.fromkeys(TYRES, 0.02)
    | {"acceleration_mps2": 0.001, "yaw_rate_radps": 0.000175, "brake_pressure_bar": 0.1, "outside_temperature_c": 0.5}
)
NOISE: Mapping[str, float] = (
    dict.fromkeys((*WHEELS, "speed_mps"), 0.04)
    | dict.fromkeys(TYRES, 0.015)
    | {"acceleration_mps2": 0.1, "yaw_rate_radps": 0.004, "brake_pressure_bar": 0.5, "outside_temperature_c": 0.25}
)
OFFSET: Mapping[str, tuple[float, float]] = (
    dict.fromkeys((*WHEELS, "speed_mps"), (1.2, 3.0))
    | dict.fromkeys(TYRES, (0.3, 0.6))
    | {
        "acceleration_mps2": (0.8, 2.0),
        "yaw_rate_radps": (0.05, 0.12),
        "brake_pressure_bar": (10.0, 25.0),
        "outside_temperature_c": (6.0, 15.0),
    }
)
LOUD: Mapping[str, float] = (
    dict.fromkeys((*WHEELS, "speed_mps"), 0.8)
    | dict.fromkeys(TYRES, 0.15)
    | {"acceleration_mps2": 0.9, "yaw_rate_radps": 0.045, "brake_pressure_bar": 8.0, "outside_temperature_c": 3.0}
)
SIGNED = ("acceleration_mps2", "yaw_rate_radps", "outside_temperature_c", "steering_angle_rad")


@dataclass
class Fault:
    """What goes wrong from `onset_s` on: a kind of sensor fault on a field, or a fault of the car, or nothing."""

    kind: str = ""
    field: str = ""
    size: float = 0.0
    onset_s: float = 25.0
    frozen: float | None = None


@dataclass
class Drive:
    """A seeded drive through town and country: it accelerates, brakes, takes bends and stands at times."""

    seed: int
    fault: Fault = field(default_factory=Fault)
    seconds: float = 90.0

    def samples(self) -> Iterator[tuple[int, dict[str, Reading]]]:
        """(stamp, readings) every 50 ms."""
        rng = random.Random(self.seed)
        speed, wanted, bend, bend_goal, leak = rng.uniform(8.0, 20.0), 15.0, 0.0, 0.0, 0.0
        outside, gear_s = rng.uniform(-5.0, 30.0), 0.0
        accel, held = 0.0, dict[str, tuple[float, int]]()
        for step in range(int(self.seconds / STEP_S)):
            t = step * STEP_S
            if t >= gear_s:
                gear_s = t + rng.uniform(3.0, 9.0)
                wanted = rng.choice((0.0, 8.0, 13.9, 13.9, 19.0, 25.0))
                bend_goal = rng.choice((0.0, 0.0, rng.uniform(-0.02, 0.02), rng.uniform(-0.05, 0.05)))
            goal = min(max((wanted - speed) * 0.5, -rng.choice((3.5,)) if wanted > 0 else -3.0), 2.0)
            accel += min(max(goal - accel, -0.4), 0.4) if speed > 0 or goal > 0 else -accel
            active = self.fault if t >= self.fault.onset_s else Fault()
            brake = max(0.0, -accel - 0.4) / 9.0
            done = accel if active.kind != "weak_brakes" else accel + brake * 9.0 * active.size
            pulse = active.size if active.kind == "pulses" and accel < 0.0 and step % 6 < 3 else 0.0
            done -= pulse
            speed = max(0.0, speed + done * STEP_S)
            if speed == 0.0:
                done = 0.0
            bend += min(max(bend_goal - bend, -0.002), 0.002)
            limit = 2.5 / max(speed, 3.0) ** 2
            yaw = speed * min(max(bend, -limit), limit)
            if active.kind == "soft_tyre":
                leak = min(active.size, leak + 0.05 * STEP_S)
            truth = self._truth(speed, done, yaw, brake, outside, leak if active.kind == "soft_tyre" else 0.0)
            truth["brake_pressure_bar"] += pulse * (SHAPE.brake_bar_per_mps2 or 0.0) if speed > 0.0 else 0.0
            yield int(t * NS) + NS, self._readings(rng, truth, held, active, int(t * NS) + NS, t, speed)

    def _truth(
        self, speed: float, accel: float, yaw: float, brake: float, outside: float, leak: float
    ) -> dict[str, float]:
        slip = 0.03 * min(1.0, abs(accel) / 9.0)
        along = speed * (1.0 - math.copysign(slip, -accel)) if accel else speed
        across = yaw * SHAPE.track_m / 2.0
        pressures = {name: NOMINAL[name] - (leak if name == self.fault.field else 0.0) for name in TYRES}
        wheels = {
            wheel: max(0.0, along + side * across) * (1.0 + RADIUS_SHARE * (1.0 - pressures[tyre] / NOMINAL[tyre]))
            for wheel, side, tyre in zip(WHEELS, (-1, 1, -1, 1), TYRES, strict=True)
        }
        curve = yaw / max(speed, 1.0)
        steer = math.atan(SHAPE.wheelbase_m * curve * (1.0 + 0.0025 * speed**2))
        return {
            **wheels, **pressures, "speed_mps": speed, "acceleration_mps2": accel, "yaw_rate_radps": yaw,
            "steering_angle_rad": steer, "brake_pedal": brake, "brake_pressure_bar": brake * 90.0, "abs_active": 0.0,
            "esc_active": 0.0, "outside_temperature_c": outside,
        }  # fmt: skip

    def _readings(
        self, rng: random.Random, truth: dict[str, float], held: dict[str, tuple[float, int]], active: Fault,
        now_ns: int, t: float, speed: float,
    ) -> dict[str, Reading]:  # fmt: skip
        found = {}
        for name, value in truth.items():
            due = name not in held or now_ns - held[name][1] >= SLOW_S.get(name, 0.0) * NS
            if due:
                held[name] = (self._shown(rng, name, value, active, held, speed), now_ns)
            if name == active.field and active.kind == "missing":
                found[name] = Reading(None, now_ns, "silent")
            else:
                found[name] = Reading(held[name][0], held[name][1], "")
        return found

    def _shown(
        self, rng: random.Random, name: str, value: float, active: Fault, held: dict[str, tuple[float, int]],
        speed: float,
    ) -> float:  # fmt: skip
        quiet = name in (*WHEELS, "speed_mps") and speed < 0.3
        value += 0.0 if quiet else rng.gauss(0.0, NOISE.get(name, 0.0))
        if name == active.field:
            if active.kind == "stuck" and name in held:
                return held[name][0]
            if active.kind == "noisy":
                value += rng.gauss(0.0, active.size)
            if active.kind == "offset":
                value += active.size
        value = value if name in SIGNED else max(0.0, value)
        unit = RESOLUTION.get(name)
        return round(value / unit) * unit if unit else value


@dataclass
class Guarded(Drive):
    """A drive that a guard brakes without a foot, from `speed_mps` to `until_mps`, and then holds or lets go."""

    speed_mps: float = 15.0
    until_mps: float = 0.0
    brakes_mps2: float = 6.5
    jerk_mps3: float = 10.0

    def samples(self) -> Iterator[tuple[int, dict[str, Reading]]]:
        """See `Drive`."""
        rng, held = random.Random(self.seed), dict[str, tuple[float, int]]()
        speed, asked = self.speed_mps, 0.0
        for step in range(int(self.seconds / STEP_S)):
            t = step * STEP_S
            braking = t >= 10.0 and (speed > self.until_mps or self.until_mps == 0.0)
            asked = min(self.brakes_mps2, asked + self.jerk_mps3 * STEP_S) if braking else 0.0
            speed = max(0.0, speed - asked * STEP_S)
            truth = self._truth(speed, -asked if speed > 0.0 else 0.0, 0.0, 0.0, 15.0, 0.0)
            truth["brake_pressure_bar"] = asked * (SHAPE.brake_bar_per_mps2 or 0.0)
            yield int(t * NS) + NS, self._readings(rng, truth, held, Fault(), int(t * NS) + NS, t, speed)


def make(index: int, base: int = 0) -> tuple[Drive, str]:
    """One of a set: its drive and its label, `kind field`."""
    rng = random.Random(base + index)
    onset = rng.uniform(18.0, 30.0)
    which = index % 10
    if which < 2:
        return Drive(base + index), "none"
    if which == 2:
        tyre = rng.choice(TYRES)
        return Drive(base + index, Fault("soft_tyre", tyre, rng.uniform(0.8, 1.3), onset)), "car"
    if which == 3:
        return Drive(base + index, Fault("weak_brakes", "", rng.uniform(0.4, 0.7), onset)), "car"
    sensor = rng.choice(SENSORS).field
    slow = sensor.startswith(("tyre", "outside"))
    kind = rng.choice(("noisy", "offset", "missing") if slow else ("stuck", "noisy", "offset", "missing"))
    low, high = OFFSET[sensor]
    size = rng.uniform(low, high) * rng.choice((-1, 1)) if kind == "offset" else LOUD[sensor]
    return Drive(base + index, Fault(kind, sensor, size, onset)), f"{kind} {sensor}"

"""Long drives of a sound car and of one that leaks: tyres warm, brakes, generator, and the sensors' noise and steps."""

import random
from collections.abc import Iterator
from typing import NamedTuple

from proto.vehicle import Trend
from services.can.health.ratios import TYRES
from services.can.health.trends import TYRE_WARNING_SHARE, Trends

NOMINAL_BAR = (2.4, 2.4, 2.6, 2.6)
WHEELS = ("fl", "fr", "rl", "rr")
STEP_S, MINUTES = 2.0, 30.0
LEAK_SEED = 10_000


class Leak(NamedTuple):
    """One tyre, how fast it loses air, and since when."""

    wheel: int
    bar_per_min: float
    from_s: float


class Outcome(NamedTuple):
    """The first trend told and when, s; when the pressure passed the warning threshold, s. None: never."""

    told_s: float | None
    trend: Trend | None
    lamp_s: float | None


class _Car:
    """Tyres, discs, battery and coolant of one seeded drive."""

    def __init__(self, seed: int, leak: Leak | None) -> None:
        self.rng, self.leak = random.Random(seed), leak
        self.air_c = self.rng.uniform(-5.0, 25.0)
        self.filled_c = self.rng.uniform(5.0, 25.0)
        self.tyres_c = [self.air_c] * 4
        self.goal_c = [self.air_c + self.rng.uniform(8.0, 25.0)] * 4
        self.base_bar = [nominal * self.rng.uniform(0.97, 1.05) for nominal in NOMINAL_BAR]
        self.discs_c = [self.air_c] * 4
        self.volts, self.coolant_c, self.load = self.rng.uniform(13.8, 14.5), self.rng.uniform(70.0, 95.0), 0.0

    def step(self, index: int) -> None:
        rng = self.rng
        if index % 30 == 0:
            self.goal_c = [goal + rng.gauss(0.0, 1.5) for goal in self.goal_c]
            self.load = rng.random()
        braked = rng.uniform(5.0, 35.0) if rng.random() < 0.03 else 0.0
        for wheel in range(4):
            self.tyres_c[wheel] += (self.goal_c[wheel] - self.tyres_c[wheel]) * STEP_S / 600.0
            self.discs_c[wheel] += braked - (self.discs_c[wheel] - self.air_c) * STEP_S / 140.0
        self.coolant_c += (88.0 + 12.0 * self.load - self.coolant_c) * STEP_S / 120.0

    def pressure_bar(self, wheel: int, time_s: float) -> float:
        warm = (273.15 + self.tyres_c[wheel]) / (273.15 + self.filled_c)
        lost = 0.0
        if self.leak is not None and self.leak.wheel == wheel:
            lost = max(0.0, time_s - self.leak.from_s) / 60.0 * self.leak.bar_per_min
        return (self.base_bar[wheel] + 1.013) * warm - 1.013 - lost

    def values(self, time_s: float) -> dict[str, float | None]:
        rng, seen = self.rng, dict[str, float | None]()
        for wheel, name in enumerate(WHEELS):
            seen[TYRES[wheel]] = round((self.pressure_bar(wheel, time_s) + rng.gauss(0.0, 0.012)) / 0.02) * 0.02
            seen[f"tyre_temperature_{name}_c"] = float(round(self.tyres_c[wheel] + rng.gauss(0.0, 0.7)))
            seen[f"brake_temperature_{name}_c"] = float(round(self.discs_c[wheel]))
        seen["battery_voltage_v"] = round(self.volts + rng.gauss(0.0, 0.08) - 0.5 * self.load, 1)
        seen["coolant_temperature_c"] = float(round(self.coolant_c + rng.gauss(0.0, 0.6)))
        return seen


def drive(seed: int, leak: Leak | None = None, minutes: float = MINUTES) -> Outcome:
    """One drive, until the lamp would come or the time is over."""
    car, trends = _Car(seed, leak), Trends(NOMINAL_BAR)
    told_s: float | None = None
    trend: Trend | None = None
    for index in range(int(minutes * 60.0 / STEP_S)):
        time_s = index * STEP_S
        car.step(index)
        trends.step(car.values(time_s), int(time_s * 1e9) + 1)
        if trends.found and trend is None:
            told_s, trend = time_s, trends.found[0]
        for wheel in range(4):
            if leak is not None and car.pressure_bar(wheel, time_s) < TYRE_WARNING_SHARE * NOMINAL_BAR[wheel]:
                return Outcome(told_s, trend, time_s)
    return Outcome(told_s, trend, None)


def leaking(count: int) -> Iterator[tuple[Leak, Outcome]]:
    """Drives of up to 90 min, each with one leak that reaches the threshold."""
    for seed in range(LEAK_SEED, LEAK_SEED + count):
        rng = random.Random(f"leak {seed}")
        leak = Leak(rng.randrange(4), rng.uniform(0.01, 0.1), rng.uniform(60.0, 600.0))
        yield leak, drive(seed, leak, 90.0)


def in_time(leak: Leak, outcome: Outcome) -> bool:
    """Whether the leaking tyre was told before its lamp."""
    named = outcome.trend is not None and outcome.trend.name == f"slow_leak_{WHEELS[leak.wheel]}"
    return named and outcome.lamp_s is not None and outcome.told_s is not None and outcome.told_s < outcome.lamp_s

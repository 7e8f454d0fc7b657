"""Drives through weathers: the true friction beside the interval that Weather publishes."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from services.simulator.environment.weather import WeatherCourse
from services.weather.assess import assess
from services.weather.memory import Memory
from services.weather.road.car import Car
from studies.weather.sources import Instant, Tells
from studies.weather.weathers import GENERATED, Keys

STEPS, STEP_S = 60, 10.0
WANTED_INSIDE, WANTED_GAP = 0.95, 0.15


class Sample(NamedTuple):
    """One assessment."""

    mu: float
    low: float
    high: float
    speed_factor: float


class Figures(NamedTuple):
    """Of many assessments: shares in [0, 1], friction as mu."""

    samples: int
    inside: float
    """Share with the true friction within the interval."""
    over: float
    """Share with less friction than the lower bound promises."""
    worst_over: float
    """By how much at worst."""
    gap: float
    """Median of truth less lower bound."""
    gap_p90: float
    speed_factor: float
    """Median."""

    @property
    def reached(self) -> bool:
        """Whether both goals are."""
        return self.inside >= WANTED_INSIDE and self.gap <= WANTED_GAP


def drive(course: WeatherCourse, seed: int, tells: Tells) -> Iterator[Sample]:
    """Ten minutes of one weather, from a chance moment on; the same for every set of sources."""
    chance = np.random.default_rng([seed, 62])
    starts_s = float(chance.uniform(0.0, 900.0))
    speeds = _speeds(chance)
    memory = Memory()
    for step, speed in enumerate(speeds):
        time_s = starts_s + step * STEP_S
        weather = course.at(time_s)
        mu = weather.mu_at(float(speed))
        instant = Instant(weather=weather, speed_mps=float(speed), mu=mu, time_s=time_s, seed=seed)
        seen = tells(instant)
        car = Car(speed_mps=float(speed)) if seen else Car()
        assessed = assess(seen, car, memory, instant.now_ns)
        memory, told = assessed.memory, assessed.conditions
        yield Sample(mu, told.mu_low, told.mu_high, told.speed_factor)


def _speeds(chance: np.random.Generator) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    """A speed that wanders between town and motorway."""
    corners = chance.uniform(8.0, 36.0, 5)
    return np.interp(np.linspace(0.0, 4.0, STEPS), np.arange(5.0), corners)


def weather_of(name: str, seed: int, files: dict[str, Keys]) -> Keys:
    """A generated weather of a seed, or that of a shipped scenario."""
    if name in files:
        return files[name]
    return GENERATED[name](np.random.default_rng([seed, 63, list(GENERATED).index(name)]))


def figures(samples: Iterable[Sample]) -> Figures:
    """The figures of samples."""
    mu, low, high, factor = (np.array(column) for column in zip(*samples, strict=True))
    return Figures(
        samples=len(mu),
        inside=float(np.mean((mu >= low) & (mu <= high))),
        over=float(np.mean(mu < low)),
        worst_over=float(np.max(np.maximum(low - mu, 0.0))),
        gap=float(np.median(mu - low)),
        gap_p90=float(np.quantile(mu - low, 0.9)),
        speed_factor=float(np.median(factor)),
    )

"""Where a drive goes: speeds, bends, climbs and weather of a town, a country road or a motorway, drawn from a seed."""

import math
import random
from dataclasses import dataclass
from typing import Literal

from services.simulator.environment.weather import friction

Road = Literal["town", "country", "motorway"]
SPEEDS_KMH: dict[Road, tuple[float, float]] = {
    "town": (15.0, 55.0),
    "country": (45.0, 105.0),
    "motorway": (80.0, 140.0),
}
SHARPEST_PER_M: dict[Road, float] = {"town": 0.08, "country": 0.012, "motorway": 0.0015}
LATERAL_MPS2 = 2.5
STOPS = 0.3
"""Share of the stretches in a town that end at a standstill."""
HARD = 0.08
"""Share of the slowings that are hard."""


@dataclass(frozen=True, slots=True)
class Stretch:
    """What the driver wants for some seconds, and how the road bends."""

    from_s: float
    wanted_mps: float
    brakes_mps2: float
    bend_per_m: float


@dataclass(frozen=True, slots=True)
class Course:
    """One drive's way and weather."""

    seconds: float
    road: Road
    stretches: tuple[Stretch, ...]
    rain_mm_h: float
    film_mm: float
    night: bool
    outside_c: float
    climb_mps2: float
    climb_every_s: float
    start_mps: float

    @property
    def mu(self) -> float:
        """Peak friction of the road for a sound car."""
        return friction(self.film_mm)

    @property
    def light_lx(self) -> float:
        """What the light sensor gets."""
        return 1.0 if self.night else 15_000.0

    def stretch(self, time_s: float) -> Stretch:
        """What holds at a time."""
        return next(each for each in reversed(self.stretches) if each.from_s <= time_s)

    def climb(self, time_s: float) -> float:
        """Gravity along the road (m/s2)."""
        return self.climb_mps2 * math.sin(2.0 * math.pi * time_s / self.climb_every_s)


def draw_course(seed: int, *, rain: bool | None = None, night: bool | None = None) -> Course:
    """The course of a seed; `rain` and `night` where it must or must not be so."""
    chance = random.Random(f"course {seed}")
    road: Road = chance.choice(("town", "country", "motorway"))
    seconds = chance.uniform(60.0, 180.0)
    wet, dark = chance.random() < 0.4, chance.random() < 0.3
    rain_mm_h = chance.uniform(1.0, 20.0) if (wet if rain is None else rain) else 0.0
    stretches = tuple(_stretches(chance, road, seconds))
    return Course(
        seconds=seconds,
        road=road,
        stretches=stretches,
        rain_mm_h=rain_mm_h,
        film_mm=0.09 * rain_mm_h**0.65,
        night=dark if night is None else night,
        outside_c=chance.uniform(-5.0, 30.0),
        climb_mps2=chance.uniform(0.0, 0.3),
        climb_every_s=chance.uniform(30.0, 90.0),
        start_mps=stretches[0].wanted_mps,
    )


def _stretches(chance: random.Random, road: Road, seconds: float) -> list[Stretch]:
    stretches: list[Stretch] = []
    at_s = 0.0
    low, high = SPEEDS_KMH[road]
    while at_s < seconds:
        stands = road == "town" and stretches and chance.random() < STOPS
        bend = chance.choice((0.0, 0.0, 1.0, -1.0)) * chance.uniform(0.1, 1.0) * SHARPEST_PER_M[road]
        stretches.append(
            Stretch(
                from_s=at_s,
                wanted_mps=0.0 if stands else chance.uniform(low, high) / 3.6,
                brakes_mps2=chance.uniform(5.0, 8.0) if chance.random() < HARD else chance.uniform(1.0, 3.0),
                bend_per_m=0.0 if stands else bend,
            )
        )
        at_s += chance.uniform(4.0, 8.0) if stands else chance.uniform(6.0, 18.0)
    return stretches

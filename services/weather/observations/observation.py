"""What one source says of weather and road: intervals, an age and a confidence. Fusion takes a tuple of these.

A new source is a function that returns an `Observation`; nothing else has to know it. It leaves out what it does not
know (a vague interval is a warning up to its bad end), and says in `confidence` how often its intervals hold the
truth: below `SURE` it may warn, and never reassure.
"""

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Literal, NamedTuple

import msgspec


class Interval(NamedTuple):
    """low <= high."""

    low: float
    high: float

    def overlaps(self, other: "Interval") -> bool:
        """Whether both can be true."""
        return self.low <= other.high and other.low <= self.high


def between(x: float, points: tuple[tuple[float, float], ...]) -> float:
    """Straight lines through points of rising x; level outside them."""
    if x <= points[0][0]:
        return points[0][1]
    for (x0, y0), (x1, y1) in pairwise(points):
        if x <= x1:
            return y0 + (y1 - y0) * (x - x0) / (x1 - x0)
    return points[-1][1]


NS = 1_000_000_000
SURE = 0.5
"""Up to this confidence an observation only warns."""
FULL = 0.9
"""From this confidence an observation counts in full."""
AHEAD_NS = NS
"""A stamp further in the future than this is a wrong clock, and its observation unsure."""

RoadState = Literal["dry", "damp", "wet", "flooded", "slush", "snow", "packed_snow", "frost", "ice"]


class Observation(msgspec.Struct, frozen=True, kw_only=True):
    """One source at one time; an absent field is unknown, never harmless."""

    source: str
    """Names the source in reasons and in memory: one observation per source at a time."""
    stamp_ns: int
    confidence: float
    """In [0, 1], when it was made."""
    halves_s: float = 60.0
    """Age at which its confidence has halved: seconds for a sensor, an hour for a forecast."""
    rain_mm_h: Interval | None = None
    snow_mm_h: Interval | None = None
    """As water."""
    film_mm: Interval | None = None
    """Water above the road's asperities, measured on the road itself."""
    visibility_m: Interval | None = None
    air_c: Interval | None = None
    road_c: Interval | None = None
    """Measured on the road itself."""
    dew_point_c: Interval | None = None
    humidity: Interval | None = None
    """In [0, 1]."""
    wind_mps: Interval | None = None
    gust_mps: Interval | None = None
    mu: Interval | None = None
    """Friction measured here, by anti-lock braking or slip under known braking."""
    road: RoadState | None = None
    """The surface as a source sees it."""
    bridge: bool | None = None
    """On or shortly before a bridge."""


# Outside these a source is broken, and its value unknown.
LIMITS: Mapping[str, Interval] = {
    "rain_mm_h": Interval(0.0, 400.0),
    "snow_mm_h": Interval(0.0, 100.0),
    "film_mm": Interval(0.0, 50.0),
    "visibility_m": Interval(1.0, 100_000.0),
    "air_c": Interval(-60.0, 60.0),
    "road_c": Interval(-60.0, 80.0),
    "dew_point_c": Interval(-60.0, 40.0),
    "humidity": Interval(0.0, 1.0),
    "wind_mps": Interval(0.0, 90.0),
    "gust_mps": Interval(0.0, 120.0),
    "mu": Interval(0.02, 1.5),
}
FIELDS = (*LIMITS, "road", "bridge")


def clean(observation: Observation) -> Observation:
    """Intervals that no source in order gives become unknown; a confidence that is no number becomes zero."""
    broken = {name: None for name, limits in LIMITS.items() if not _sane(getattr(observation, name), limits)}
    confidence = observation.confidence
    confidence = min(1.0, max(0.0, confidence)) if math.isfinite(confidence) else 0.0
    if not broken and confidence == observation.confidence:
        return observation
    return msgspec.structs.replace(observation, confidence=confidence, **broken)


def trust(observation: Observation, now_ns: int) -> float:
    """Confidence now: halved with every `halves_s` of age."""
    age_ns = now_ns - observation.stamp_ns
    if age_ns < -AHEAD_NS or observation.halves_s <= 0.0:
        return 0.0
    return float(observation.confidence * 0.5 ** (max(0, age_ns) / NS / observation.halves_s))


def _sane(value: Interval | None, limits: Interval) -> bool:
    return value is None or limits.low <= value.low <= value.high <= limits.high

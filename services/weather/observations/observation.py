"""What one source says of weather and road: intervals, an age and a confidence. Fusion takes a tuple of these.

A new source is a function that returns an `Observation`; nothing else has to know it. It leaves out what it does not
know (a vague interval is a warning up to its bad end), and says in `confidence` how often its intervals hold the
truth: below `SURE` it may warn, and never reassure.
"""

import math
from collections.abc import Mapping
from typing import Literal

import msgspec

from services.weather.observations.interval import Interval

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

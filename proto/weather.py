"""What the Weather service publishes and answers."""

from typing import Literal

import msgspec


class Conditions(msgspec.Struct, frozen=True, kw_only=True):
    """Traction and sight. Friction is an interval; its lower bound counts."""

    precipitation: Literal["none", "rain", "snow", "unknown"]
    rain_mm_h: float | None
    visibility_m: float | None
    mu_low: float
    mu_high: float
    risk_level: Literal["low", "moderate", "high", "severe", "unknown"]
    speed_factor: float
    """In (0, 1]: scales a limit into a traction-aware target."""
    following_factor: float
    """At least 1: widens the following distance."""
    confidence: float
    wet: bool | None = None
    visibility_risk: Literal["low", "moderate", "high", "unknown"] = "unknown"
    reason: str = ""
    sources: tuple[str, ...] = ()
    safe_speed_mps: float | None = None
    """The speed from which one stops within sight at `mu_low`: a ceiling whatever the limit; None: sight unknown."""
    reference_speed_mps: float | None = None
    """The speed that the two factors were worked out for."""
    stopping_m: float | None = None
    """Distance to a stop from that speed, reaction included, at the least grip there and with the car's brakes."""
    usual_stopping_m: float | None = None
    """The same on a dry road with sound brakes."""
    bounded_by: Literal["none", "grip", "sight", "wind"] = "none"
    """What the speed factor comes from."""
    gust_mps: float | None = None
    disagree: bool = False
    """Whether sources contradict each other now."""


class Within(msgspec.Struct, frozen=True, kw_only=True):
    """A quantity is at least `low` and at most `high`, and is so with this confidence."""

    low: float
    high: float
    confidence: float


class CameraWeather(msgspec.Struct, frozen=True, kw_only=True):
    """What one camera's pictures tell of the weather. Unset is unknown; probabilities are calibrated, in [0, 1]."""

    camera: str
    visibility_m: Within | None = None
    """Meteorological visibility: where the contrast of a black thing falls to 2 %."""
    rain: float | None = None
    """Probability that rain falls."""
    rain_mm_h: Within | None = None
    wet_road: float | None = None
    """Probability that the road ahead is wet."""
    snow_cover: float | None = None
    """Probability that snow lies on the road."""
    night: bool | None = None
    reasons: tuple[str, ...] = ()
    """What it was read from, and why something cannot be told."""

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

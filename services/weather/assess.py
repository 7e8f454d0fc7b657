"""The assessment: senses in, conditions out. Pure; the memory of what fell silent is passed in and out."""

from typing import Literal

import msgspec

from proto.weather import Conditions
from services.weather import advice
from services.weather.grip import DRYING_S, Grip, fuse
from services.weather.senses import NS, Memory, Senses, clean, hold
from services.weather.sight import sight_m

Risk = Literal["low", "moderate", "high", "severe", "unknown"]
SightRisk = Literal["low", "moderate", "high", "unknown"]

# (lower bound of mu, sight in m) that a level still needs.
_LEVELS: tuple[tuple[Risk, float, float], ...] = (
    ("low", 0.60, 1000.0),
    ("moderate", 0.38, 300.0),
    ("high", 0.18, 80.0),
)
DOUBT_S = 60.0
"""Sources that disagreed keep the confidence low for so long: one of them falling silent settles nothing."""
MAX_CONFIDENCE = 0.9
"""No sensor here measures friction itself."""
_KNOWN_FIELDS = ("rain_mm_h", "film_mm", "visibility_m", "wiper_stage")


class Assessed(msgspec.Struct, frozen=True, kw_only=True):
    """Conditions, and what the next assessment must remember."""

    conditions: Conditions
    memory: Memory


def assess(raw: Senses, memory: Memory, now_ns: int, limit_mps: float | None = None) -> Assessed:
    """The conditions at one instant."""
    senses, kept, held = hold(clean(raw), memory, now_ns)
    recently = kept.wet_ns is not None and 0 <= now_ns - kept.wet_ns <= DRYING_S * NS
    grip = fuse(senses, wet_recently=recently)
    if grip.contradiction:
        kept = msgspec.structs.replace(kept, contradiction_ns=now_ns)
    doubted = kept.contradiction_ns is not None and 0 <= now_ns - kept.contradiction_ns <= DOUBT_S * NS
    sight = sight_m(senses)
    mu_low = round(grip.mu.low, 4)
    reference = advice.reference_speed_mps(senses.speed_mps, limit_mps)
    nothing = not grip.sources and sight is None
    conditions = Conditions(
        precipitation=_precipitation(senses),
        rain_mm_h=senses.rain_mm_h,
        visibility_m=sight,
        mu_low=mu_low,
        mu_high=max(mu_low, round(grip.mu.high, 4)),
        risk_level="unknown" if nothing else _risk(mu_low, sight),
        speed_factor=advice.speed_factor(reference, mu_low, sight),
        following_factor=advice.following_factor(reference, mu_low, sight),
        confidence=_confidence(senses, grip, held, doubted=doubted),
        wet=grip.wet,
        visibility_risk=_sight_risk(sight),
        reason=_reason(grip, sight, held, reference, mu_low),
        sources=grip.sources,
        safe_speed_mps=advice.safe_speed_mps(mu_low, sight),
        reference_speed_mps=reference,
    )
    return Assessed(conditions=conditions, memory=kept)


def _precipitation(senses: Senses) -> Literal["none", "rain", "snow", "unknown"]:
    if (senses.snow_mm_h or 0.0) > 0.0:
        return "snow"
    if (senses.rain_mm_h or 0.0) > 0.1 or (senses.rain_mm_h is None and (senses.wiper_stage or 0) >= 2):
        return "rain"
    return "unknown" if senses.rain_mm_h is None else "none"


def _risk(mu_low: float, sight: float | None) -> Risk:
    for level, mu, seen_m in _LEVELS:
        if mu_low >= mu and (sight is None or sight >= seen_m):
            return level
    return "severe"


def _sight_risk(sight: float | None) -> SightRisk:
    if sight is None:
        return "unknown"
    return "low" if sight >= 1000.0 else "moderate" if sight >= 300.0 else "high"


def _confidence(senses: Senses, grip: Grip, held: frozenset[str], *, doubted: bool) -> float:
    """How much is known: the interval's width already says what is left open. Sources that disagree halve it, a held
    value counts half.
    """
    temperature = any(value is not None for value in (senses.road_c, senses.air_c, senses.outside_c))
    known = [getattr(senses, name) is not None for name in _KNOWN_FIELDS] + [temperature]
    share = (sum(known) - 0.5 * len(held & set(_KNOWN_FIELDS))) / len(known)
    return round(MAX_CONFIDENCE * share * (0.5 if doubted else 1.0), 3)


def _reason(grip: Grip, sight: float | None, held: frozenset[str], reference_mps: float, mu_low: float) -> str:
    parts = [*grip.notes, f"grip {grip.mu.low:.2f} to {grip.mu.high:.2f}"]
    if sight is not None and sight < 2000.0:
        parts.append(f"sight {sight:.0f} m")
    if grip.contradiction:
        parts.append("sources disagree")
    if held:
        parts.append("no longer reported: " + ", ".join(sorted(held)))
    needed = advice.stopping_distance_m(reference_mps, mu_low)
    usual = advice.stopping_distance_m(reference_mps, advice.MU_REFERENCE)
    if needed > usual * 1.05:
        parts.append(
            f"stopping from {reference_mps * 3.6:.0f} km/h takes up to {needed:.0f} m instead of {usual:.0f} m"
        )
    return "; ".join(parts)

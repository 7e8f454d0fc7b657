"""The last word of the Weather: a word that is hardly sure may tighten it, not loosen it."""

import math
from typing import TypeVar

import msgspec

from proto.weather import Conditions

T = TypeVar("T")
WEATHER_SURE = 0.4
"""Below this confidence a report of better weather changes nothing."""
UNKNOWN_SPEED_FACTOR = 0.95
UNKNOWN_FOLLOWING_FACTOR = 1.1
"""Of weather without any sure word on it, and of a vehicle never heard of."""
_UNKNOWN = Conditions(
    precipitation="none", rain_mm_h=None, visibility_m=None, mu_low=math.inf, mu_high=0.0, risk_level="unknown",
    speed_factor=UNKNOWN_SPEED_FACTOR, following_factor=UNKNOWN_FOLLOWING_FACTOR, confidence=0.0,
)  # fmt: skip
_WETNESS = (False, None, True)
_PRECIPITATION = ("none", "unknown", "rain", "snow")


def sane_conditions(conditions: Conditions) -> bool:
    """Whether its numbers are such as weather can have."""
    numbers = (
        conditions.mu_low, conditions.mu_high, conditions.speed_factor, conditions.following_factor, conditions.confidence,
        conditions.visibility_m or 0.0, conditions.rain_mm_h or 0.0, conditions.safe_speed_mps or 0.0,
    )  # fmt: skip
    possible = 0.0 < conditions.mu_low <= conditions.mu_high <= 1.5 and conditions.speed_factor > 0.0
    least = min(conditions.following_factor, conditions.visibility_m or 0.0, conditions.rain_mm_h or 0.0)
    sure = 0.0 <= conditions.confidence <= 1.0
    return possible and sure and least >= 0.0 and all(map(math.isfinite, numbers))


def settle(before: Conditions | None, after: Conditions) -> Conditions | None:
    """The new word on the weather; where it is hardly sure, in each of its parts no better than the old one."""
    if not sane_conditions(after):
        return before
    return after if after.confidence >= WEATHER_SURE else no_better(before or _UNKNOWN, after)


def no_better(before: Conditions, after: Conditions) -> Conditions:
    """A word on the weather, in each of its parts no better than another."""
    rains = [each for each in (before.rain_mm_h, after.rain_mm_h) if each is not None]
    return msgspec.structs.replace(
        after,
        mu_low=min(before.mu_low, after.mu_low),
        mu_high=max(before.mu_high, after.mu_high),
        speed_factor=min(before.speed_factor, after.speed_factor),
        following_factor=max(before.following_factor, after.following_factor),
        visibility_m=_least(before.visibility_m, after.visibility_m),
        safe_speed_mps=_least(before.safe_speed_mps, after.safe_speed_mps),
        rain_mm_h=max(rains, default=None),
        wet=_worse(before.wet, after.wet, _WETNESS),
        precipitation=_worse(before.precipitation, after.precipitation, _PRECIPITATION),
    )


def _least(*known: float | None) -> float | None:
    return min((each for each in known if each is not None), default=None)


def _worse(before: T, after: T, order: tuple[T, ...]) -> T:
    return max(before, after, key=order.index)

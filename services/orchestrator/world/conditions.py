"""The word of the Weather that is held: one that is hardly sure may tighten it, not loosen it."""

import math
from typing import TypeVar

import msgspec

from proto.weather import Conditions

T = TypeVar("T")
WEATHER_SURE = 0.4
"""Below this confidence a report of better weather changes nothing."""
UNKNOWN_SPEED_FACTOR = 0.95
UNKNOWN_FOLLOWING_FACTOR = 1.1
"""Of weather never heard of by one who was sure, and of a vehicle never heard of."""
_WETNESS = (False, None, True)
_PRECIPITATION = ("none", "unknown", "rain", "snow")


def sane_conditions(conditions: Conditions) -> bool:
    """Numbers that weather can have."""
    numbers = [conditions.mu_low, conditions.mu_high, conditions.speed_factor, conditions.following_factor]
    numbers += [
        each for each in (conditions.visibility_m, conditions.rain_mm_h, conditions.safe_speed_mps) if each is not None
    ]
    if not all(math.isfinite(number) for number in (*numbers, conditions.confidence)):
        return False
    return 0.0 < conditions.mu_low <= conditions.mu_high <= 1.5 and conditions.speed_factor > 0.0


def settle(before: Conditions | None, after: Conditions) -> Conditions | None:
    """The new word on the weather, in each of its parts no better than the old one where it is hardly sure."""
    if not sane_conditions(after):
        return before
    if after.confidence >= WEATHER_SURE:
        return after
    if before is None:
        return msgspec.structs.replace(
            after,
            speed_factor=min(UNKNOWN_SPEED_FACTOR, after.speed_factor),
            following_factor=max(UNKNOWN_FOLLOWING_FACTOR, after.following_factor),
            wet=_worse(None, after.wet, _WETNESS),
        )
    return no_better(before, after)


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

"""How long an observation is taken at its word, and which numbers are any."""

import math
from typing import Any

from proto.vehicle import Degradation
from services.orchestrator.observations.inputs import Stamped

SECOND = 1_000_000_000
VALID_NS: dict[str, int] = {
    "speed": SECOND // 5, "tracks": 3 * SECOND // 10, "lanes": SECOND // 2, "conditions": 5 * SECOND,
    "degradation": 5 * SECOND // 2, "light": SECOND, "sign": 3 * SECOND, "limit": 600 * SECOND, "position": SECOND // 2,
    "stated": 3600 * SECOND,
}  # fmt: skip
"""How long an observation is taken at its word."""
EXPERT_VALID_NS = 10 * SECOND
"""How long a third party's restriction stands."""
UNSET_AFTER = 3.0
"""Validities after which a field is unset; on the way there its confidence falls to nothing."""
MOST_SKEW_NS = VALID_NS["speed"]
MOST_PLAUSIBLE = 1000.0
"""Metres, m/s, seconds: nothing that a car's sensors see exceeds it."""


def confidence_at(confidence: float, age_ns: int, valid_ns: int) -> float:
    """As observed while valid, then falling in a straight line to nothing at `UNSET_AFTER` validities.

    Nothing is left of what comes from a future that clock skew does not explain.
    """
    if age_ns < -MOST_SKEW_NS:
        return 0.0
    over = age_ns / valid_ns - 1.0
    return max(0.0, confidence * min(1.0, 1.0 - over / (UNSET_AFTER - 1.0)))


def fresh(stamped: Stamped[Any] | None, valid_ns: int, now_ns: int) -> Stamped[Any] | None:
    """The message unless it is older than a field may get, or comes from a future that clock skew does not explain."""
    if stamped is None or not -MOST_SKEW_NS <= now_ns - stamped.stamp_ns < UNSET_AFTER * valid_ns:
        return None
    return stamped


def newer(stamp_ns: int, held_ns: int | None, now_ns: int) -> bool:
    """Whether a word comes after the one that is held; after one from the future any does."""
    return held_ns is None or stamp_ns > held_ns or held_ns > now_ns


def fresh_ns(stamp_ns: int | None, valid_ns: int, now_ns: int) -> bool:
    """Whether something was told within its validity."""
    return stamp_ns is not None and -MOST_SKEW_NS <= now_ns - stamp_ns <= valid_ns


def sane_health(car: Degradation) -> bool:
    """A degradation that is known and is one."""
    parts = [car.h, *([car.brake_envelope] if car.brake_envelope is not None else [])]
    return all(part is not None and math.isfinite(part) and 0.0 <= part <= 1.0 for part in parts)


def number(value: float | None) -> float | None:
    """The value if it is one that a road can hold."""
    return value if value is not None and math.isfinite(value) and abs(value) <= MOST_PLAUSIBLE else None

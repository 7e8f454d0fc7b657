"""A situation made coarse, always to the careful side, so that repeats on a route segment are answered from the cache."""

import math

import msgspec

from proto.rules import PostedLimit, Situation


def coarse(situation: Situation) -> Situation:
    """Confidences down to whole percents, visibility down to whole metres, ages dropped: nothing that raises a limit."""
    return msgspec.structs.replace(
        situation,
        posted=tuple(_coarse_limit(limit) for limit in situation.posted),
        visibility_m=_down(situation.visibility_m, 1.0),
        time_of_day_h=_down(situation.time_of_day_h, 60.0),
        candidates=tuple(
            msgspec.structs.replace(c, confidence=_down(c.confidence, 100.0) or 0.0) for c in situation.candidates
        ),
    )


def _coarse_limit(limit: PostedLimit) -> PostedLimit:
    return msgspec.structs.replace(limit, age_s=0.0, confidence=_down(limit.confidence, 100.0) or 0.0)


def _down(value: float | None, steps: float) -> float | None:
    return math.floor(value * steps + 1e-9) / steps if value is not None and math.isfinite(value) else None

"""A situation made coarse, always to the careful side, so that repeats on a route segment are answered from the cache."""

import math
from collections.abc import Sequence

import msgspec

from proto.rules import PostedLimit, Situation


def coarse(situation: Situation) -> Situation:
    """Confidences down to whole percents, visibility down to whole metres, ages as an order: nothing that raises a limit."""
    ages = _order(situation.posted)
    return msgspec.structs.replace(
        situation,
        posted=tuple(_coarse_limit(limit, age) for limit, age in zip(situation.posted, ages, strict=True)),
        visibility_m=_down(situation.visibility_m, 1.0),
        time_of_day_h=_down(situation.time_of_day_h, 60.0),
        candidates=tuple(
            msgspec.structs.replace(c, confidence=_down(c.confidence, 100.0) or 0.0) for c in situation.candidates
        ),
    )


def _coarse_limit(limit: PostedLimit, age: float) -> PostedLimit:
    return msgspec.structs.replace(limit, age_s=age, confidence=_down(limit.confidence, 100.0) or 0.0)


def _order(posted: Sequence[PostedLimit]) -> list[float]:
    """0 for the newest and for what is as new, then 1, and so on; all 0 without an end, which alone asks what was seen later."""
    if all(limit.scope != "end" for limit in posted):
        return [0.0] * len(posted)
    ages = [_age(limit) for limit in posted]
    ranks = sorted(set(ages))
    return [float(ranks.index(age)) for age in ages]


def _age(limit: PostedLimit) -> float:
    """An age that is no number is the oldest of an end's, the newest of a limit's: then the end lifts nothing."""
    unknown = math.inf if limit.scope == "end" else -math.inf
    return unknown if math.isnan(limit.age_s) else limit.age_s


def _down(value: float | None, steps: float) -> float | None:
    return math.floor(value * steps + 1e-9) / steps if value is not None and math.isfinite(value) else None

"""Which readings of the ego's speed are speeds, and which accelerations the speed bears out.

Orchestrator and arbiter each pass what they believed last.
"""

import math
from typing import NamedTuple

MOST_MPS = 100.0
"""360 km/h: no road car drives faster, forwards or backwards."""
CHANGE_MPS2 = 15.0
"""No car on tyres changes its speed faster: 1.5 g."""
JITTER_MPS = 1.5
"""Two readings that follow each other may differ by so much more: wheels slip and lock, and stamps are rounded."""
MOST_OWED_MPS = 1.0
"""The speed may fall so much less than the decelerations promise: a speed is filtered for longer than an acceleration."""
FORGETS_S = 2.0
"""A promise is forgotten with this time constant. The slope of the road, which an accelerometer feels, is part of the promise."""
COUNTED_S = 0.2
"""A reading of the acceleration promises for no longer than this."""


class Believed(NamedTuple):
    """A reading that was a speed."""

    mps: float
    stamp_ns: int
    owed_mps: float = 0.0
    """How much less the speed fell recently than the decelerations promised."""
    unrisen_mps: float = 0.0
    """How much less it rose than the accelerations promised."""


def believed(told: Believed, before: Believed | None, mps2: float | None = None) -> Believed | None:
    """The reading that is told with an acceleration (m/s²) or, where that is no speed, the one that was believed before."""
    if not is_speed(told.mps, told.stamp_ns, before):
        return before
    if before is None:
        return told
    short_mps = _short_mps(told, before, mps2 or 0.0)
    kept = math.exp(-max(0.0, (told.stamp_ns - before.stamp_ns) / 1e9) / FORGETS_S)
    return told._replace(
        owed_mps=max(0.0, kept * before.owed_mps - short_mps),
        unrisen_mps=max(0.0, kept * before.unrisen_mps + short_mps),
    )


def acceleration_mps2(mps2: float | None, speed: Believed | None) -> float | None:
    """The acceleration that is told; None: no car has it, or the speed does not bear it out."""
    if mps2 is None or not abs(mps2) <= CHANGE_MPS2:
        return None
    if speed is None:
        return mps2 if mps2 >= 0.0 else None
    return mps2 if (speed.owed_mps if mps2 < 0.0 else speed.unrisen_mps) <= MOST_OWED_MPS else None


def _short_mps(told: Believed, before: Believed, mps2: float) -> float:
    """By how much less than the acceleration promises the speed rose, over a pause of `COUNTED_S` at most."""
    seconds = max(0.0, (told.stamp_ns - before.stamp_ns) / 1e9)
    if seconds <= 0.0 or not math.isfinite(mps2):
        return 0.0
    counted_s = min(seconds, COUNTED_S)
    risen_mps2 = (told.mps - before.mps) / seconds
    return (min(CHANGE_MPS2, max(-CHANGE_MPS2, mps2)) - risen_mps2) * counted_s


def is_speed(mps: float, stamp_ns: int, before: Believed | None) -> bool:
    """Whether a car can be so fast, and can have become so since the reading that was believed last.

    The longer ago that is, the more may have changed: a reading that stands is believed in the end.
    """
    if not (math.isfinite(mps) and abs(mps) <= MOST_MPS):
        return False
    if before is None:
        return True
    return abs(mps - before.mps) <= JITTER_MPS + CHANGE_MPS2 * abs(stamp_ns - before.stamp_ns) / 1e9

"""Which readings of the ego's speed are speeds. Orchestrator and arbiter each pass what they believed last."""

import math
from typing import NamedTuple

MOST_MPS = 100.0
"""360 km/h: no road car drives faster, forwards or backwards."""
CHANGE_MPS2 = 15.0
"""No car on tyres changes its speed faster: 1.5 g."""
JITTER_MPS = 1.5
"""Two readings that follow each other may differ by so much more: wheels slip and lock, and stamps are rounded."""


class Believed(NamedTuple):
    """A reading that was a speed."""

    mps: float
    stamp_ns: int


def believed(told: Believed, before: Believed | None) -> Believed | None:
    """The reading that is told or, where that is no speed, the one that was believed before."""
    return told if is_speed(*told, before) else before


def is_speed(mps: float, stamp_ns: int, before: Believed | None) -> bool:
    """Whether a car can be so fast, and can have become so since the reading that was believed last.

    The longer ago that is, the more may have changed: a reading that stands is believed in the end.
    """
    if not (math.isfinite(mps) and abs(mps) <= MOST_MPS):
        return False
    if before is None:
        return True
    return abs(mps - before.mps) <= JITTER_MPS + CHANGE_MPS2 * abs(stamp_ns - before.stamp_ns) / 1e9

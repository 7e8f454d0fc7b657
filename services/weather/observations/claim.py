"""What one source claims of one quantity, and what is to be assumed of all claims together.

Two kinds of evidence, never mixed: reassurance lowers what must be assumed, and counts as far as its source is sure;
a warning raises it, and counts in full whatever its source. So less confidence, more age and one more warning never make
anything look better, exactly: each term below only grows with them.
"""

from collections.abc import Iterable
from typing import NamedTuple

from services.weather.observations.observation import FULL, SURE


class Claim(NamedTuple):
    """Larger is worse. `bound`: it is no worse than this; `warn`: count on this at least."""

    source: str
    bound: float
    warn: float
    trust: float


def share(trust: float) -> float:
    """How far a source of this trust may reassure: 0 up to SURE, 1 from FULL."""
    return min(1.0, max(0.0, (trust - SURE) / (FULL - SURE)))


def assumed(claims: Iterable[Claim], unknown: float) -> float:
    """The value to count on: the best that a source reassures of, no better than any warning, `unknown` without any."""
    found = list(claims)
    reassured = [unknown - share(each.trust) * max(0.0, unknown - each.bound) for each in found]
    return max(min([unknown, *reassured]), *(each.warn for each in found), -1e9)

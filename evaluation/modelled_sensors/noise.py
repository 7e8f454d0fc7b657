"""Chance by name that remembers: numbers that depend on the seed and on what is asked alone, alike from picture to picture.

Each is a first-order chain over the pictures of one thing; which other things there are, and how fast the machine is, do not matter.
"""

import math
from statistics import NormalDist

from evaluation.corruption.chance import chance

_NORMAL = NormalDist()
_EDGE = 1e-9


def normal(seed: int, *names: str | int) -> float:
    """A standard normal number."""
    return _NORMAL.inv_cdf(min(max(chance(seed, *names), _EDGE), 1.0 - _EDGE))


def chance_of(number: float) -> float:
    """The share of standard normal numbers that are greater; never 0."""
    return max(_NORMAL.cdf(-number), _EDGE)


class Drift:
    """Standard normal numbers by name, each alike to its last one by how long ago that was."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._last: dict[tuple[str, str], tuple[int, float]] = {}

    def at(self, what: str, whose: str, stamp_ns: int, memory_s: float) -> float:
        """The number of a thing at a stamp; stamps of a name do not go back."""
        key = what, whose
        fresh = normal(self._seed, what, whose, stamp_ns)
        before = self._last.get(key)
        if before is not None:
            if before[0] == stamp_ns:
                return before[1]
            kept = math.exp(-max(stamp_ns - before[0], 0) / 1e9 / memory_s)
            fresh = kept * before[1] + math.sqrt(1.0 - kept * kept) * fresh
        self._last[key] = stamp_ns, fresh
        return fresh


class Chain:
    """Yes or no by name: stays what it was for the memory's time, else is drawn again with the probability of now."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._last: dict[str, tuple[int, bool]] = {}

    def at(self, whose: str, stamp_ns: int, share: float, memory_s: float) -> bool:
        """Whether it is so at a stamp, of which the share says how often it is so."""
        before = self._last.get(whose)
        likely = share
        if before is not None:
            kept = math.exp(-max(stamp_ns - before[0], 0) / 1e9 / memory_s)
            likely = share + kept * (float(before[1]) - share)
        state = chance(self._seed, "chain", whose, stamp_ns) < likely
        self._last[whose] = stamp_ns, state
        return state

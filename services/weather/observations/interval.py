"""A closed interval of numbers; its lower bound is the one that safety counts on."""

from itertools import pairwise
from typing import NamedTuple


class Interval(NamedTuple):
    """low <= high."""

    low: float
    high: float

    def overlaps(self, other: "Interval") -> bool:
        """Whether both can be true."""
        return self.low <= other.high and other.low <= self.high


def between(x: float, points: tuple[tuple[float, float], ...]) -> float:
    """Straight lines through points of rising x; level outside them."""
    if x <= points[0][0]:
        return points[0][1]
    for (x0, y0), (x1, y1) in pairwise(points):
        if x <= x1:
            return y0 + (y1 - y0) * (x - x0) / (x1 - x0)
    return points[-1][1]

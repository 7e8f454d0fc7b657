"""Stretches of time, and what becomes of yes and no over time."""

from collections.abc import Iterable
from typing import NamedTuple


class Span(NamedTuple):
    """From one instant to another, in seconds since the start."""

    from_s: float
    to_s: float

    def overlaps(self, other: "Span", before_s: float = 0.0, after_s: float = 0.0) -> bool:
        """Whether the other touches this one, widened by so much on either side."""
        return other.from_s <= self.to_s + after_s and other.to_s >= self.from_s - before_s


CONTINUOUS_S = 0.25
"""Samples farther apart than this do not hang together: ticks come every 0.1 s, truth every 0.05 s."""


def spans(samples: Iterable[tuple[float, bool]], pause_s: float = 0.0) -> tuple[Span, ...]:
    """The stretches in which it was so; stretches with a pause of at most `pause_s` between them are one."""
    found: list[Span] = []
    goes_on = False
    for time_s, is_so in samples:
        if is_so:
            gap_s = time_s - found[-1].to_s if found else float("inf")
            if gap_s <= max(pause_s, CONTINUOUS_S if goes_on else 0.0) + 1e-6:
                found[-1] = Span(found[-1].from_s, time_s)
            else:
                found.append(Span(time_s, time_s))
        goes_on = is_so
    return tuple(found)

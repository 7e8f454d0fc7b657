"""How it rides: deceleration and jerk of the true motion, over windows of half a second."""

import math
from collections.abc import Iterator

from evaluation.metrics.record import Record
from evaluation.metrics.spans import spans
from proto.truth import Truth

WINDOW_S = 0.5
"""Ours: what a passenger feels as a push, not a step of the simulation."""
HARD_MPS2 = 3.5
"""Ours: braking beyond it is hard. ISO 15622:2018 lets adaptive cruise control brake with 3.5 m/s^2 at 20 m/s and more."""
APART_S = 2.0


def decelerations_mps2(record: Record) -> list[tuple[float, float]]:
    """(instant, mean deceleration over the half second that ends there), positive in braking."""
    found = []
    for start, end in _windows(record):
        seconds = end.time_s - start.time_s
        found.append((end.time_s, (start.speed_mps - end.speed_mps) / seconds))
    return found


def hardest_braking_mps2(record: Record) -> float | None:
    """The largest mean deceleration over half a second."""
    return max((value for _, value in decelerations_mps2(record)), default=None)


def hard_brakings(record: Record) -> int:
    """Times in which the deceleration went beyond 3.5 m/s^2."""
    return len(spans(((time_s, value > HARD_MPS2) for time_s, value in decelerations_mps2(record)), APART_S))


def jerk_rms_mps3(record: Record) -> float | None:
    """Root mean square of the change of acceleration from one half second to the next."""
    values = decelerations_mps2(record)
    steps = round(WINDOW_S / (values[1][0] - values[0][0])) if len(values) > 1 else 0
    jerks = [(b - a) / (tb - ta) for (ta, a), (tb, b) in zip(values, values[steps:], strict=False)] if steps else []
    return math.sqrt(math.fsum(jerk**2 for jerk in jerks) / len(jerks)) if jerks else None


def _windows(record: Record) -> Iterator[tuple[Truth, Truth]]:
    truths = record.truths
    first = 0
    for truth in truths:
        while truth.time_s - truths[first].time_s > WINDOW_S + 1e-6:
            first += 1
        if truth.time_s - truths[first].time_s >= WINDOW_S - 1e-6:
            yield truths[first], truth

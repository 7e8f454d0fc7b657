"""Feedback over a sequence of drives: whether Delta and c_min keep their bounds, and whether they swing.

Labels come from truth. Each drive is decided again with the Delta and c_min that feedback has left. The driver labels as
false what braked for nothing, as late what was told late or never, and as annoying what was a nag. The next drive begins
with the values at which the last one ended, as the arbiter's own file has it.
"""

from collections.abc import Callable, Sequence
from itertools import cycle, islice, pairwise
from typing import NamedTuple

import msgspec

from drivemcp.errors import UserError
from evaluation.campaign.feedback import after
from evaluation.metrics.labels import Drive, labelled
from evaluation.report.plots import svg_of
from services.arbiter.memory.adapt import within_bounds
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import Adapted
from studies.calibrate.again import again
from studies.calibrate.constants import shipped
from studies.calibrate.recordings import Recording


class Moved(NamedTuple):
    """After a drive; how many labels counted."""

    delta: float
    c_min: float
    counted: int
    given: int


Driver = Callable[[Profile, int], Drive]
"""The labels of a drive with these Delta and c_min, and its number."""


def sequence(driver: Driver, profile: Profile, count: int) -> list[Moved]:
    """Delta and c_min after each of so many drives."""
    adapted, found = Adapted(delta=profile.delta, c_min=profile.c_min), list[Moved]()
    for number in range(count):
        now = msgspec.structs.replace(profile, delta=adapted.delta, c_min=adapted.c_min)
        drive = driver(now, number)
        adapted, counted = after(within_bounds(adapted, profile), drive, profile)
        found.append(Moved(adapted.delta, adapted.c_min, counted, len(drive.labels)))
    return found


def from_truth(recordings: Sequence[Recording], base: Profile, count: int) -> Driver:
    """Recorded drives one after another, each decided again with the Delta and c_min of its turn."""
    turns = list(islice(cycle(recordings), count))
    candidate = shipped(base)

    def driver(profile: Profile, number: int) -> Drive:
        recording = turns[number]
        record = again(recording, candidate.moved("c_min", profile.c_min), profile)
        return labelled(record)

    return driver


class Swing(NamedTuple):
    """How a value went from drive to drive."""

    low: float
    high: float
    last: float
    turns: int
    """Changes of direction by more than a step of feedback."""
    late_span: float
    """Highest less lowest in the second half."""


def swing(values: Sequence[float], step: float) -> Swing:
    """Of a value after each drive."""
    half = values[len(values) // 2 :]
    return Swing(min(values), max(values), values[-1], _turns(values, step), max(half) - min(half))


def _turns(values: Sequence[float], step: float) -> int:
    """Reversals of at least a step: a value that settles has few, one that hunts has one every other drive."""
    peaks, way = [values[0]], 0
    for value in values[1:]:
        moved = value - peaks[-1]
        if way * moved > 0:
            peaks[-1] = value
        elif abs(moved) > step:
            peaks.append(value)
            way = 1 if moved > 0 else -1
    return sum((b - a) * (c - b) < 0 for (a, b), (_, c) in pairwise(pairwise(peaks)))


def svg(found: Sequence[Moved], profile: Profile) -> str:
    """Delta and c_min after each drive, between their bounds."""
    try:
        from matplotlib.figure import Figure
    except ImportError as error:
        raise UserError("matplotlib is missing; install the extra: pip install 'drivemcp[calibrate]'") from error
    figure = Figure(figsize=(7, 4), layout="constrained")
    axes = figure.subplots(2, 1, sharex=True)
    rows = (
        ("Delta", [each.delta for each in found], profile.delta, profile.delta_low, profile.delta_high),
        ("c_min", [each.c_min for each in found], profile.c_min, profile.c_min_low, profile.c_min_high),
    )
    for axis, (name, values, calibrated, low, high) in zip(axes, rows, strict=True):
        axis.plot(range(1, len(values) + 1), values, marker="o", markersize=3, color="#1f5fa8")
        axis.axhline(calibrated, color="#9aa5b1", linestyle="--", linewidth=1)
        for bound in (low, high):
            axis.axhline(bound, color="#d1780f", linewidth=1)
        axis.set_ylabel(name)
        axis.spines[["top", "right"]].set_visible(False)
    axes[-1].set_xlabel("drive; dashed: calibrated, orange: bounds")
    return svg_of(figure)

"""When something is away: windows of bounded length that together take a given share of the time."""

from typing import NamedTuple

from evaluation.corruption.chance import chance
from evaluation.corruption.spec import CorruptionSpec

LEAST_SHARE = 1e-9
"""A smaller share is no window in a lifetime."""


class Window(NamedTuple):
    """From its first to before its last instant, in ns since the drive began."""

    start_ns: int
    end_ns: int


def window_at(spec: CorruptionSpec, kind: str, share: float, subject: str, at_ns: int) -> Window | None:
    """The window of a subject that an instant falls into; None outside of all.

    Time is cut into slots of equal length, which begin at a place of the subject's own; each holds one window. Slots are so
    long that windows take the share. Between two windows of a subject there is at least `shortest_s`, as long as the share
    leaves room for it; at a share of 1 they touch.
    """
    if share < LEAST_SHARE:
        return None
    slot_ns, least_ns = _slot(spec, share)
    longest_ns, shortest_ns = _ns(spec.longest_s), _ns(spec.shortest_s)
    phase_ns = int(chance(spec.seed, kind, subject, "phase") * slot_ns)
    number = (at_ns + phase_ns) // slot_ns
    length_ns = least_ns + int(chance(spec.seed, kind, subject, number, "length") * (longest_ns - least_ns))
    room_ns = max(0, slot_ns - length_ns - shortest_ns)
    start_ns = number * slot_ns - phase_ns + int(chance(spec.seed, kind, subject, number, "start") * room_ns)
    return Window(start_ns, start_ns + length_ns) if start_ns <= at_ns < start_ns + length_ns else None


def _slot(spec: CorruptionSpec, share: float) -> tuple[int, int]:
    """How long a slot is, and the shortest window in it: a high share takes longer windows, never beyond the longest."""
    mean_s = (spec.shortest_s + spec.longest_s) / 2
    if mean_s / share >= spec.longest_s:
        return _ns(mean_s / share), _ns(spec.shortest_s)
    return _ns(spec.longest_s), _ns((2.0 * share - 1.0) * spec.longest_s)


def _ns(seconds: float) -> int:
    return round(seconds * 1e9)

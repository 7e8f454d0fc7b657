"""The times of a log: stamps that are differences are added up, a clock that was set is seen, and one wrong stamp costs itself alone."""

import itertools
import statistics
from collections import deque
from collections.abc import Callable, Iterable, Iterator

import can

GAP_S = 3600.0
"""A jump ahead by more than this is no pause of a drive."""
PAUSE_S = 60.0
"""A jump ahead by more than this is told."""
BACK_S = 1.0
"""Stamps fall back by less where a logger writes the frames of several buses in turn."""
LOOK_AHEAD = 16
LOOK_AT = 64
"""Records that show whether the stamps are differences."""
LARGEST_DIFFERENCE_S = 2.0
LARGEST_STEP_S = 0.1
"""Between two records of which the distance is unknown."""

Numbered = tuple[int, can.Message]
Tell = Callable[[int, str], None]
"""(number of the record, what is told)."""


def in_time(records: Iterable[Numbered], remark: Tell, refuse: Tell) -> Iterator[tuple[float, can.Message]]:
    """(s after the first record, message) in the order of the log, never falling back.

    `remark` is told what was made of the stamps, `refuse` which record is left out because its stamp is wrong.
    """
    stream = iter(records)
    head = list(itertools.islice(stream, LOOK_AT))
    if differences([message.timestamp for _, message in head]):
        remark(1, "its times are differences from frame to frame; they are added up")
        yield from _added_up(itertools.chain(head, stream))
    else:
        yield from _on_one_clock(itertools.chain(head, stream), remark, refuse)


def differences(stamps_s: list[float]) -> bool:
    """Whether stamps are distances from one another: small, all alike or often falling, and not growing."""
    if len(stamps_s) < 8 or not all(0.0 <= each < 1e6 for each in stamps_s):
        return False
    steps = stamps_s[1:] if stamps_s[0] == 0.0 else stamps_s  # the first has nothing before it
    early, late = (statistics.median(each) for each in (steps[: len(steps) // 2], steps[len(steps) // 2 :]))
    if not 0.0 < late < LARGEST_DIFFERENCE_S or late > 1.5 * early:
        return False
    falls = sum(after < before for before, after in itertools.pairwise(steps))
    return falls > len(steps) / 5 or min(steps) == max(steps)


def _added_up(records: Iterable[Numbered]) -> Iterator[tuple[float, can.Message]]:
    at_s, first = 0.0, True
    for _, message in records:
        at_s += 0.0 if first else max(0.0, message.timestamp)
        first = False
        yield at_s, message


def _on_one_clock(records: Iterable[Numbered], remark: Tell, refuse: Tell) -> Iterator[tuple[float, can.Message]]:
    """Of the readable records all but those whose time jumps ahead and is taken back by a record soon after."""
    stream = iter(records)
    window = deque(itertools.islice(stream, LOOK_AHEAD))
    newest_s: float | None = None
    """By the recorder's clock."""
    at_s = step_s = 0.0
    while window:
        number, message = window.popleft()
        window.extend(itertools.islice(stream, 1))
        stamp_s = message.timestamp
        ahead_s = 0.0 if newest_s is None else stamp_s - newest_s
        behind = sum(later.timestamp < stamp_s - GAP_S for _, later in window)
        if behind > len(window) / 2 if newest_s is None else behind and ahead_s > GAP_S:
            refuse(number, "its time lies hours after that of what follows")
            continue
        back = ahead_s < -BACK_S and not any(later.timestamp > stamp_s + BACK_S for _, later in window)
        if newest_s is None:
            newest_s = stamp_s
        elif ahead_s > GAP_S or back:
            remark(
                number,
                f"its time jumps by {ahead_s:+,.0f} s: the clock was set, or another measurement begins; counted on without it",
            )
            at_s, newest_s = at_s + min(step_s, LARGEST_STEP_S), stamp_s
        elif ahead_s > 0.0:
            if ahead_s > PAUSE_S:
                remark(
                    number,
                    f"{ahead_s:,.0f} s without a frame before it: a pause, or the clock was set; kept as a pause",
                )
            at_s, newest_s, step_s = at_s + ahead_s, stamp_s, ahead_s
        yield at_s, message

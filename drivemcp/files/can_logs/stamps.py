"""The times of a log: stamps that are differences are added up, a clock that was set is seen, and one wrong stamp costs itself alone."""

import itertools
import statistics
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import can

GAP_S = 3600.0
"""A jump ahead by more than this is no pause of a drive."""
PAUSE_S = 60.0
"""A jump ahead by more than this is told."""
BACK_S = 1.0
"""Stamps fall back by less where a logger writes the frames of several buses in turn."""
SHORTEST_LOG_S = 0.05
"""A log that another follows in the same file lasts as long, at least."""
SINCE_START_S = 1e6
"""Stamps below this count from a log's own start."""
LOOK_AHEAD = 16
LOOK_AT = 64
"""Records that show whether the stamps are differences."""
FEWEST = 8
"""Fewer records show nothing of their stamps."""
LOOK_LONG_AT = 8192
"""As many, where all have one stamp: a clock that shows whole seconds goes on in the end."""
LARGEST_DIFFERENCE_S = 60.0
GROWS = 0.9
"""A clock goes on: so many pairs of an early and a late stamp have the later one greater, at least."""
LARGEST_STEP_S = 0.1
"""Between two records of which the distance is unknown."""
ROUNDED = (
    "its first frames all have one time, as a table whose times were rounded when it was saved; when each came is not known, "
    "and they come together: export the log anew with all digits of its times"
)

Numbered = tuple[int, can.Message]
Tell = Callable[[int, str], None]
"""(number of the record, what is told)."""


def in_time(records: Iterable[Numbered], remark: Tell, refuse: Tell) -> Iterator[tuple[float, can.Message]]:
    """(s after the first record, message) in the order of the log, never falling back.

    `remark` is told what was made of the stamps, `refuse` which record is left out because its stamp is wrong.
    """
    stream = iter(records)
    head = more = list(itertools.islice(stream, LOOK_AT))
    while more and len(head) < LOOK_LONG_AT and {message.timestamp for _, message in more} == {head[0][1].timestamp}:
        more = list(itertools.islice(stream, LOOK_AT))
        head = [*head, *more]
    if _rounded([message.timestamp for _, message in head]):
        remark(0, ROUNDED)
    if differences([message.timestamp for _, message in head]):
        remark(1, "its times are differences from frame to frame; they are added up")
        yield from _added_up(itertools.chain(head, stream))
    else:
        yield from _on_one_clock(itertools.chain(head, stream), remark, refuse)


def _rounded(stamps_s: list[float]) -> bool:
    """Whether stamps have lost their digits: all are one, or so many together that the next lies seconds later."""
    others = [each for each in stamps_s if each != stamps_s[0]]
    return len(stamps_s) - len(others) >= min(LOOK_AT, max(FEWEST, len(stamps_s))) and all(
        abs(each - stamps_s[0]) > BACK_S for each in others
    )


def differences(stamps_s: list[float]) -> bool:
    """Whether stamps are distances from one another: small, all alike or often falling, and not growing."""
    if len(stamps_s) < FEWEST or not all(0.0 <= each < SINCE_START_S for each in stamps_s):
        return False
    steps = stamps_s[1:] if stamps_s[0] == 0.0 else stamps_s  # the first has nothing before it
    if not 0.0 < statistics.fmean(steps) < LARGEST_DIFFERENCE_S:
        return False
    if min(steps) == max(steps):
        return True
    falls = sum(after < before for before, after in itertools.pairwise(steps))
    return falls > len(steps) / 5 and not _grows(steps)


def _grows(stamps_s: Sequence[float]) -> bool:
    """Whether the last quarter of some stamps is later than the first, as on a clock; several buses in turn fall back on it."""
    early, late = stamps_s[: len(stamps_s) // 4], stamps_s[-(len(stamps_s) // 4) :]
    later = sum(after > before for before in early for after in late)
    return later >= GROWS * len(early) * len(late)


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
    newest: dict[Any, float] = {}
    """By channel, of this measurement."""
    at_s = step_s = start_s = 0.0
    while window:
        number, message = window.popleft()
        window.extend(itertools.islice(stream, 1))
        stamp_s = message.timestamp
        ahead_s = 0.0 if newest_s is None else stamp_s - newest_s
        behind = sum(later.timestamp < stamp_s - GAP_S for _, later in window)
        if behind > len(window) / 2 if newest_s is None else behind and ahead_s > GAP_S:
            refuse(number, "its time lies hours after that of what follows")
            continue
        back = ahead_s < -BACK_S and not _goes_back_to(window, newest_s or 0.0)
        back = back or (
            -BACK_S <= ahead_s < 0.0 and _begins_anew(message, start_s, newest.get(message.channel), window)
        )
        if newest_s is None:
            newest_s = start_s = stamp_s
        elif ahead_s > GAP_S or back:
            remark(number, _jump(ahead_s))
            at_s, newest_s = at_s + min(step_s, LARGEST_STEP_S), stamp_s
            start_s, newest = stamp_s, {}
        elif ahead_s > 0.0:
            if ahead_s > PAUSE_S:
                remark(
                    number,
                    f"{ahead_s:,.0f} s without a frame before it: a pause, or the clock was set; kept as a pause",
                )
            at_s, newest_s, step_s = at_s + ahead_s, stamp_s, ahead_s
        newest[message.channel] = max(stamp_s, newest.get(message.channel, stamp_s))
        yield at_s, message


def _jump(ahead_s: float) -> str:
    ahead = f"{ahead_s:+,.0f}" if abs(ahead_s) >= BACK_S else f"{ahead_s:+.2g}"
    return f"its time jumps by {ahead} s: the clock was set, or another measurement begins; counted on without it"


def _begins_anew(message: can.Message, start_s: float, newest_s: float | None, window: Iterable[Numbered]) -> bool:
    """Whether a bus's own stamps fall back to where they began and go on from there, as in two short logs in one file."""
    after = [later.timestamp for _, later in window if later.channel == message.channel]
    if newest_s is None or not after or newest_s - start_s < SHORTEST_LOG_S or start_s >= SINCE_START_S:
        return False
    near = message.timestamp - start_s < (newest_s - start_s) / 4.0
    return near and message.timestamp < after[0] <= newest_s and after == sorted(after)


def _goes_back_to(window: Iterable[Numbered], newest_s: float) -> bool:
    """Whether stamps soon are what they were before one fell: it alone was wrong, or another bus is written in turn."""
    return any(later.timestamp > newest_s - BACK_S for _, later in window)

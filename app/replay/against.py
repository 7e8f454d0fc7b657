"""Two drives side by side: with one seed and in lockstep they must decide the same. Pure."""

from collections.abc import Iterable, Iterator
from itertools import zip_longest

from app.replay.again import Again
from app.replay.differences import Difference, differences
from proto.decision import TraceRecord

COMPARED = ("tick", "stamp_ns", "cause", "events", "fused", "request", "decision", "advisory", "state_sha256")
"""All that was decided, and the hash of all that was remembered. Call ids and measured times of calls are no decisions."""


def side_by_side(one: Iterable[TraceRecord], other: Iterable[TraceRecord]) -> Iterator[Again]:
    """Tick by tick, in the order of the two logs."""
    for first, second in zip_longest(one, other):
        if first is None or second is None:
            tick = (first or second).tick
            lacking = Difference(field="trace", logged=str(first is not None), again=str(second is not None))
            yield Again(tick=tick, status="different", differences=(lacking,))
            continue
        pairs = ((name, getattr(first, name), getattr(second, name)) for name in COMPARED)
        found = tuple(one for name, logged, new in pairs for one in differences(name, logged, new))
        yield Again(tick=first.tick, status="different" if found else "identical", differences=found)

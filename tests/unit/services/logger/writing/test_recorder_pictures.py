"""Which pictures are kept."""

import pytest

from services.logger.writing.recorder import MAX_WAITING, PictureGate, Pictures
from tests.unit.services.logger.conftest import record


def _kept(gate: PictureGate, stamps: range, events: dict[int, int]) -> list[int]:
    kept = []
    for stamp in stamps:
        kept += [one.log_time_ns for one in gate.offer(record("sensor/camera/front", stamp, stamp))]
        if stamp in events:
            kept += [one.log_time_ns for one in gate.event(events[stamp])]
    return kept


@pytest.mark.parametrize(("mode", "count"), [("all", 100), ("none", 0), ("events", 0)])
def test_without_an_event_all_or_none_are_kept(mode: Pictures, count: int) -> None:
    assert len(_kept(PictureGate(mode, before_ns=10, after_ns=10), range(100), {})) == count


def test_pictures_around_an_event_are_kept_in_order_and_once() -> None:
    gate = PictureGate("events", before_ns=10, after_ns=5)
    assert _kept(gate, range(100), {50: 50}) == list(range(40, 56))


def test_events_close_together_keep_no_picture_twice() -> None:
    gate = PictureGate("events", before_ns=10, after_ns=5)
    assert _kept(gate, range(100), {50: 50, 53: 53, 60: 60}) == list(range(40, 66))


def test_no_more_than_a_bound_is_held_back() -> None:
    gate = PictureGate("events", before_ns=10**9, after_ns=0)
    assert len(_kept(gate, range(2000), {1999: 1999})) == MAX_WAITING

"""The history holds the newest frames exactly, and no bus can make it grow."""

import sys
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proto.sensors import CanFrame
from services.can.buses.history import LATEST_LIMIT, SLOT, History

from .test_link import frames

SLOTS = 50
SIZE_MB = SLOTS * SLOT.size / 1e6


@settings(max_examples=50)
@given(sent=st.lists(frames(), max_size=3 * SLOTS), cuts=st.lists(st.integers(1, 40), max_size=20))
def test_the_newest_frames_come_back_as_they_were(sent: list[CanFrame], cuts: list[int]) -> None:
    history = History(["can0"], SIZE_MB)
    rest = list(sent)
    for cut in [*cuts, len(sent)]:
        history.extend(rest[:cut])
        rest = rest[cut:]
    assert history.since(0) == sent[-SLOTS:]
    assert history.seen == len(sent)
    assert len(history.rings["can0"]) == min(len(sent), SLOTS)


@given(stamps=st.lists(st.integers(0, 9), max_size=SLOTS), since=st.integers(0, 9), limit=st.integers(1, SLOTS))
def test_frames_with_old_stamps_hide_none_of_the_others(stamps: list[int], since: int, limit: int) -> None:
    history = History(["can0"], SIZE_MB)
    history.extend([CanFrame(stamp_ns=each, arbitration_id=n, data=b"") for n, each in enumerate(stamps)])
    wanted = [n for n, each in enumerate(stamps) if each >= since]
    assert [each.arbitration_id for each in history.since(since, limit=limit)] == wanted[-limit:]


def test_what_is_asked_of_the_last_moment_costs_no_look_through_all_that_was_kept() -> None:
    history = History(["can0"], 10_000 * SLOT.size / 1e6)
    recent = [CanFrame(stamp_ns=10 + n, arbitration_id=n, data=b"") for n in range(5)]
    history.extend([CanFrame(stamp_ns=20, arbitration_id=0x7FF, data=b"")])
    history.extend([CanFrame(stamp_ns=n % 10, arbitration_id=0x100, data=b"") for n in range(3000)])
    history.extend(recent)
    assert history.since(10) == recent


wild = st.builds(
    CanFrame,
    stamp_ns=st.integers(-(2**70), 2**70),
    arbitration_id=st.integers(-(2**40), 2**40),
    data=st.binary(max_size=200),
    extended=st.booleans(),
    fd=st.booleans(),
    remote=st.booleans(),
    requested_bytes=st.integers(-5, 300),
)


@settings(max_examples=50)
@given(sent=st.lists(wild, max_size=200))
def test_whatever_a_bus_sends_the_memory_stays_what_it_was(sent: list[CanFrame]) -> None:
    history = History(["can0"], SIZE_MB)
    ring = history.rings["can0"]
    before = ring.size_bytes
    history.extend(sent)
    assert ring.size_bytes == before == SLOTS * SLOT.size
    assert ring.seen + ring.refused == len(sent)
    assert all(len(frame.data) <= 64 for frame in history.since(-(2**70)))


def test_the_newest_of_more_ids_than_are_remembered_are_those_heard_last() -> None:
    history = History(["can0"], SIZE_MB)
    history.extend(
        [CanFrame(stamp_ns=n, arbitration_id=n, data=bytes(64), extended=True, fd=True) for n in range(20_000)]
    )
    latest = history.latest()
    assert len(latest) == LATEST_LIMIT
    assert latest[-1].arbitration_id == 19_999
    assert sum(map(sys.getsizeof, latest)) + LATEST_LIMIT * 100 < 1_000_000


def test_buses_do_not_mix_and_the_same_number_in_11_and_29_bits_is_two_ids() -> None:
    history = History(["a", "b"], SIZE_MB)
    short = CanFrame(stamp_ns=1, arbitration_id=5, data=b"a")
    long = CanFrame(stamp_ns=2, arbitration_id=5, data=b"b", extended=True)
    history.extend([short, long], "a")
    history.extend([long], "b")
    assert (history.since(0, bus="a"), history.since(0, bus="b")) == ([short, long], [long])
    assert history.latest("a") == [short, long]
    assert history.since(2, frozenset({5}), bus="a") == [long]
    assert history.since(0, limit=1, bus="a") == [long]
    assert history.seen == 3
    with pytest.raises(KeyError):
        history.extend([short], "c")


def test_a_full_bus_of_fd_frames_takes_no_more_memory_than_was_set() -> None:
    import tracemalloc

    tracemalloc.start()
    history: Any = History(["can0"], 2.0)
    history.extend([CanFrame(stamp_ns=n, arbitration_id=n % 100, data=bytes(64), fd=True) for n in range(1000)])
    before = tracemalloc.get_traced_memory()[0]
    for start in range(0, 60_000, 500):
        history.extend(
            [CanFrame(stamp_ns=n, arbitration_id=n % 100, data=bytes(64), fd=True) for n in range(start, start + 500)]
        )
    grown = tracemalloc.get_traced_memory()[0] - before
    tracemalloc.stop()
    assert grown < 100_000
    assert history.rings["can0"].size_bytes <= 2_000_000

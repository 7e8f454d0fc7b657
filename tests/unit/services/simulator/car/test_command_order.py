"""Braking commands that are copied, overtaken or old are not taken."""

from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st

from drivemcp.bus.received import Received
from proto.decision import BrakeCommand
from services.simulator.car.brake_receiver import MAX_VALID_NS
from services.simulator.car.command_order import CommandOrder

MS = 1_000_000
COMMAND = BrakeCommand(deceleration_mps2=3.0, jerk_mps3=5.0, grant_id="g")


def sent(seq: int, stamp_ms: int, epoch: int = 1) -> Received[BrakeCommand]:
    return Received(
        message=COMMAND, key="k", id="", seq=seq, stamp_ns=stamp_ms * MS, sent_ns=0, publisher="arbiter", epoch=epoch
    )


def test_a_command_is_taken_once() -> None:
    order = CommandOrder()
    assert order.takes(sent(1, 1000), 1010 * MS)
    assert not order.takes(sent(1, 1000), 1020 * MS)
    assert order.takes(sent(2, 1100), 1110 * MS)
    assert not order.takes(sent(1, 1000), 1120 * MS)


def test_a_command_lives_from_its_stamp_on() -> None:
    assert not CommandOrder().takes(sent(1, 1000), 1000 * MS + MAX_VALID_NS + 1)
    assert not CommandOrder().takes(sent(1, 1300), 1000 * MS)


def test_an_arbiter_that_starts_again_is_heard_whatever_its_clock_says() -> None:
    order = CommandOrder()
    assert order.takes(sent(500, 9_000_000, epoch=9), 9_000_000 * MS)
    assert order.takes(sent(1, 9_000_050, epoch=10), 9_000_050 * MS)
    assert order.takes(sent(1, 1000, epoch=2), 1000 * MS), "the clock was set back"


@given(st.lists(st.tuples(st.integers(0, 30), st.integers(0, 10)), max_size=60))
def test_whatever_is_sent_again_and_whenever_no_command_is_taken_twice(replays: Sequence[tuple[int, int]]) -> None:
    order, taken, now_ms = CommandOrder(), list[int](), 0
    for index, wait in replays:
        now_ms += 10 * wait
        if order.takes(sent(index, index * 20), now_ms * MS):
            taken.append(index)
    assert len(set(taken)) == len(taken)

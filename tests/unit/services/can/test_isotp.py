"""Transport of long answers, against the simulated control units' own sender."""

import contextlib
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.can.errors import MalformedFrame
from services.can.isotp import FLOW_CONTINUE, Reassembly, single_frame
from services.simulator.ecus import EcuBank, _Transfer


@given(st.binary(min_size=8, max_size=4095))
def test_what_is_cut_into_frames_is_put_together_again(payload: bytes) -> None:
    transfer, parts = _Transfer(0x7E8, payload, 0), Reassembly()
    assert parts.feed(transfer.head) == (None, True)
    assert transfer.flow(FLOW_CONTINUE, 5)
    whole = [found for frame in transfer.due(5) if (found := parts.feed(frame.data)[0]) is not None]
    assert whole == [payload]


@given(st.binary(min_size=30, max_size=200), st.integers(1, 5), st.integers(1, 20))
def test_the_sender_keeps_block_size_and_pause(payload: bytes, block: int, pause_ms: int) -> None:
    transfer, parts, now_ns, frames = _Transfer(0x7E8, payload, 0), Reassembly(), 0, 0
    parts.feed(transfer.head)
    while transfer.rest:
        assert transfer.flow(bytes([0x30, block, pause_ms]), now_ns)
        sent = []
        for _ in range(block):
            sent += transfer.due(now_ns)
            assert len(sent) <= block
            now_ns += pause_ms * 1_000_000
        stamps = [frame.stamp_ns for frame in sent]
        assert all(later - earlier == pause_ms * 1_000_000 for earlier, later in pairwise(stamps))
        assert not transfer.due(now_ns + 10**9) or not transfer.rest
        frames += len(sent)
        whole = [parts.feed(frame.data)[0] for frame in sent][-1]
    assert whole == payload


@given(st.lists(st.binary(max_size=12), max_size=30))
def test_no_bytes_break_the_reassembly(chunks: list[bytes]) -> None:
    parts = Reassembly()
    for chunk in chunks:
        with contextlib.suppress(MalformedFrame):
            parts.feed(chunk)
    assert parts.feed(single_frame(b"\x41\x0d\x10"))[0] == b"\x41\x0d\x10"


def test_a_frame_out_of_sequence_is_refused_and_the_next_message_still_arrives() -> None:
    transfer, parts = _Transfer(0x7E8, bytes(range(30)), 0), Reassembly()
    transfer.flow(FLOW_CONTINUE, 0)
    parts.feed(transfer.head)
    second, third = transfer.due(0)[1:3]
    del second
    with pytest.raises(MalformedFrame, match="sequence"):
        parts.feed(third.data)


def test_a_tester_that_falls_silent_leaves_no_transfer_behind() -> None:
    from proto.sensors import CanFrame
    from services.simulator.car_state import CarState

    bank = EcuBank()
    ask = CanFrame(stamp_ns=0, arbitration_id=0x7E0, data=single_frame(b"\x09\x02"))
    assert len(bank.on_frame(ask, CarState(), 0)) == 1
    assert bank.step(2_000_000_000) == []
    flow = CanFrame(stamp_ns=0, arbitration_id=0x7E0, data=FLOW_CONTINUE)
    assert bank.on_frame(flow, CarState(), 2_000_000_001) == []

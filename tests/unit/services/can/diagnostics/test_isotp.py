"""Transport of long answers, against the simulated control units' own sender."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.sensors import CanFrame
from services.can.diagnostics.addresses import answer_id
from services.can.diagnostics.isotp import FLOW_FRAMES, Receiver, single_frame
from services.simulator.car.state import CarState
from services.simulator.ecus.bank import EcuBank
from services.simulator.ecus.transport import Transfer

CLEAR_TO_SEND = bytes.fromhex("300000aaaaaaaaaa")


class Asker:
    """A receiver and the flow control it sent."""

    def __init__(self, request_id: int = 0x7E0) -> None:
        self.flow: list[tuple[int, bytes]] = []
        self.receiver = Receiver(answer_id(request_id), lambda *sent: self.flow.append(sent))

    def feed(self, data: bytes) -> list[bytes]:
        return self.receiver.feed(data)


@pytest.mark.parametrize("request_id", [0x7E0, 0x18DA10F1])
@given(payload=st.binary(min_size=8, max_size=4095))
def test_what_is_cut_into_frames_is_put_together_again(request_id: int, payload: bytes) -> None:
    transfer, tester = Transfer(0x7E8, payload, 0), Asker(request_id)
    assert tester.feed(transfer.head) == []
    assert tester.flow == [(request_id, CLEAR_TO_SEND)]
    assert transfer.flow(tester.flow[0][1], 5)
    whole = [found for frame in transfer.due(5) for found in tester.feed(frame.data)]
    assert whole == [payload]
    assert not tester.receiver.receiving


@given(st.binary(min_size=30, max_size=200), st.integers(1, 5), st.integers(1, 20))
def test_the_sender_keeps_block_size_and_pause(payload: bytes, block: int, pause_ms: int) -> None:
    transfer, tester, now_ns, whole = Transfer(0x7E8, payload, 0), Asker(), 0, []
    tester.feed(transfer.head)
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
        whole += [found for frame in sent for found in tester.feed(frame.data)]
    assert whole == [payload]


@given(st.lists(st.binary(max_size=12), max_size=30))
def test_no_bytes_break_the_receiver(chunks: list[bytes]) -> None:
    tester = Asker()
    for chunk in chunks:
        tester.feed(chunk)
    assert tester.feed(single_frame(b"\x41\x0d\x10")) == [b"\x41\x0d\x10"]
    assert all(request_id == 0x7E0 and data in FLOW_FRAMES for request_id, data in tester.flow)


def test_a_frame_out_of_sequence_is_counted_and_the_next_message_still_arrives() -> None:
    transfer, tester = Transfer(0x7E8, bytes(range(30)), 0), Asker()
    transfer.flow(CLEAR_TO_SEND, 0)
    tester.feed(transfer.head)
    third = transfer.due(0)[2]
    assert tester.feed(third.data) == []
    assert tester.receiver.malformed == 1
    assert not tester.receiver.receiving
    assert tester.feed(single_frame(b"\x41\x0d\x10")) == [b"\x41\x0d\x10"]


def test_a_tester_that_falls_silent_leaves_no_transfer_behind() -> None:
    bank = EcuBank()
    ask = CanFrame(stamp_ns=0, arbitration_id=0x7E0, data=single_frame(b"\x09\x02"))
    assert len(bank.on_frame(ask, CarState(), 0)) == 1
    assert bank.step(2_000_000_000) == []
    flow = CanFrame(stamp_ns=0, arbitration_id=0x7E0, data=CLEAR_TO_SEND)
    assert bank.on_frame(flow, CarState(), 2_000_000_001) == []

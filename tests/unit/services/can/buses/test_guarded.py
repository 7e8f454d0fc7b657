"""A bus behind its policy: what leaves, what does not, and what is remembered of both."""

from collections.abc import Sequence

import pytest

from proto.sensors import CanFrame
from services.can.buses.guarded import RECORDS_LIMIT, GuardedLink, Rule, TransmitPolicy
from services.can.buses.link import OnFrames
from services.can.diagnostics import gate
from services.can.diagnostics.isotp import FLOW_FRAMES, single_frame
from services.can.errors import LinkDown, RequestRefused

RULE = Rule(check=gate.check_at_bus, purpose=gate.purpose, writes=gate.writes)
READ, CLEAR = single_frame(b"\x01\x0d"), single_frame(b"\x14\xff\xff\xff")
FLOW = sorted(FLOW_FRAMES)[0]


class Wire:
    """A bus that keeps what is sent, or is down."""

    state = "up"

    def __init__(self, *, down: bool = False) -> None:
        self.sent: list[CanFrame] = []
        self._down = down

    def listen(self, on_frames: OnFrames) -> None:
        on_frames(())

    def transmit(self, frames: Sequence[CanFrame]) -> None:
        if self._down:
            raise LinkDown("unplugged")
        self.sent.extend(frames)


def guarded(wire: Wire, *, transmit: bool = True, ids: frozenset[int] = frozenset()) -> GuardedLink:
    policy = TransmitPolicy(
        bus="can0", interface="virtual", transmit_allowed=transmit, write_services_allowed=False, allowlist=()
    )
    return GuardedLink(wire, policy, RULE, transmit=transmit, ids=ids, clock=lambda: 5_000_000_000)


def frame(arbitration_id: int, data: bytes) -> CanFrame:
    return CanFrame(stamp_ns=0, arbitration_id=arbitration_id, data=data, extended=arbitration_id > 0x7FF)


def test_what_leaves_is_remembered_with_what_it_is_for() -> None:
    link = guarded(wire := Wire())
    for each in (frame(0x7DF, READ), frame(0x7E0, FLOW), frame(0x7E0, CLEAR), frame(0x18EAFFF9, b"\x04\xf0\x00")):
        link.transmit((each,))
    records = link.records(10)
    assert [each.purpose for each in records] == [
        "request, service 0x01", "flow control", "request, service 0x14", "request for a group (J1939)",
    ]  # fmt: skip
    assert [each.write for each in records] == [False, False, True, False]
    assert all(each.sent and each.blocked_reason is None and each.timestamp == 5.0 for each in records)
    assert (records[0].arbitration_id, records[0].data) == ("0x7DF", READ.hex(" "))
    assert len(wire.sent) == 4


@pytest.mark.parametrize(
    ("link_of", "sent", "why"),
    [
        (lambda wire: guarded(wire, transmit=False), frame(0x7E0, FLOW), "transmit = true"),
        (lambda wire: guarded(wire, ids=frozenset({0x7DF})), frame(0x7E0, FLOW), "transmit_ids"),
        (guarded, frame(0x100, READ), "no diagnostic request id"),
        (guarded, frame(0x7E0, single_frame(b"\x2e\xf1\x90\x00")), "changes the vehicle"),
        (guarded, frame(0x18EAFFF9, b"\xd3\xfe\x00"), "clears trouble codes"),
    ],
)
def test_what_may_not_leave_does_not_whoever_sends_it(link_of, sent, why) -> None:  # type: ignore[no-untyped-def]
    link = link_of(wire := Wire())
    with pytest.raises(RequestRefused, match=why):
        link.transmit((sent,))
    (record,) = link.records(5)
    assert wire.sent == []
    assert not record.sent
    assert why in (record.blocked_reason or "")


def test_a_bus_that_is_down_is_a_reason_too() -> None:
    link = guarded(Wire(down=True))
    with pytest.raises(LinkDown):
        link.transmit((frame(0x7DF, READ),))
    assert link.records(1)[0].blocked_reason == "unplugged"


def test_the_memory_is_bounded_and_gives_the_newest() -> None:
    link = guarded(Wire())
    for number in range(RECORDS_LIMIT + 50):
        link.transmit((frame(0x7E0 + number % 2, READ),))
    assert len(link.records(RECORDS_LIMIT + 50)) == RECORDS_LIMIT
    assert [each.arbitration_id for each in link.records(2)] == ["0x7E0", "0x7E1"]

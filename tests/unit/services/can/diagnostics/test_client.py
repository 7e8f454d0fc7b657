"""Asking control units: who is awaited, which answer belongs to which question, and how long is waited."""

import threading
import time
from collections.abc import Sequence

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proto.sensors import CanFrame
from services.can.diagnostics import gate
from services.can.diagnostics.addresses import ANSWER_IDS, REQUEST_IDS, is_extended
from services.can.diagnostics.client import Diagnostics, Reply
from services.can.diagnostics.exchange import OWED_S, Exchange
from services.can.diagnostics.isotp import FLOW_FRAMES, single_frame
from services.can.errors import RequestRefused

ECUS = (0x7E0, 0x7E1)
CODES = b"\x03"
SPEED = b"\x01\x0d"


def frame(arbitration_id: int, payload: bytes) -> CanFrame:
    extended = is_extended(arbitration_id)
    return CanFrame(stamp_ns=0, arbitration_id=arbitration_id, data=single_frame(payload), extended=extended)


class Units:
    """The other end: after each request the frames that its script has for it; from its first pause on, on a thread of their own."""

    def __init__(
        self, *script: Sequence[CanFrame | float], ecus: tuple[int, ...] = ECUS, owed_s: float = OWED_S
    ) -> None:
        self.script, self.sent = list(script), list[tuple[int, bytes]]()
        self.diagnostics = Diagnostics(self.send, ecus, owed_s=owed_s)

    def send(self, arbitration_id: int, data: bytes) -> None:
        self.sent.append((arbitration_id, data))
        if data not in FLOW_FRAMES and self.script:
            frames = self.script.pop(0)
            at_once = next((at for at, each in enumerate(frames) if isinstance(each, float)), len(frames))
            self._answer(frames[:at_once])
            if frames[at_once:]:
                threading.Thread(target=self._answer, args=(frames[at_once:],)).start()

    def _answer(self, frames: Sequence[CanFrame | float]) -> None:
        pause = threading.Event()
        for each in frames:
            if isinstance(each, CanFrame):
                self.diagnostics.on_frame(each)
            else:
                pause.wait(each)

    def ask(self, payload: bytes, to: int | None = None, timeout_s: float = 2.0) -> Reply:
        return self.diagnostics.ask(payload, to, timeout_s=timeout_s)


def test_a_question_to_everybody_ends_with_the_last_listed_answer() -> None:
    units = Units([frame(0x7E9, b"\x43\x00"), frame(0x7E8, b"\x43\x00")])
    assert units.ask(CODES) == Reply({0x7E8: b"\x43\x00", 0x7E9: b"\x43\x00"}, "answered")


def test_where_only_one_answers_that_is_learned_and_then_it_is_not_waited_for_the_other() -> None:
    speed = [frame(0x7E8, b"\x41\x0d\x30")]
    units = Units(speed, speed, speed, speed)
    assert [units.ask(SPEED).ended for _ in range(4)] == ["quiet", "quiet", "answered", "answered"]


def test_a_unit_that_does_not_have_what_was_asked_is_not_missed_until_it_had_it() -> None:
    both, one = [frame(0x7E9, b"\x41\x0d\x31"), frame(0x7E8, b"\x41\x0d\x30")], [frame(0x7E8, b"\x41\x0d\x30")]
    units = Units(one, ecus=(0x7E0, 0x7E1))
    assert units.ask(SPEED).missing == ()
    units = Units(both, both, one, ecus=(0x7E0, 0x7E1, 0x7E2))
    assert [units.ask(SPEED).missing for _ in range(3)] == [(), (), (0x7E9,)]


def test_a_unit_that_falls_silent_is_missed_in_a_list_of_codes_also_when_that_was_learned() -> None:
    codes = [frame(0x7E8, b"\x43\x00")]
    units = Units(codes, codes, codes)
    assert [units.ask(CODES).missing for _ in range(3)] == [(0x7E9,)] * 3


def test_a_unit_that_comes_back_late_is_waited_for_again() -> None:
    speed, other = frame(0x7E8, b"\x41\x0d\x30"), frame(0x7E9, b"\x41\x0d\x31")
    units = Units([speed], [speed], [speed], [speed, other])
    assert [units.ask(SPEED).ended for _ in range(3)][-1] == "answered"
    units.diagnostics.on_frame(other)
    reply = units.ask(SPEED)
    assert reply.answers.keys() == {0x7E8, 0x7E9}
    assert reply.ended == "quiet", "it was waited for, though the first was there"


def test_a_unit_that_is_known_to_answer_gets_longer_than_an_unknown_one() -> None:
    other = frame(0x7E9, b"\x43\x00")
    units = Units([frame(0x7E8, b"\x43\x00"), 0.2, other], owed_s=30.0)
    assert units.ask(CODES, timeout_s=30.0).answers.keys() == {0x7E8, 0x7E9}


def test_a_unit_that_no_profile_lists_is_heard() -> None:
    units = Units([frame(0x7EF, b"\x43\x00"), frame(0x7E8, b"\x43\x00"), frame(0x7E9, b"\x43\x00")])
    assert units.ask(CODES).answers.keys() == {0x7E8, 0x7E9, 0x7EF}


def test_a_car_whose_units_have_29_bits_is_asked_by_29_bits() -> None:
    units = Units([frame(0x18DAF110, b"\x41\x0d\x30")], ecus=(0x18DA10F1,))
    assert units.ask(SPEED).answers == {0x18DAF110: b"\x41\x0d\x30"}
    assert units.sent == [(0x18DB33F1, single_frame(SPEED))]


def test_a_short_id_in_a_long_frame_is_no_answer() -> None:
    forged = CanFrame(stamp_ns=0, arbitration_id=0x7E8, data=single_frame(b"\x41\x0d\x01"), extended=True)
    units = Units([forged, frame(0x7E8, b"\x41\x0d\x30")])
    assert units.ask(SPEED, 0x7E0).answers == {0x7E8: b"\x41\x0d\x30"}


def test_an_answer_that_follows_later_is_waited_for_beyond_the_timeout() -> None:
    pending = frame(0x7E8, b"\x7f\x01\x78")
    units = Units([pending, 0.15, pending, 0.15, frame(0x7E8, b"\x41\x0d\x30")])
    assert units.ask(SPEED, 0x7E0, timeout_s=0.1) == Reply({0x7E8: b"\x41\x0d\x30"}, "answered")


def test_a_unit_that_asks_for_patience_for_ever_is_given_up() -> None:
    now = [0.0]
    exchange = Exchange(SPEED, frozenset({0x7E8}), frozenset({0x7E8}), clock=lambda: now[0])
    for _ in range(1000):
        now[0] += 0.1
        exchange.offer(0x7E8, b"\x7f\x01\x78")
    assert exchange.wait(1.0) == "timeout"


def test_answers_of_others_and_to_other_questions_are_not_taken() -> None:
    others = [frame(0x7E8, b"\x41\x0c\x01\x02"), frame(0x123, b"\x41\x0d\x01"), frame(0x7E9, b"\x42\x0d\x00\x01")]
    units = Units([*others, frame(0x7E8, b"\x7f\x03\x31"), frame(0x7E8, b"\x41\x0d\x30")])
    assert units.ask(SPEED, 0x7E0).answers == {0x7E8: b"\x41\x0d\x30"}
    assert all(data not in FLOW_FRAMES for _, data in units.sent)


def test_a_long_answer_to_somebody_else_gets_no_flow_control() -> None:
    foreign = CanFrame(stamp_ns=0, arbitration_id=0x7E8, data=bytes.fromhex("1014490201414141"))
    units = Units([foreign, frame(0x7E8, b"\x41\x0d\x30")])
    units.ask(SPEED, 0x7E0)
    assert [data for _, data in units.sent] == [single_frame(SPEED)]


LONG = b"\x49\x04\x01" + b"DRIVEMCP-SIM-001"
PARTS = [bytes([0x10, len(LONG)]) + LONG[:6], b"\x21" + LONG[6:13], b"\x22" + LONG[13:]]


def parts(*numbers: int) -> list[CanFrame | float]:
    return [CanFrame(stamp_ns=0, arbitration_id=0x7E8, data=PARTS[number]) for number in numbers]


@pytest.mark.parametrize("broken", [(0, 2), (0, 1, 1), (0, 2, 1)])
def test_an_answer_with_a_lost_or_doubled_part_is_asked_for_again(broken: tuple[int, ...]) -> None:
    units = Units(parts(*broken), parts(0, 1, 2))
    assert units.ask(b"\x09\x04", 0x7E0).answers == {0x7E8: LONG}
    assert units.diagnostics.malformed >= 1


def test_a_unit_that_hangs_in_the_middle_does_not_hold_the_others_up_for_long() -> None:
    units = Units(
        [frame(0x7E9, b"\x43\x00"), CanFrame(stamp_ns=0, arbitration_id=0x7E8, data=bytes.fromhex("100a430403000301"))]
    )
    started = time.monotonic()
    reply = units.ask(CODES, timeout_s=0.3)
    assert reply.answers == {0x7E9: b"\x43\x00"}
    assert reply.missing == (0x7E8,)
    assert time.monotonic() - started < 4.0


def test_silence_ends_at_the_timeout_and_says_so() -> None:
    assert Units([]).ask(CODES, timeout_s=0.05) == Reply({}, "timeout", (0x7E8, 0x7E9))


def test_the_line_is_held_by_one_request_at_a_time() -> None:
    units = Units()
    exchange = units.diagnostics.start(CODES)
    assert exchange is not None
    assert units.diagnostics.start(b"\x07") is None
    with pytest.raises(TimeoutError):
        units.ask(CODES, timeout_s=0.05)
    units.diagnostics.finish(exchange)
    assert units.diagnostics.start(b"\x07") is not None


def test_a_refused_request_frees_the_line() -> None:
    units = Units([frame(0x7E8, b"\x43\x00"), frame(0x7E9, b"\x43\x00")])
    for payload in (b"\x04", b"", bytes(8), b"\x2e\xf1\x90\x00"):
        with pytest.raises(RequestRefused):
            units.ask(payload)
    assert units.ask(CODES).ended == "answered"
    assert [data[1] for _, data in units.sent] == [0x03]


PAYLOADS = st.one_of(
    st.binary(max_size=9),
    st.tuples(st.sampled_from(sorted(gate.READING)), st.binary(max_size=6)).map(
        lambda pair: bytes([pair[0]]) + pair[1]
    ),
)
HEARD = st.lists(
    st.tuples(st.one_of(st.integers(0, 0x1FFFFFFF), st.sampled_from(sorted(ANSWER_IDS))), st.binary(max_size=8)),
    max_size=8,
)
TO = st.one_of(st.none(), st.integers(0, 0x1FFFFFFF), st.sampled_from(sorted(REQUEST_IDS)))
ALLOWED = st.sampled_from([gate.NOTHING, frozenset({0x04}), frozenset({0x11}), frozenset({0x14})])


@settings(max_examples=150, deadline=None)
@given(
    st.lists(st.tuples(PAYLOADS, TO, ALLOWED, HEARD), min_size=1, max_size=4), st.sampled_from([ECUS, (0x18DA10F1,)])
)
def test_whatever_is_asked_and_heard_nothing_leaves_that_is_not_whitelisted(
    calls: list[tuple[bytes, int | None, frozenset[int], list[tuple[int, bytes]]]], ecus: tuple[int, ...]
) -> None:
    sent: list[tuple[int, bytes, frozenset[int]]] = []
    now: frozenset[int] = gate.NOTHING
    heard: list[tuple[int, bytes]] = []

    def send(arbitration_id: int, data: bytes) -> None:
        sent.append((arbitration_id, data, now))
        while heard:
            arbitration, answer = heard.pop()
            diagnostics.on_frame(
                CanFrame(stamp_ns=0, arbitration_id=arbitration, data=answer, extended=is_extended(arbitration))
            )

    diagnostics = Diagnostics(send, ecus, gate.Pace(rate_per_s=1e6, burst=1e6))
    for payload, to, now, heard in calls:  # noqa: B007 - `send` reads both
        try:
            diagnostics.ask(payload, to, timeout_s=0.0, allowed=now)
        except RequestRefused:
            continue
    for arbitration_id, data, allowed in sent:
        assert arbitration_id in REQUEST_IDS
        assert data in FLOW_FRAMES or data[1] in gate.READING | allowed

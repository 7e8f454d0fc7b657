"""J1939: ids, transport, faults and requests; by numbers worked out by hand from the standard's tables."""

import itertools
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.node import Node
from drivemcp.testing import TestBus, bus
from proto import topics
from proto.sensors import CanFrame, CanFrames
from services.can.diagnostics import gate
from services.can.errors import MalformedFrame, RequestRefused
from services.can.j1939 import messages
from services.can.j1939.messages import SpnFault, header, id_of
from services.can.j1939.transport import BAM, CONNECTION, DATA, GAP_NS, RTS, SESSIONS_LIMIT, Transport
from services.can.service import SERVICE, CanConfig

MS = 1_000_000
ENGINE, BRAKES, TOOL = 0x00, 0x0B, 0xF9

Frame = tuple[int, bytes]


@pytest.mark.parametrize(
    ("arbitration_id", "expected"),
    [
        (0x0CF00400, (3, 61444, 255, 0x00)),  # EEC1 from the engine
        (0x18FEF100, (6, 65265, 255, 0x00)),  # CCVS
        (0x18EAFFF9, (6, 59904, 255, 0xF9)),  # a request to all from the tool
        (0x18EA00F9, (6, 59904, 0x00, 0xF9)),  # a request to the engine
        (0x1CECFF0B, (7, 60416, 255, 0x0B)),  # BAM from the brakes
        (0x19F00A03, (6, 0x1F00A, 255, 0x03)),  # data page 1
    ],
)
def test_an_id_says_priority_group_destination_and_source(arbitration_id: int, expected: tuple[int, ...]) -> None:
    assert header(arbitration_id) == expected
    priority, pgn, destination, source = expected
    assert id_of(pgn, source, destination, priority) == arbitration_id


@given(st.integers(0, (1 << 29) - 1))
def test_every_id_is_read_and_made_again(arbitration_id: int) -> None:
    head = header(arbitration_id)
    assert id_of(head.pgn, head.source, head.destination, head.priority) == arbitration_id


def pieces(pgn: int, payload: bytes, source: int, destination: int = messages.GLOBAL) -> list[Frame]:
    """A message in pieces, as its sender sends it."""
    count = -(-len(payload) // 7)
    kind = BAM if destination == messages.GLOBAL else RTS
    begin = bytes([kind]) + len(payload).to_bytes(2, "little") + bytes([count, 0xFF]) + pgn.to_bytes(3, "little")
    padded = payload.ljust(count * 7, b"\xff")
    rows = [bytes([number + 1]) + padded[number * 7 : number * 7 + 7] for number in range(count)]
    return [
        (id_of(CONNECTION, source, destination, 7), begin),
        *((id_of(DATA, source, destination, 7), row) for row in rows),
    ]


sent_messages = st.lists(
    st.tuples(st.integers(0, 255), st.sampled_from([255, 3, 0xF9]), st.binary(min_size=9, max_size=1785)),
    min_size=1,
    max_size=6,
    unique_by=lambda each: each[:2],
)


@settings(max_examples=60, deadline=None)
@given(sent=sent_messages, order=st.randoms(use_true_random=False))
def test_messages_of_interleaved_senders_arrive_whole(sent: list[tuple[int, int, bytes]], order: Any) -> None:
    queues = [pieces(65226, payload, source, destination) for source, destination, payload in sent]
    transport, found, stamp_ns = Transport(), {}, 0
    while any(queues):
        frame_id, data = order.choice([queue for queue in queues if queue]).pop(0)
        stamp_ns += MS
        if group := transport.feed(frame_id, data, stamp_ns):
            found[group.header.source, group.header.destination] = group.data
            assert group.header.pgn == 65226
    assert found == {(source, destination): payload for source, destination, payload in sent}
    assert transport.malformed == 0


control = st.builds(
    bytes.__add__, st.sampled_from([b"\x10", b"\x11", b"\x20", b"\xff", b"\x01"]), st.binary(min_size=7, max_size=7)
)
transport_ids = st.builds(id_of, st.sampled_from([CONNECTION, DATA]), st.integers(0, 3), st.sampled_from([255, 1]))
any_frame = st.tuples(
    st.one_of(st.integers(0, (1 << 29) - 1), transport_ids), st.one_of(st.binary(max_size=64), control)
)


@settings(max_examples=100, deadline=None)
@given(frames=st.lists(any_frame, max_size=200))
def test_no_frames_break_the_transport_or_make_it_grow(frames: list[Frame]) -> None:
    transport = Transport()
    for number, (frame_id, data) in enumerate(frames):
        group = transport.feed(frame_id, data, number * MS)
        assert group is None or len(group.data) <= 1785
    for source, destination in itertools.product(range(256), range(4)):
        transport.feed(*pieces(65226, bytes(20), source, destination)[0], 0)
    assert len(transport._sessions) <= SESSIONS_LIMIT


@pytest.mark.parametrize("missing", [1, 2, 3])
def test_a_broadcast_with_a_lost_packet_is_dropped_and_counted(missing: int) -> None:
    transport = Transport()
    frames = pieces(65226, bytes(21), ENGINE)
    del frames[missing]
    assert [transport.feed(*frame, 0) for frame in frames] == [None] * 3
    assert transport.malformed == (1 if missing < 3 else 0)
    assert [transport.feed(*frame, 0) for frame in pieces(65226, b"x" * 21, ENGINE)][-1].data == b"x" * 21  # type: ignore[union-attr]


def test_to_one_receiver_lost_packets_may_come_again_and_an_abort_ends_it() -> None:
    transport = Transport()
    begin, first, second, third = pieces(65226, bytes(range(21)), ENGINE, TOOL)
    for frame in (begin, first, third, first):
        assert transport.feed(*frame, 0) is None
    assert transport.feed(*second, 0).data == bytes(range(21))  # type: ignore[union-attr]
    transport.feed(*begin, 0)
    transport.feed(id_of(CONNECTION, TOOL, ENGINE), bytes([255, 1, 255, 255, 255, 0xCA, 0xFE, 0]), 0)
    assert [transport.feed(*frame, 0) for frame in (first, second, third)] == [None] * 3


def test_packets_that_come_too_late_belong_to_nothing() -> None:
    transport = Transport()
    begin, first, second = pieces(65226, bytes(10), ENGINE)
    transport.feed(*begin, 0)
    transport.feed(*first, 0)
    assert transport.feed(*second, GAP_NS + 1) is None
    assert transport.malformed == 1


def test_dm1_in_numbers() -> None:
    # amber lamp on; SPN 0x7FFFF would be all ones: here 100 (oil pressure), FMI 1, once; and 520192 = 0x7F000, FMI 31
    data = bytes([0b00_00_01_00, 0b11_11_11_11, 100, 0, 1, 1, 0x00, 0xF0, 0xFF, 0x7F])
    told = messages.dm1(data)
    assert told.lamps == {"malfunction": "off", "red_stop": "off", "amber_warning": "on", "protect": "off"}
    assert told.flashing == ()
    assert told.faults == (
        SpnFault(spn=100, fmi=1, occurrences=1),
        SpnFault(spn=0x7F000, fmi=31, occurrences=None),
    )
    assert messages.dm1(bytes([0x40, 0x00, 0, 0, 0, 0, 0xFF, 0xFF])).faults == ()
    assert messages.dm1(bytes([0x40, 0x3F, 0, 0, 0, 0, 0xFF, 0xFF])).flashing == ("malfunction",)


@given(st.binary(max_size=1785))
def test_any_bytes_are_a_dm1_or_are_refused(data: bytes) -> None:
    try:
        told = messages.dm1(data)
    except MalformedFrame:
        return
    assert all(0 <= fault.spn < 1 << 19 and 0 <= fault.fmi < 32 for fault in told.faults)


@given(st.integers(0, (1 << 29) - 1), st.binary(max_size=8))
def test_only_a_request_for_a_reading_group_leaves(arbitration_id: int, data: bytes) -> None:
    try:
        gate.check_j1939_request(arbitration_id, data)
    except RequestRefused:
        return
    assert header(arbitration_id).pgn == messages.REQUEST
    assert int.from_bytes(data, "little") not in (65228, 65235)


PGNS = st.integers(0, 0x3FFFF)


@given(PGNS)
def test_a_group_that_clears_or_is_the_makers_own_is_never_asked_for(pgn: int) -> None:
    refused = pgn in (65228, 65235) or pgn & 0xFF00 in (0xEF00, 0xFF00) or (pgn & 0xFF00 < 0xF000 and pgn & 0xFF > 0)
    try:
        gate.check_j1939_request(id_of(messages.REQUEST, TOOL), messages.request_data(pgn))
    except RequestRefused:
        assert refused
    else:
        assert not refused


DBC = """VERSION ""
BU_: ECU
BO_ 2566844672 CCVS: 8 ECU
 SG_ WheelBasedVehicleSpeed : 8|16@1+ (0.00390625,0) [0|250.996] "km/h" ECU
BO_ 2566832128 Long: 20 ECU
 SG_ Far : 144|8@1+ (1,0) [0|255] "" ECU
BA_DEF_ BO_ "VFrameFormat" ENUM "StandardCAN","ExtendedCAN","reserved","J1939PG";
BA_DEF_DEF_ "VFrameFormat" "J1939PG";
BA_ "VFrameFormat" BO_ 2566844672 3;
BA_ "VFrameFormat" BO_ 2566832128 3;
"""


class Truck:
    """A bus with an engine and brakes: what it sends by itself, and what it answers."""

    def __init__(self, node: Node) -> None:
        self.node = node
        self.asked: list[CanFrame] = []
        self.answers: dict[int, list[Frame]] = {}
        node.subscribe(topics.CAN_TX, self._on_tx, id="drive")

    def _on_tx(self, message: CanFrames, _: Any) -> None:
        for frame in message.frames:
            self.asked.append(frame)
            self.send(self.answers.get(int.from_bytes(frame.data, "little"), []))

    def send(self, frames: list[Frame]) -> None:
        now_ns = self.node.clock.now_ns()
        rows = [CanFrame(stamp_ns=now_ns, arbitration_id=i, data=d, extended=True) for i, d in frames]
        self.node.publish(topics.CAN_RX, CanFrames(frames=tuple(rows)), id="drive")


@pytest.fixture
def profile(tmp_path: Path) -> str:
    (tmp_path / "truck.dbc").write_text(DBC)
    path = tmp_path / "profile.toml"
    path.write_text(
        'name = "truck"\n[buses.drive]\ndescription = "truck.dbc"\nprotocol = "j1939"\n'
        "[vehicle]\ntyre_nominal_bar = [8.0, 8.0, 8.0, 8.0]\n[fields]\n"
        'speed_mps = { vss = "Vehicle.Speed", signal = "WheelBasedVehicleSpeed", unit = "m/s", maximum = 40.0, max_age_s = 60.0 }\n'
    )
    return str(path)


def start(b: TestBus, profile: str, *, raw_access: bool = True) -> Truck:
    from services.can.buses.opening import BusConfig

    b.start(
        SERVICE, CanConfig(profile=profile, buses=(BusConfig(name="drive"),), poll_dtcs_s=0.0, raw_access=raw_access)
    )
    return Truck(b.node("truck"))


def result(b: TestBus, tool: str, **arguments: Any) -> Any:
    outcome = b.call(tool, arguments)
    assert outcome.ok, outcome
    return outcome.result


def test_a_truck_tells_its_speed_whoever_sends_it_and_its_faults(profile: str) -> None:
    faults = bytes([0x04, 0xFF, 100, 0, 1, 1, 0x6E, 0, 0, 2])
    with bus() as b:
        truck = start(b, profile)
        egos = b.collect(topics.EGO)
        truck.send([(id_of(65265, ENGINE), bytes([0, 0, 71, 0, 0, 0, 0, 0])), *pieces(65226, faults, ENGINE)])
        truck.send([(id_of(65226, BRAKES), bytes([0, 0xFF, 0, 0, 0, 0, 0xFF, 0xFF]))])
        truck.send([(id_of(65265, ENGINE), bytes([0, 0, 72, 0, 0, 0, 0, 0]))])
        # Frames are read in order: once the last one counts, the faults before it are known.
        egos.wait(lambda ego: ego.speed_mps == pytest.approx(72 / 3.6))
        report = result(b, "read_j1939_dtcs", duration_s=60.0)
        rows = result(b, "list_j1939_pgns")["result"]
        frame = result(b, "decode_j1939_frame", arbitration_id="0x18FEF131", data=[0, 0, 36, 0, 0, 0, 0, 0])
    assert [unit["source"] for unit in report["units"]] == [ENGINE, BRAKES]
    assert report["units"][0]["lamps"]["amber_warning"] == "on"
    assert [(each["spn"], each["fmi"], each["occurrences"]) for each in report["units"][0]["faults"]] == [
        (100, 1, 1),
        (110, 0, 2),
    ]
    assert report["units"][1]["faults"] == []
    assert [(row["pgn"], row.get("name"), row["sources"], row["length"]) for row in rows] == [
        (65226, None, [ENGINE, BRAKES], 8),
        (65265, "CCVS", [ENGINE], 8),
    ]
    assert (frame["pgn"], frame["source"], frame["signals"]["WheelBasedVehicleSpeed"]) == (65265, 0x31, 36)


def test_a_request_returns_what_every_unit_answers(profile: str) -> None:
    with bus() as b:
        truck = start(b, profile)
        truck.answers[65217] = [
            *pieces(65217, b"HELLO TRUCK*", ENGINE),
            (id_of(messages.ACKNOWLEDGEMENT, BRAKES), bytes([1, 255, 255, 255, 255]) + messages.request_data(65217)),
            (id_of(65265, ENGINE), bytes(8)),
        ]
        answer = result(b, "request_j1939_pgn", pgn=65217, timeout_s=5.0)
        silent = result(b, "request_j1939_pgn", pgn=65260, timeout_s=0.2)
        refused = result(b, "request_j1939_pgn", pgn=65235)
    assert answer["status"] == "ok"
    by_source = {each["source"]: each for each in answer["responses"]}
    assert bytes(by_source[ENGINE]["data"]) == b"HELLO TRUCK*"
    assert by_source[BRAKES]["refusal"] == "refused"
    assert (silent["status"], silent["message"]) == ("timeout", "no unit answered within 0.2 s")
    assert (refused["status"], "clears trouble codes" in refused["message"]) == ("refused", True)
    assert [frame.arbitration_id for frame in truck.asked] == [0x18EAFFF9, 0x18EAFFF9]


def test_an_acknowledgement_without_bytes_breaks_nothing(profile: str) -> None:
    with bus() as b:
        truck = start(b, profile)
        truck.answers[messages.ACKNOWLEDGEMENT] = [(id_of(messages.ACKNOWLEDGEMENT, BRAKES), b"")]
        answer = result(b, "request_j1939_pgn", pgn=messages.ACKNOWLEDGEMENT, timeout_s=5.0)
    assert answer["responses"] == [{"source": BRAKES, "data": []}]


def test_without_raw_access_only_curated_signals_are_told_and_the_vin_is_hashed(profile: str) -> None:
    vin = b"1FUJGLDR0CSBP0000"
    with bus() as b:
        truck = start(b, profile, raw_access=False)
        truck.answers = {
            65260: pieces(65260, vin + b"*", ENGINE),
            65217: pieces(65217, b"HELLO TRUCK*", ENGINE),
            65265: [(id_of(65265, ENGINE), bytes([0, 0, 72, 0, 0, 0, 0, 0]))],
        }
        number, secret, speed = (result(b, "request_j1939_pgn", pgn=pgn)["responses"][0] for pgn in truck.answers)
    assert number["vin"].startswith("sha256-salted:")
    assert number["data"] == secret["data"] == speed["data"] == []
    assert speed["signals"] == {"WheelBasedVehicleSpeed": 72}
    assert "HELLO" not in str(secret)


def test_a_car_without_j1939_says_so() -> None:
    with bus() as b:
        b.start(SERVICE, CanConfig())
        outcome = b.call("list_j1939_pgns", {})
    assert '[field: bus] [do: set protocol = "j1939" for a bus in the vehicle profile]' in outcome.error

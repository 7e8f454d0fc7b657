"""What a described message may do to the fields that it feeds."""

import itertools
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proto.sensors import CanFrame
from services.can.errors import ProfileError
from services.can.profiles.dbc import Dbc, pgn_of
from services.can.profiles.profile import Profile
from services.can.signals.board import Board

MS = 1_000_000
START = 10_000 * MS

HEAD = 'VERSION "1"\nNS_ :\n\tBA_DEF_\nBS_:\nBU_: A\n'
GUARDED = f"""{HEAD}
BO_ 256 Motion: 8 A
 SG_ Sum : 0|8@1+ (1,0) [0|0] "" A
 SG_ Count : 8|4@1+ (1,0) [0|0] "" A
 SG_ Speed : 16|16@1+ (0.01,0) [0|0] "m/s" A
 SG_ Wheel : 39|16@0- (0.01,0) [0|0] "m/s" A

BA_DEF_ SG_ "GenSigFuncType" ENUM "NoFunction","CHK","CNTR";
BA_DEF_ BO_ "ChecksumKind" STRING ;
BA_DEF_ BO_ "DataIds" STRING ;
BA_DEF_DEF_ "GenSigFuncType" "NoFunction";
BA_DEF_DEF_ "ChecksumKind" "";
BA_DEF_DEF_ "DataIds" "";
BA_ "GenSigFuncType" SG_ 256 Sum 1;
BA_ "GenSigFuncType" SG_ 256 Count 2;
BA_ "ChecksumKind" BO_ 256 "e2e-p1-both";
BA_ "DataIds" BO_ 256 "0x123";
"""
SPEED = {"signal": "Speed", "maximum": 80.0}
WHEEL = {"signal": "Wheel", "minimum": -80.0, "maximum": 80.0}


def described(tmp_path: Path, text: str, name: str = "car.dbc", **options: Any) -> Dbc:
    (tmp_path / name).write_text(text, encoding="utf-8")
    return Dbc(tmp_path / name, **options)


def profile(fields: dict[str, Any], messages: dict[str, Any] | None = None, **buses: Any) -> Profile:
    return msgspec.convert(
        {
            "name": "test",
            "buses": buses or {"can0": {"description": "car.dbc"}},
            "vehicle": {"tyre_nominal_bar": (2, 2, 2, 2)},
            "fields": fields,
            "messages": messages or {},
        },
        Profile,
    )


def frames(payloads: Iterable[bytes], arbitration_id: int = 256, *, extended: bool = False) -> list[CanFrame]:
    return [
        CanFrame(stamp_ns=START + n * 20 * MS, arbitration_id=arbitration_id, data=data, extended=extended)
        for n, data in enumerate(payloads)
    ]


def feed(board: Board, payloads: Iterable[bytes], arbitration_id: int = 256, *, extended: bool = False) -> int:
    """Feed, and give the time of the last."""
    sent = frames(payloads, arbitration_id, extended=extended)
    board.ingest(sent, sent[-1].stamp_ns)
    return sent[-1].stamp_ns


@pytest.fixture(scope="session")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Dbc:
    return described(tmp_path_factory.mktemp("dbc"), GUARDED)


@pytest.fixture(scope="session")
def guarded_profile() -> Profile:
    return profile({"speed_mps": SPEED, "wheel_fl_mps": WHEEL})


def sealed(count: int, speed: float = 20.0, wheel: float = 20.0) -> bytes:
    """A frame with its checksum: AUTOSAR profile 1, data id 0x123 in both bytes (CRC-8, 0x1D, from 0)."""
    speed_raw, wheel_raw = round(speed * 100), round(wheel * 100)
    body = bytes([count]) + speed_raw.to_bytes(2, "little") + wheel_raw.to_bytes(2, "big", signed=True) + bytes(2)
    crc = 0
    for each in b"\x23\x01" + body:
        crc ^= each
        for _ in range(8):
            crc = (crc << 1 ^ 0x1D if crc & 0x80 else crc << 1) & 0xFF
    return bytes([crc]) + body


def test_a_described_checksum_and_counter_are_kept_without_a_word_in_the_profile(
    guarded: Dbc, guarded_profile: Profile
) -> None:
    board = Board({"can0": guarded}, guarded_profile)
    now = feed(board, [sealed(n % 15) for n in range(40)])
    assert board.read("speed_mps", now) == (20.0, now, "")
    now = feed(board, [sealed(n % 15)[:-1] + b"\x01" for n in range(3)], 256) + 40 * 20 * MS
    board.ingest([CanFrame(stamp_ns=now, arbitration_id=256, data=bytes(8))], now)
    assert board.read("speed_mps", now) == (None, now, "wrong checksum")


@settings(max_examples=300, deadline=None)
@given(bit=st.integers(0, 63), count=st.integers(0, 14), speed=st.floats(0, 80), wheel=st.floats(-80, 80))
def test_a_flipped_bit_in_a_guarded_frame_changes_no_value_but_to_unknown(
    guarded: Dbc, guarded_profile: Profile, bit: int, count: int, speed: float, wheel: float
) -> None:
    board = Board({"can0": guarded}, guarded_profile)
    good = sealed((count + 1) % 15, speed, wheel)
    broken = (int.from_bytes(good, "big") ^ 1 << bit).to_bytes(8, "big")
    now = feed(board, [sealed(count), broken])
    for name in guarded_profile.fields:
        assert board.read(name, now) == (None, now, "wrong checksum")


def test_a_counter_that_repeats_says_nothing_new_and_at_last_nothing_at_all(
    guarded: Dbc, guarded_profile: Profile
) -> None:
    board = Board({"can0": guarded}, guarded_profile)
    now = feed(board, [sealed(1), sealed(1, speed=30.0)])
    assert board.read("speed_mps", now).value == 20.0
    now = feed(board, [sealed(1, speed=30.0)] * 5) + 100 * MS
    assert board.read("speed_mps", now).reason == "sender repeats itself"


@pytest.mark.parametrize(("step", "reason"), [(1, ""), (6, ""), (7, "counter jumped"), (13, "counter jumped")])
def test_a_counter_that_jumps_too_far_makes_the_sample_unknown_and_the_next_one_counts_again(
    guarded: Dbc, guarded_profile: Profile, step: int, reason: str
) -> None:
    board = Board({"can0": guarded}, guarded_profile)
    now = feed(board, [sealed(0), sealed(step)])
    assert board.read("speed_mps", now).reason == reason
    now = feed(board, [sealed(0), sealed(step), sealed((step + 1) % 15)])
    assert board.read("speed_mps", now).reason == ""


PAYLOADS = st.lists(
    st.builds(sealed, st.integers(0, 15), st.floats(0, 655), st.floats(-320, 320)) | st.binary(max_size=12),
    min_size=1,
    max_size=40,
)


@settings(max_examples=200, deadline=None)
@given(payloads=PAYLOADS, order=st.randoms(use_true_random=False))
def test_no_sequence_of_frames_publishes_a_value_out_of_range(
    guarded: Dbc, guarded_profile: Profile, payloads: list[bytes], order: Any
) -> None:
    board, sent = Board({"can0": guarded}, guarded_profile), frames(payloads)
    order.shuffle(sent)
    for frame in sent:
        board.ingest([frame, frame], frame.stamp_ns)
        for name, rule in guarded_profile.fields.items():
            value = board.read(name, frame.stamp_ns).value
            assert value is None or rule.minimum <= value <= rule.maximum


def test_the_profile_names_another_checksum_than_the_description(guarded: Dbc) -> None:
    other = {"Motion": {"checksum": {"signal": "Sum", "kind": "xor"}}}
    board = Board({"can0": guarded}, profile({"speed_mps": SPEED}, other))
    now = feed(board, [sealed(1)])
    assert board.read("speed_mps", now).reason == "wrong checksum"
    body = sealed(2)[1:]
    total = 0
    for each in body:
        total ^= each
    now = feed(board, [bytes([total]) + body])
    assert board.read("speed_mps", now).value == 20.0


def test_longer_frames_are_read_to_the_described_length_and_shorter_ones_make_unknown(
    guarded: Dbc, guarded_profile: Profile
) -> None:
    board = Board({"can0": guarded}, guarded_profile)
    now = feed(board, [sealed(1) + b"\xaa" * 4])
    assert board.read("speed_mps", now).value == 20.0
    now = feed(board, [sealed(1), sealed(2)[:5]])
    assert board.read("speed_mps", now) == (None, now, "frame too short")
    assert board.malformed == 1


PLAIN = f"""{HEAD}
BO_ 3 Mixed: 8 A
 SG_ Which M : 0|8@1+ (1,0) [0|0] "" A
 SG_ Speed m1 : 8|8@1+ (1,0) [0|0] "m/s" A
 SG_ Stage m2 : 8|4@1+ (1,0) [0|0] "" A
 SG_ Real : 32|32@1- (1,0) [0|0] "m/s2" A

BO_ 2147483651 Wide: 8 A
 SG_ Warmth : 0|8@1+ (1,-40) [0|0] "degC" A

SIG_VALTYPE_ 3 Real : 1;
VAL_ 3 Stage 0 "off" 1 "slow" 15 "Signal not available" ;
"""
FIELDS = {
    "speed_mps": {**SPEED, "max_age_s": 1.0},
    "wiper_stage": {"signal": "Stage", "maximum": 15.0, "otherwise": 3.0, "values": {"off": 0.0, "slow": 1.0}},
    "acceleration_mps2": {"signal": "Real", "minimum": -20.0, "maximum": 20.0},
    "outside_temperature_c": {"signal": "Warmth", "minimum": -40.0, "maximum": 215.0},
}


def test_a_multiplexed_signal_is_fed_only_by_the_frames_that_carry_it(tmp_path: Path) -> None:
    board = Board({"can0": described(tmp_path, PLAIN)}, profile(FIELDS))
    now = feed(board, [b"\x01\x14" + bytes(6), b"\x02\x01" + bytes(6), b"\x07\x63" + bytes(6)], 3)
    assert (board.read("speed_mps", now).value, board.read("wiper_stage", now).value) == (20.0, 1.0)


def test_a_value_that_the_table_calls_not_available_is_unknown(tmp_path: Path) -> None:
    board = Board({"can0": described(tmp_path, PLAIN)}, profile(FIELDS))
    now = feed(board, [b"\x02\x0f" + bytes(6)], 3)
    assert board.read("wiper_stage", now).reason == "marked not available by the sender"


@pytest.mark.parametrize(("unit", "known"), [("m/s", False), ("", True)])
def test_a_fault_is_no_value_of_a_quantity_and_one_of_a_state(tmp_path: Path, unit: str, known: bool) -> None:
    text = PLAIN.replace('Stage m2 : 8|4@1+ (1,0) [0|0] ""', f'Stage m2 : 8|4@1+ (1,0) [0|0] "{unit}"')
    field = {"wiper_stage": {"signal": "Stage", "maximum": 15.0}}
    board = Board({"can0": described(tmp_path, text.replace("Signal not available", "Fault"))}, profile(field))
    now = feed(board, [b"\x02\x0f" + bytes(6)], 3)
    assert (board.read("wiper_stage", now).value is not None) == known


def test_where_the_profile_tells_the_meaning_of_each_value_that_counts(tmp_path: Path) -> None:
    told = {"signal": "Stage", "maximum": 15.0, "values": {"off": 0.0, "Signal not available": 3.0}}
    board = Board({"can0": described(tmp_path, PLAIN)}, profile({"wiper_stage": told}))
    now = feed(board, [b"\x02\x0f" + bytes(6)], 3)
    assert board.read("wiper_stage", now).value == 3.0
    now = feed(board, [b"\x02\x01" + bytes(6)], 3)
    assert board.read("wiper_stage", now).reason == "not a known value"


@pytest.mark.parametrize("combine", ["min", "max", "mean", "sum"])
def test_of_two_signals_one_that_is_no_number_makes_the_field_unknown(tmp_path: Path, combine: str) -> None:
    both = {"signal": ["Real", "Raw"], "maximum": 100.0, "combine": combine}
    text = PLAIN.replace("BO_ 2147483651", ' SG_ Raw : 24|8@1+ (1,0) [0|0] "m/s2" A\n\nBO_ 2147483651')
    board = Board({"can0": described(tmp_path, text.replace('m/s2" A\n\n SG', 'm/s2" A\n SG'))}, profile({"x": both}))
    now = feed(board, [bytes(3) + b"\x05" + (0x7FC00000).to_bytes(4, "little")], 3)
    assert board.read("x", now).reason == "marked not available by the sender"


@pytest.mark.parametrize("word", [0x7F800000, 0x7FC00000, 0xFF800000])
def test_an_infinite_float_and_no_number_are_unknown(tmp_path: Path, word: int) -> None:
    board = Board({"can0": described(tmp_path, PLAIN)}, profile(FIELDS))
    now = feed(board, [bytes(4) + word.to_bytes(4, "little")], 3)
    assert board.read("acceleration_mps2", now).reason == "marked not available by the sender"


def test_the_same_number_with_11_and_29_bits_is_two_messages(tmp_path: Path) -> None:
    board = Board({"can0": described(tmp_path, PLAIN)}, profile(FIELDS))
    now = feed(board, [b"\x3c"], 3, extended=True)
    assert board.read("outside_temperature_c", now).value == 20.0
    assert not board.fields["speed_mps"].seen


def test_error_and_remote_frames_feed_nothing(tmp_path: Path) -> None:
    board = Board({"can0": described(tmp_path, PLAIN)}, profile(FIELDS))
    (frame,) = frames([bytes(8)], 3)
    board.ingest([msgspec.structs.replace(frame, error=True), msgspec.structs.replace(frame, remote=True)], START)
    assert not any(field.seen for field in board.fields.values())


def test_each_bus_feeds_its_own_fields(tmp_path: Path, guarded: Dbc) -> None:
    body = described(tmp_path, PLAIN)
    rules = {
        "speed_mps": {**SPEED, "bus": "chassis"},
        "outside_temperature_c": {**FIELDS["outside_temperature_c"], "bus": "body"},
    }
    both = profile(rules, chassis={"description": "a.dbc"}, body={"description": "b.dbc"})
    board = Board({"chassis": guarded, "body": body}, both)
    board.ingest(frames([b"\x3c"], 3, extended=True), START, "chassis")
    assert not board.fields["outside_temperature_c"].seen
    board.ingest(frames([b"\x3c"], 3, extended=True), START, "body")
    board.ingest(frames([sealed(1)]), START, "chassis")
    assert board.read("outside_temperature_c", START).value == 20.0
    assert board.read("speed_mps", START).value == 20.0


J1939 = f"""{HEAD}
BO_ 2566844926 CCVS: 8 A
 SG_ WheelSpeed : 8|16@1+ (0.00390625,0) [0|0] "km/h" A
 SG_ Brake : 28|2@1+ (1,0) [0|0] "" A
"""
TRUCK = {"speed_mps": {"signal": "WheelSpeed", "unit": "m/s", "maximum": 80.0}, "brake_pressed": {"signal": "Brake"}}


@given(priority=st.integers(0, 7), source=st.integers(0, 255))
def test_a_parameter_group_is_known_whatever_its_priority_and_source(priority: int, source: int) -> None:
    assert pgn_of(priority << 26 | 0xFEF1 << 8 | source) == 0xFEF1
    assert pgn_of(priority << 26 | 0xEA17 << 8 | source) == 0xEA00


def test_j1939_is_matched_by_group_and_its_error_values_are_unknown(tmp_path: Path) -> None:
    truck = profile(TRUCK, can0={"description": "car.dbc", "protocol": "j1939"})
    board = Board({"can0": described(tmp_path, J1939, protocol="j1939")}, truck)
    now = feed(board, [bytes([0, 0, 72, 0b01_0000, 0, 0, 0, 0])], 0x0CFEF127, extended=True)
    assert board.read("speed_mps", now).value == pytest.approx(20.0)
    assert board.read("brake_pressed", now).value == 1.0
    now = feed(board, [bytes([0, 0, 0xFE, 0b10_0000, 0, 0, 0, 0])], 0x0CFEF127, extended=True)
    reason = "marked not available by the sender"
    assert {board.read(name, now).reason for name in TRUCK} == {reason}


def test_of_several_senders_of_one_j1939_group_one_that_knows_is_followed(tmp_path: Path) -> None:
    """An engine, a tachograph that measures otherwise and a unit without a measurement, in any order."""

    def speed(sender: int, raw: int | None, stamp_ns: int) -> CanFrame:
        data = bytes([0, *(0xFFFF if raw is None else raw * 256).to_bytes(2, "little"), 0, 0, 0, 0, 0])
        return CanFrame(stamp_ns=stamp_ns, arbitration_id=0x18FEF100 | sender, data=data, extended=True)

    def read(board: Board, now: int) -> int:
        value = board.read("speed_mps", now).value
        return -1 if value is None else round(value * 3.6)

    told = {0x00: 100, 0x17: 90, 0x31: None}
    for order in itertools.permutations(told):
        truck = profile(TRUCK, can0={"description": "car.dbc", "protocol": "j1939"})
        board = Board({"can0": described(tmp_path, J1939, protocol="j1939")}, truck)
        now, values = START, []
        for _ in range(20):
            for sender in order:
                now += 33_000_000
                board.ingest([speed(sender, told[sender], now)], now)
                values.append(read(board, now))
        first, other = (sender for sender in order if told[sender] is not None)
        assert set(values[3:]) == {told[first]}
        now += 1_000_000_000  # the unit that was followed is silent: the other is heard
        for _ in range(40):
            now += 100_000_000
            board.ingest([speed(other, told[other], now)], now)
        assert read(board, now) == told[other]


OVERLAP = f"""{HEAD}
BO_ 9 Torn: 8 A
 SG_ Speed : 0|16@1+ (1,0) [0|0] "m/s" A
 SG_ Other : 8|16@1+ (1,0) [0|0] "" A

BO_ 10 Sound: 8 A
 SG_ Warmth : 0|8@1+ (1,-40) [0|0] "degC" A
"""


def test_a_message_that_contradicts_itself_feeds_a_field_only_where_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    dbc = described(tmp_path, OVERLAP)
    assert "car.dbc: The signals Other and Speed are overlapping in message Torn" in caplog.text
    Board({"can0": dbc}, profile({"outside_temperature_c": FIELDS["outside_temperature_c"]}))
    with pytest.raises(ProfileError, match=r"overlapping in message Torn; field speed_mps needs it"):
        Board({"can0": dbc}, profile({"speed_mps": SPEED}))
    Board({"can0": described(tmp_path, OVERLAP, strict=False)}, profile({"speed_mps": SPEED}))


@pytest.mark.parametrize(
    ("rule", "said"),
    [
        (
            {**SPEED, "signal": "Sped"},
            r"field speed_mps: no signal 'Sped' in the bus description car.dbc; did you mean 'Speed'\?",
        ),
        ({**SPEED, "message": "Moton"}, "no signal 'Speed' in message Moton of the bus description"),
        ({**SPEED, "counter": "Cont"}, r"message Motion \(for speed_mps\): Cont is not in message Motion"),
        ({**SPEED, "checksum": {"signal": "Sum", "kind": "md5"}}, "Motion.Sum: no checksum kind 'md5'"),
        ({**SPEED, "unit": "bar"}, "no conversion from 'm/s' to 'bar'"),
    ],
)
def test_a_rule_that_does_not_fit_its_description_is_named(guarded: Dbc, rule: dict[str, Any], said: str) -> None:
    with pytest.raises(ProfileError, match=said) as raised:
        Board({"can0": guarded}, profile({"speed_mps": rule}))
    assert "\n" not in str(raised.value)

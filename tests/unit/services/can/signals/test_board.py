"""Frames into fields: what is believed, and what is not."""

import re
from pathlib import Path

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from proto.sensors import CanFrame
from services.can.ego import read_ego
from services.can.errors import ProfileError
from services.can.profiles.dbc import Dbc
from services.can.profiles.profile import FieldRule, Profile, transform
from services.can.signals.board import Board
from services.simulator.car.state import CarModel, CarState, Controls
from services.simulator.ecus.can_frames import FrameEncoder, crc8

MS = 1_000_000
START = 10_000 * MS


@pytest.fixture
def board(dbc: Dbc, profile: Profile) -> Board:
    return Board({"": dbc}, profile)


class Feed:
    """Encodes a state again and again, 20 ms apart."""

    def __init__(self, board: Board, dbc_path: Path) -> None:
        self.board, self.encoder, self.now_ns = board, FrameEncoder(dbc_path), START

    def run(self, state: CarState, seconds: float = 0.2) -> None:
        for _ in range(round(seconds / 0.02)):
            self.now_ns += 20 * MS
            self.board.ingest(self.encoder.due(state, self.now_ns), self.now_ns)


@pytest.fixture
def feed(board: Board, dbc_path: Path) -> Feed:
    return Feed(board, dbc_path)


def car(**controls: float | int | str | bool) -> CarState:
    return CarModel().step(0.02, Controls(**controls))  # type: ignore[arg-type]


def test_every_field_of_the_profile_is_fed_by_the_simulated_bus(board: Board, feed: Feed) -> None:
    feed.run(car(speed_mps=15.0), 2.0)
    unread = {
        name: board.read(name, feed.now_ns).reason for name in board.fields if board.read(name, feed.now_ns).reason
    }
    assert unread == {}
    assert read_ego(board, feed.now_ns).invalid == ()


def test_a_value_out_of_range_is_invalid_and_not_zero(board: Board, feed: Feed, dbc: Dbc) -> None:
    feed.run(car(speed_mps=15.0))
    message, _ = dbc.signal("VehicleSpeed")
    values = {
        "VehicleSpeed": 655.0,
        "LongitudinalAcceleration": 0,
        "YawRate": 0,
        "MotionCounter": 15,
        "VehicleSpeedValid": 1,
        "MotionChecksum": 0,
    }
    raw = bytes(message.encode(values, strict=False))[:-1]
    raw += bytes([crc8(raw)])
    board.ingest([CanFrame(stamp_ns=feed.now_ns, arbitration_id=0x101, data=raw)], feed.now_ns)
    ego = read_ego(board, feed.now_ns)
    assert ego.speed_mps is None
    assert "speed_mps" in ego.invalid


def test_a_speed_that_jumps_is_doubted_until_it_stays(board: Board, feed: Feed) -> None:
    feed.run(car(speed_mps=10.0))
    feed.run(car(speed_mps=40.0), 0.02)
    assert read_ego(board, feed.now_ns).speed_mps is None
    feed.run(car(speed_mps=40.0), 0.1)
    assert read_ego(board, feed.now_ns).speed_mps == pytest.approx(40.0, abs=0.01)


def test_a_sender_that_repeats_itself_is_not_believed(board: Board, feed: Feed) -> None:
    feed.run(car(speed_mps=20.0))
    frozen = feed.encoder.encode("Motion", car(speed_mps=20.0))
    for _ in range(5):
        feed.now_ns += 20 * MS
        board.ingest([msgspec.structs.replace(frozen, stamp_ns=feed.now_ns)], feed.now_ns)
    assert board.read("speed_mps", feed.now_ns).reason == "sender repeats itself"


def test_a_silent_signal_is_unknown_after_its_age(board: Board, feed: Feed) -> None:
    feed.run(car(speed_mps=20.0))
    assert board.read("speed_mps", feed.now_ns + 150 * MS).value is not None
    assert board.read("speed_mps", feed.now_ns + 250 * MS) == (None, feed.now_ns, "silent")


def test_wheels_that_tell_another_speed_take_the_speed_away(board: Board, feed: Feed) -> None:
    from dataclasses import replace

    feed.run(replace(car(speed_mps=20.0), wheel_speeds_mps=(5.0, 5.0, 5.0, 5.0)))
    ego = read_ego(board, feed.now_ns)
    assert ego.speed_mps is None
    assert "speed_mps" in ego.invalid


def test_frames_from_a_clock_that_ran_ahead_change_nothing(board: Board, feed: Feed) -> None:
    feed.run(car(speed_mps=20.0))
    ahead = msgspec.structs.replace(feed.encoder.encode("Motion", car(speed_mps=3.0)), stamp_ns=1 << 62)
    board.ingest([ahead], feed.now_ns)
    feed.run(car(speed_mps=20.0), 0.06)
    assert read_ego(board, feed.now_ns).speed_mps == pytest.approx(20.0)


def test_a_short_frame_is_counted(board: Board) -> None:
    board.ingest([CanFrame(stamp_ns=START, arbitration_id=0x101, data=b"\x01")], START)
    assert board.malformed == 1


FRAMES = st.lists(
    st.builds(
        CanFrame,
        stamp_ns=st.integers(0, 1 << 63),
        arbitration_id=st.sampled_from([0x100, 0x101, 0x102, 0x103, 0x131, 0x120, 0x7E8, 0x555])
        | st.integers(0, 0x1FFFFFFF),
        data=st.binary(max_size=64),
        extended=st.booleans(),
    ),
    max_size=30,
)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(FRAMES)
def test_no_frame_breaks_the_board_and_what_is_published_is_plausible(
    dbc: Dbc, profile: Profile, frames: list[CanFrame]
) -> None:
    board = Board({"": dbc}, profile)
    board.ingest(frames, START)
    ego = read_ego(board, START)
    assert ego.speed_mps is None or 0.0 <= ego.speed_mps <= 83.4
    assert ego.yaw_rate_radps is None or abs(ego.yaw_rate_radps) <= 2.0


def test_a_unit_that_the_table_does_not_convert_is_an_error_and_not_a_guess() -> None:
    with pytest.raises(ProfileError, match="furlong"):
        transform("furlong", FieldRule(signal="X", unit="m/s"))


@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.sampled_from(["Motion", "StabilityControl", "Brakes", "Steering"]), st.integers(0, 63), st.floats(0.0, 60.0))
def test_a_flipped_bit_in_what_the_simulated_car_guards_changes_no_value_but_to_unknown(
    dbc: Dbc, profile: Profile, feed: Feed, message: str, bit: int, speed_mps: float
) -> None:
    board, state = Board({"can0": dbc}, profile), car(speed_mps=speed_mps)
    frames = [msgspec.structs.replace(feed.encoder.encode(message, state), stamp_ns=START + n) for n in range(2)]
    board.ingest(frames[:1], START)
    before = {name: board.read(name, START).value for name in board.fields}
    data = frames[1].data
    flipped = (int.from_bytes(data, "big") ^ 1 << bit % (8 * len(data))).to_bytes(len(data), "big")
    board.ingest([msgspec.structs.replace(frames[1], data=flipped)], START + 1)
    fed = {name for name, value in before.items() if value is not None}
    assert fed
    assert {board.read(name, START + 1).reason for name in fed} == {"wrong checksum"}


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        (
            ' SG_ X : 0|12@1- (1,0) [0|0] "km/h" A\nSIG_VALTYPE_ 100 X : 1;',
            "M.X: a float has 16, 32 or 64 bits, not 12",
        ),
        (
            ' SG_ X m0 : 0|8@1+ (1,0) [0|0] "km/h" A\nSG_MUL_VAL_ 100 X Q 0-0;',
            "M.X: selected by 'Q', which is not in the message",
        ),
        (
            ' SG_ X m0M : 0|8@1+ (1,0) [0|0] "km/h" A\n SG_ Y m0M : 8|8@1+ (1,0) [0|0] "" A\n'
            "SG_MUL_VAL_ 100 X Y 0-0;\nSG_MUL_VAL_ 100 Y X 0-0;",
            "M.Y: selected by 'X', which it selects itself",
        ),
    ],
)
def test_a_signal_that_cannot_be_read_is_refused_by_file_and_name(
    tmp_path: Path, profile: Profile, lines: str, says: str
) -> None:
    path = tmp_path / "odd.dbc"
    path.write_text(f'VERSION ""\nNS_ :\nBS_:\nBU_: A\nBO_ 100 M: 8 A\n{lines}\n')
    rule = FieldRule(signal="X", vss="Vehicle.Speed", unit="m/s", maximum=90.0)
    one = msgspec.structs.replace(profile, fields={"speed_mps": rule}, messages={})
    with pytest.raises(ProfileError, match=re.escape("odd.dbc")) as refused:
        Board({"": Dbc(path)}, one)
    assert says in str(refused.value)

"""CAN logs beside recordings: the ego speed through the CAN service, and what is wrong with a log told in one line."""

from pathlib import Path

import can
import cv2
import numpy as np
import pytest

from drivemcp.errors import UserError
from drivemcp.files.can_logs.log import CanLog
from drivemcp.paths import data
from drivemcp.testing import bus
from proto import topics
from proto.vehicle import Ego
from services.can.profiles.profile import load_profile
from services.can.profiles.units import SPELLINGS, linear
from services.can.service import SERVICE as CAN
from services.can.service import CanConfig
from services.player.can_log import OUR_DBC, SpeedSignal, can_messages, log_beside, open_log, profile_of, speed_signal
from services.player.service import SERVICE, PlayerConfig
from services.simulator.car.state import CarModel, Controls
from services.simulator.ecus.can_frames import FrameEncoder

SPEED_KMH = 54.0
DBC = """VERSION ""
BU_: ECU
BO_ 291 Chassis: 8 ECU
 SG_ WheelTicks : 0|8@1+ (1,0) [0|255] "" ECU
 SG_ RoadSpeed : 8|16@1+ (0.1,0) [0|400] "kph" ECU
 SG_ Odd : 24|8@1+ (1,0) [0|255] "furlong" ECU
"""
J1939 = """BA_DEF_ BO_ "VFrameFormat" ENUM "StandardCAN","ExtendedCAN","reserved","J1939PG";
BA_DEF_DEF_ "VFrameFormat" "StandardCAN";
BA_ "VFrameFormat" BO_ 2566844672 3;
"""


def frames(kind: str, seconds: float = 3.0) -> list[can.Message]:
    """A car at SPEED_KMH, fifty frames a second, by our bus description or by the one above."""
    messages = []
    encoder, state = FrameEncoder(data(OUR_DBC)), CarModel().step(0.02, Controls(speed_mps=SPEED_KMH / 3.6))
    for number in range(round(seconds * 50)):
        if kind == "ours":
            motion = encoder.encode("Motion", state)
            identifier, payload = motion.arbitration_id, motion.data
        else:
            identifier, payload = 291, bytes([number % 256]) + round(SPEED_KMH * 10).to_bytes(2, "little") + bytes(5)
        messages.append(
            can.Message(timestamp=1000.0 + number / 50, arbitration_id=identifier, data=payload, is_extended_id=False)
        )
    return messages


def write(path: Path, messages: list[can.Message]) -> Path:
    """With python-can, by the name's ending."""
    with can.Logger(str(path)) as logger:
        for message in messages:
            logger.on_message_received(message)
    return path


@pytest.fixture
def pictures(tmp_path: Path) -> Path:
    """Two seconds of pictures."""
    folder = tmp_path / "pictures"
    folder.mkdir()
    for number in range(4):
        cv2.imwrite(str(folder / f"{number}.png"), np.zeros((90, 160, 3), np.uint8))
    return folder


def read_by(speed: SpeedSignal, log: Path, pictures: Path) -> Ego:
    """What the CAN service makes of the log by a profile for this signal alone."""
    profile = log.with_name("profile.toml")
    profile.write_text(profile_of(speed))
    with bus() as b:
        egos = b.collect(topics.EGO)
        b.start(CAN, CanConfig(poll_dtcs_s=0, profile=str(profile)))
        b.start(SERVICE, PlayerConfig(source=str(pictures), can_log=str(log)))
        return egos.wait(lambda ego: ego.speed_mps is not None)


@pytest.mark.parametrize("ending", [".asc", ".blf", ".log", ".trc"])
def test_a_log_beside_the_pictures_becomes_the_ego_speed(tmp_path: Path, pictures: Path, ending: str) -> None:
    log = write(pictures / f"drive{ending}", frames("ours"))
    assert log_beside(pictures) == log
    open_log(log, speed_signal(None, "", ""), "")
    with bus() as b:
        egos = b.collect(topics.EGO)
        b.start(CAN, CanConfig(poll_dtcs_s=0))
        b.start(SERVICE, PlayerConfig(source=str(pictures), can_log=str(log)))
        ego = egos.wait(lambda ego: ego.speed_mps is not None)
        assert ego.speed_mps == pytest.approx(SPEED_KMH / 3.6, abs=0.01)


def test_a_given_bus_description_is_read_through_a_profile_of_its_own(tmp_path: Path, pictures: Path) -> None:
    log = write(tmp_path / "other.asc", frames("other"))
    dbc = tmp_path / "other.dbc"
    dbc.write_text(DBC)
    speed = speed_signal(dbc, "RoadSpeed", "")
    open_log(log, speed, "")
    ego = read_by(speed, log, pictures)
    assert ego.speed_mps == pytest.approx(SPEED_KMH / 3.6, abs=0.02)
    assert ego.yaw_rate_radps is None


@pytest.mark.parametrize("attribute", ["", J1939])
def test_a_speed_under_a_29_bit_id_is_read_too(tmp_path: Path, pictures: Path, attribute: str) -> None:
    sent = [
        can.Message(timestamp=each.timestamp, arbitration_id=0x18FEF100, data=each.data, is_extended_id=True)
        for each in frames("other")
    ]
    log = write(tmp_path / "truck.asc", sent)
    dbc = tmp_path / "truck.dbc"
    dbc.write_text(DBC.replace("BO_ 291", f"BO_ {0x80000000 | 0x18FEF100}") + attribute)
    speed = speed_signal(dbc, "RoadSpeed", "")
    open_log(log, speed, "")
    assert read_by(speed, log, pictures).speed_mps == pytest.approx(SPEED_KMH / 3.6, abs=0.02)


@pytest.mark.parametrize(
    ("sent", "extended", "by_group", "by_number"),
    [
        (0x18FEF100, True, True, True),
        (0x0CFEF127, True, True, False),  # another priority and another sender
        (0x18FEF200, True, False, False),
        (0x0EF100, False, False, False),
    ],
)
def test_by_j1939_any_priority_and_sender_of_the_group_will_do(
    tmp_path: Path, sent: int, extended: bool, by_group: bool, by_number: bool
) -> None:
    message = can.Message(
        timestamp=1.0, arbitration_id=sent & (0x1FFFFFFF if extended else 0x7FF), data=bytes(8), is_extended_id=extended
    )
    log = write(tmp_path / "truck.asc", [message])
    for attribute, carried in ((J1939, by_group), ("", by_number)):
        dbc = tmp_path / "truck.dbc"
        dbc.write_text(DBC.replace("BO_ 291", f"BO_ {0x80000000 | 0x18FEF100}") + attribute)
        speed = speed_signal(dbc, "RoadSpeed", "")
        if carried:
            open_log(log, speed, "")
        else:
            with pytest.raises(UserError, match=r"none of its 1 frames is 0x18FEF100"):
                open_log(log, speed, "")


def test_frames_come_in_batches_counted_from_the_recordings_start(tmp_path: Path) -> None:
    log = write(tmp_path / "drive.asc", frames("ours", seconds=1.0))
    messages = list(can_messages(CanLog(log), 0.5))
    assert messages[0].at_s == pytest.approx(0.0, abs=0.02)
    assert messages[-1].at_s == pytest.approx(0.48, abs=0.01)
    assert all(each.topic is topics.CAN_RX for each in messages)


def test_a_log_without_the_signal_is_told(tmp_path: Path) -> None:
    log = write(tmp_path / "drive.asc", frames("other", seconds=0.2))
    with pytest.raises(
        UserError, match=r"drive\.asc: none of its 10 frames is 0x101 \(Motion\), which carries VehicleSpeed"
    ):
        open_log(log, speed_signal(None, "", ""), "")


@pytest.mark.parametrize(
    ("name", "content"),
    [("a.blf", b"no log"), ("a.xyz", b"x"), ("a.asc", b"\xff\xfe\x00"), ("a.log", b"what is this\n")],
)
def test_a_file_that_is_no_can_log_is_told_in_one_line(tmp_path: Path, name: str, content: bytes) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(UserError, match=name) as raised:
        open_log(tmp_path / name, speed_signal(None, "", ""), "")
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("text", "signal", "unit", "complaint"),
    [
        ("BO_ 291 Chassis", "RoadSpeed", "", "cannot be read as a bus description"),
        (DBC, "Speed", "", r"has no signal 'Speed'; its speeds: RoadSpeed"),
        (DBC, "", "", "needs --speed-signal; its speeds: RoadSpeed"),
        (DBC, "Odd", "", "in 'furlong'; give --speed-unit"),
        (
            DBC.replace("RoadSpeed :", "RoadSpeed m1 :"),
            "RoadSpeed",
            "",
            "Chassis.RoadSpeed: multiplexed, but by which signal",
        ),
    ],
)
def test_a_bus_description_that_cannot_be_used_is_told(
    tmp_path: Path, text: str, signal: str, unit: str, complaint: str
) -> None:
    dbc = tmp_path / "car.dbc"
    dbc.write_text(text)
    with pytest.raises(UserError, match=rf"car\.dbc.*{complaint}") as raised:
        speed_signal(dbc, signal, unit)
    assert "\n" not in str(raised.value)


SIGNAL = ' SG_ RoadSpeed : 40|16@1+ (0.1,0) [0|400] "kph" ECU\n'


@pytest.mark.parametrize(("text", "ids"), [(DBC + SIGNAL, "0x123, 0x123"), (DBC + DBC.partition("ECU\n")[2], "0x123, 0x123"),
                                           (DBC + f"BO_ 292 Chassis: 8 ECU\n{SIGNAL}", "0x123, 0x124")])  # fmt: skip
@pytest.mark.parametrize("wanted", ["RoadSpeed", "Chassis.RoadSpeed"])
def test_a_signal_that_is_described_twice_by_one_name_cannot_be_chosen_and_says_so(
    tmp_path: Path, text: str, ids: str, wanted: str
) -> None:
    (tmp_path / "car.dbc").write_text(text)
    with pytest.raises(
        UserError, match=rf"Chassis.RoadSpeed is described 2 times \({ids}\); keep or rename one of them"
    ):
        speed_signal(tmp_path / "car.dbc", wanted, "")


def test_a_unit_that_is_told_counts(tmp_path: Path) -> None:
    (tmp_path / "car.dbc").write_text(DBC)
    assert speed_signal(tmp_path / "car.dbc", "Odd", "mph").factor == pytest.approx(0.44704)


@pytest.mark.parametrize("name", ["🚗 car", "ünï cär", 'a "quoted" one', "back\\slash", "del\x7f"])
def test_a_profile_names_a_bus_description_in_whatever_folder(tmp_path: Path, name: str) -> None:
    (tmp_path / name).mkdir()
    (tmp_path / name / "car.dbc").write_text(DBC)
    profile = tmp_path / "profile.toml"
    profile.write_text(profile_of(speed_signal(tmp_path / name / "car.dbc", "RoadSpeed", "")), encoding="utf-8")
    assert load_profile(profile).buses["can0"].description == str(tmp_path / name / "car.dbc")


@pytest.mark.parametrize("unit", ["m/s", "km/h", "mph"])
def test_every_spelling_that_the_can_service_knows_is_known_here(tmp_path: Path, unit: str) -> None:
    for spelling in SPELLINGS[unit]:
        (tmp_path / "car.dbc").write_text(DBC.replace('"kph"', f'"{spelling}"'))
        assert speed_signal(tmp_path / "car.dbc", "RoadSpeed", "").factor == pytest.approx(linear(unit, "m/s").scale)


def test_what_a_mac_writes_beside_a_log_is_none(tmp_path: Path) -> None:
    for name in ("drive.log", "._drive.log"):
        (tmp_path / name).write_bytes(b"")
    assert log_beside(tmp_path) == tmp_path / "drive.log"


BESIDE = 'BO_ 300 Comfort: 8 ECU\n SG_ Heat : 0|8@1+ (1,0) [0|1] "" ECU\n SG_ Fan : 4|8@1+ (1,0) [0|1] "" ECU\n'
TWICE = 'BO_ 512 Cluster: 8 ECU\n SG_ RoadSpeed : 0|16@1+ (0.01,0) [0|300] "mph" ECU\n'


def on(channel: int, messages: list[can.Message]) -> list[can.Message]:
    for each in messages:
        each.channel = channel
    return messages


def test_a_broken_message_beside_the_speeds_own_is_no_reason_to_refuse(tmp_path: Path, pictures: Path) -> None:
    dbc = tmp_path / "overlap.dbc"
    dbc.write_text(DBC + BESIDE, encoding="utf-8-sig")
    speed = speed_signal(dbc, "RoadSpeed", "")
    log = write(tmp_path / "drive.asc", frames("other"))
    assert read_by(speed, log, pictures).speed_mps == pytest.approx(SPEED_KMH / 3.6, abs=0.02)
    with pytest.raises(UserError, match=r"message of Heat is described wrongly: overlap.dbc: .* are overlapping"):
        speed_signal(dbc, "Heat", "km/h")


def test_a_signal_of_two_messages_is_asked_for_and_named_with_its_message(tmp_path: Path, pictures: Path) -> None:
    dbc = tmp_path / "twice.dbc"
    dbc.write_text(DBC + TWICE)
    both = r"choose one with --speed-signal: Chassis\.RoadSpeed \(0x123, kph\), Cluster\.RoadSpeed \(0x200, mph\)"
    with pytest.raises(UserError, match=both):
        speed_signal(dbc, "RoadSpeed", "")
    assert speed_signal(dbc, "Cluster.RoadSpeed", "").arbitration_id == 0x200
    speed = speed_signal(dbc, "Chassis.RoadSpeed", "")
    log = write(tmp_path / "drive.asc", frames("other"))
    assert read_by(speed, log, pictures).speed_mps == pytest.approx(SPEED_KMH / 3.6, abs=0.02)


def test_a_speed_on_two_buses_is_asked_for(tmp_path: Path) -> None:
    speed = speed_signal(None, "", "")
    log = write(tmp_path / "two.asc", on(0, frames("ours")) + on(1, frames("ours", 1.0)))
    with pytest.raises(
        UserError, match=r"on 2 buses: channel 0 \(150 frames\), channel 1 \(50 frames\).*--can-channel"
    ):
        open_log(log, speed, "")
    assert open_log(log, speed, "1").channel == "1"
    with pytest.raises(UserError, match=r"none of its 200 frames of channel 7 \(channel 0 \(150 frames\)"):
        open_log(log, speed, "7")


def test_the_bus_that_carries_the_speed_is_taken_and_what_is_left_out_is_told(tmp_path: Path) -> None:
    path = write(tmp_path / "two.asc", on(0, frames("other")) + on(1, frames("ours", 1.0)))
    log = open_log(path, speed_signal(None, "", ""), "")
    assert log.channel == "1"
    assert "left out 150 frames of channel 0; this is channel 1" in log.summary
    assert {record.frame.arbitration_id for record in CanLog(path, log.channel)} == {0x101}


def test_of_several_logs_beside_a_recording_one_has_to_be_named(tmp_path: Path, pictures: Path) -> None:
    for name in ("b.asc", "a.log"):
        (pictures / name).write_text("")
    with pytest.raises(UserError, match=r"several CAN logs: a.log, b.asc; name one with --can, or --can none"):
        log_beside(pictures)

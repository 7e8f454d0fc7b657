"""Recorded logs: every format that python-can writes is read back whole, and of a broken one what can be read."""

import gzip
from pathlib import Path
from typing import Any

import can
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError
from drivemcp.paths import data
from drivemcp.testing import bus
from proto import topics
from proto.sensors import CanFrame
from services.can.buses.link import to_message
from services.can.buses.opening import BusConfig
from services.can.buses.recorded import RecordedLog
from services.can.buses.replay import Replay, Step
from services.can.service import SERVICE, CanConfig
from services.simulator.car.state import CarModel, Controls
from services.simulator.ecus.can_frames import FrameEncoder

NS = 1_000_000_000
START_S = 1_700_000_000.0
CLASSIC = (".asc", ".blf", ".csv", ".log", ".trc")
WITH_FD = (".asc", ".blf", ".log")


def drive(seconds: float, speed_mps: float = 13.9) -> list[CanFrame]:
    """What the simulated car sends."""
    encoder, model = FrameEncoder(data("vehicles/sim/sim.dbc")), CarModel()
    found: list[CanFrame] = []
    for number in range(round(seconds * 50)):
        now_ns = int(START_S * NS) + number * 20_000_000
        found += encoder.due(model.step(0.02, Controls(speed_mps=speed_mps)), now_ns)
    return found


def write(path: Path, frames: list[CanFrame], channel: int | str | None = None) -> Path:
    """A log by python-can."""
    with can.Logger(str(path)) as logger:
        for frame in frames:
            message = to_message(frame)
            message.channel = channel
            logger.on_message_received(message)
    return path


def content(frame: CanFrame) -> tuple[Any, ...]:
    return (
        frame.arbitration_id,
        frame.data,
        frame.extended,
        frame.fd,
        frame.remote,
        frame.bitrate_switch,
        frame.error_state,
    )


@pytest.mark.parametrize("ending", CLASSIC)
def test_every_frame_of_a_log_comes_in_its_order_and_time(tmp_path: Path, ending: str) -> None:
    frames = drive(2.0)
    log = RecordedLog(write(tmp_path / f"drive{ending}", frames))
    records = list(log)
    assert [content(record.frame) for record in records] == [content(frame) for frame in frames]
    spans = [(frame.stamp_ns - frames[0].stamp_ns) / NS for frame in frames]
    assert [record.at_s for record in records] == pytest.approx(spans, abs=0.0011)
    assert log.notes == []


def candump(path: Path, times_s: list[float]) -> RecordedLog:
    """A log of frames with these times, numbered by their ids."""
    path.write_text("".join(f"({each:.6f}) can0 {number:03X}#11\n" for number, each in enumerate(times_s)))
    return RecordedLog(path)


@settings(max_examples=60)
@given(st.sets(st.integers(0, 97), max_size=4), st.sampled_from([4e3, 1e5, 8e9]))
def test_a_time_stamp_far_ahead_costs_its_own_record_alone(
    tmp_path_factory: pytest.TempPathFactory, wrong: set[int], by_s: float
) -> None:
    times = [START_S + 0.01 * number + (by_s if number in wrong else 0.0) for number in range(100)]
    log = candump(tmp_path_factory.mktemp("log") / "drive.log", times)
    records = list(log)
    assert [record.frame.arbitration_id for record in records] == [each for each in range(100) if each not in wrong]
    assert records[-1].at_s == pytest.approx(0.99, abs=0.05)
    assert log.malformed == len(wrong)
    assert all("hours after" in note for note in log.notes)


def test_a_long_pause_in_a_log_is_no_wrong_time(tmp_path: Path) -> None:
    times = [START_S + 0.01 * number + (7200.0 if number >= 50 else 0.0) for number in range(100)]
    log = candump(tmp_path / "drive.log", times)
    assert len(list(log)) == 100
    assert log.notes == []


@pytest.mark.parametrize("ending", WITH_FD)
def test_long_frames_extended_ids_and_remote_frames_survive_a_log(tmp_path: Path, ending: str) -> None:
    frames = [
        CanFrame(stamp_ns=int(START_S * NS), arbitration_id=0x18FEF100, data=bytes(range(8)), extended=True),
        CanFrame(stamp_ns=int(START_S * NS), arbitration_id=0x1A, data=bytes(range(64)), fd=True, bitrate_switch=True),
        CanFrame(stamp_ns=int(START_S * NS), arbitration_id=0x1B, data=bytes(12), fd=True, error_state=True),
        CanFrame(stamp_ns=int(START_S * NS), arbitration_id=0x1C, data=b"", remote=True, requested_bytes=4),
    ]
    log = RecordedLog(write(tmp_path / f"fd{ending}", frames))
    assert [content(record.frame) for record in log] == [content(frame) for frame in frames]
    assert log.notes == []


def test_a_packed_text_log_is_read_as_it_is(tmp_path: Path) -> None:
    frames = drive(0.5)
    path = tmp_path / "drive.log.gz"
    path.write_bytes(gzip.compress(write(tmp_path / "drive.log", frames).read_bytes()))
    assert len(list(RecordedLog(path))) == len(frames)


BAD_LINES = {
    ".log": "(not a time) can0 101#00",
    ".csv": "now,zz,0,0,0,8,????",
    ".asc": " 1.000000 1  101x Rx   d 8 01 02 GG 04",
    ".trc": "      9       1.000 DT 1      ZZ1 Rx -  2    01 02",
}


@pytest.mark.parametrize("ending", BAD_LINES)
def test_a_malformed_line_costs_itself_alone_and_is_told_by_file_and_line(tmp_path: Path, ending: str) -> None:
    frames = drive(0.2)
    path = write(tmp_path / f"drive{ending}", frames)
    lines = path.read_text().splitlines(keepends=True)
    place = len(lines) - 4
    path.write_text("".join([*lines[:place], BAD_LINES[ending] + "\n", *lines[place:]]))
    log = RecordedLog(path)
    assert [content(record.frame) for record in log] == [content(frame) for frame in frames]
    assert log.malformed == 1
    assert log.notes[0].startswith(f"drive{ending}: line {place + 1}: ") or "record" in log.notes[0]
    assert "1 malformed, first drive" in log.summary


@pytest.mark.parametrize("ending", [".asc", ".blf", ".log", ".trc", ".csv", ".log.gz"])
def test_of_a_cut_log_what_can_be_read_is_replayed_and_the_cut_is_told(tmp_path: Path, ending: str) -> None:
    frames = drive(4.0)
    path = write(tmp_path / f"drive{ending.removesuffix('.gz')}", frames)
    if ending == ".log.gz":
        path = tmp_path / "drive.log.gz"
        path.write_bytes(gzip.compress((tmp_path / "drive.log").read_bytes()))
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) * 3 // 4 + 3])
    log = RecordedLog(path)
    records = [content(record.frame) for record in log]
    assert len(records) > (0 if ending == ".blf" else len(frames) // 3)
    assert records[:-1] == [content(frame) for frame in frames][: len(records) - 1]
    assert log.malformed >= 1
    assert path.name in log.notes[-1]


def test_a_log_whose_header_lacks_what_its_version_needs_ends_and_says_so(tmp_path: Path) -> None:
    path = write(tmp_path / "drive.trc", drive(0.1))
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    assert any(line.startswith(";$COLUMNS") for line in lines)
    path.write_text("".join(line for line in lines if not line.startswith(";$COLUMNS")), encoding="utf-8")
    log = RecordedLog(path)
    assert list(log) == []
    assert "drive.trc" in log.notes[-1]
    assert "header" in log.notes[-1]


@settings(max_examples=60, deadline=None)
@given(noise=st.binary(max_size=300), where=st.floats(0, 1), ending=st.sampled_from(CLASSIC))
def test_no_bytes_break_the_reading_and_none_invent_a_frame_that_is_none(
    tmp_path_factory: Any, noise: bytes, where: float, ending: str
) -> None:
    folder = tmp_path_factory.mktemp("noise")
    path = write(folder / f"drive{ending}", drive(0.1))
    whole = path.read_bytes()
    place = int(where * len(whole))
    path.write_bytes(whole[:place] + noise + whole[place:])
    for record in RecordedLog(path):
        assert len(record.frame.data) <= 64
        assert record.at_s >= 0.0


def test_of_several_channels_one_is_replayed_and_the_others_are_told(tmp_path: Path) -> None:
    path = tmp_path / "two.log"
    path.write_text("(1.0) can0 101#01\n(1.1) can1 101#02\n(1.2) can0 101#03\n(1.3) can1 101#04\n")
    first, second = RecordedLog(path), RecordedLog(path, "can1")
    assert [record.frame.data for record in first] == [b"\x01", b"\x03"]
    assert [(round(record.at_s, 3), record.frame.data) for record in second] == [(0.1, b"\x02"), (0.3, b"\x04")]
    assert first.summary == "left out 2 frames of channel can1; this is channel can0"


def log_of(tmp_path: Path, count: int = 10) -> RecordedLog:
    """A frame every 100 ms."""
    path = tmp_path / "even.log"
    path.write_text("".join(f"({1 + number / 10}) can0 101#{number:02X}\n" for number in range(count)))
    return RecordedLog(path)


@pytest.mark.parametrize(("speed", "expected"), [(1.0, 3), (2.0, 5), (0.5, 2)])
def test_a_replay_keeps_its_pace_by_the_clock_that_it_is_shown(tmp_path: Path, speed: float, expected: int) -> None:
    replay = Replay(log_of(tmp_path), speed=speed)
    frames = replay.due(5 * NS) + replay.due(5 * NS + NS // 5)
    assert len(frames) == expected
    assert [frame.stamp_ns - 5 * NS for frame in frames] == pytest.approx(
        [int(n * NS / 10 / speed) for n in range(expected)], abs=1000
    )


def test_a_looped_replay_never_ends_and_its_time_never_falls_back(tmp_path: Path) -> None:
    replay = Replay(log_of(tmp_path), loop=True)
    replay.due(0)
    stamps = [frame.stamp_ns for frame in replay.due(5 * NS)]
    assert 48 <= len(stamps) <= 56
    assert stamps == sorted(stamps)
    assert not replay.ended


@pytest.mark.parametrize(
    ("step", "counts"), [(Step(frames=1), [1, 1, 1]), (Step(frames=4), [4, 4, 2]), (Step(ms=250.0), [3, 3, 2])]
)
def test_a_step_goes_as_far_as_it_is_told(tmp_path: Path, step: Step, counts: list[int]) -> None:
    replay = Replay(log_of(tmp_path))
    batches = [replay.step(step, number * NS) for number in (10, 20, 30)]
    assert [len(batch) for batch in batches] == counts
    assert all(
        frame.stamp_ns <= number * NS for batch, number in zip(batches, (10, 20, 30), strict=True) for frame in batch
    )
    stamps = [frame.stamp_ns for batch in batches for frame in batch]
    assert stamps == sorted(stamps)


@pytest.mark.parametrize("ending", CLASSIC)
def test_the_ego_speed_is_that_of_the_recorded_drive(tmp_path: Path, ending: str) -> None:
    path = write(tmp_path / f"drive{ending}", drive(3.0))
    with bus() as b:
        health = b.collect(topics.HEALTH, id="can")
        egos = b.collect(topics.EGO)
        b.start(SERVICE, CanConfig(buses=(BusConfig(recording=str(path), loop=True),)))
        ego = egos.wait(lambda ego: ego.speed_mps is not None)
        told = health.wait(lambda each: f"replaying {path.name}: " in each.detail.get("bus can0", ""))
        refused = b.call("send_obd_request", {"service": 1, "pid": 13, "timeout_s": 0.5})
    assert ego.speed_mps == pytest.approx(13.9, abs=0.02)
    assert "malformed" not in told.detail["bus can0"]
    assert refused.result is not None
    assert "is a recording" in refused.result["message"]


def test_a_recording_is_stepped_by_calls(tmp_path: Path, patient: str) -> None:
    path = write(tmp_path / "drive.log", drive(3.0))
    with bus() as b:
        egos = b.collect(topics.EGO)
        b.start(SERVICE, CanConfig(profile=patient, buses=(BusConfig(recording=str(path), step_ms=20.0),)))
        assert not any(ego.speed_mps for ego in egos.messages)
        outcome = b.call("step_recording", {"steps": 5})
        ego = egos.wait(lambda ego: ego.speed_mps is not None)
        end = b.call("step_recording", {"steps": 1000})
        wrong = b.call("step_recording", {"bus": "x"})
    assert outcome.result is not None
    assert outcome.result["position_s"] == pytest.approx(0.1)
    assert ego.speed_mps == pytest.approx(13.9, abs=0.02)
    assert end.result is not None
    assert end.result["ended"]
    assert "no stepped recording on bus 'x'; there are can0" in wrong.error


def test_in_lockstep_every_step_of_the_clock_is_a_step_of_two_buses_of_one_log(tmp_path: Path) -> None:
    path = tmp_path / "two.asc"
    with can.Logger(str(path)) as logger:
        for number, frame in enumerate(drive(3.0)):
            message = to_message(frame)
            message.channel = number % 2
            logger.on_message_received(message)
    profile = tmp_path / "profile.toml"
    profile.write_text(
        f'name = "two"\n[buses.a]\ndescription = "{data("vehicles/sim/sim.dbc")}"\n'
        f'[buses.b]\ndescription = "{data("vehicles/sim/sim.dbc")}"\n'
        "[vehicle]\ntyre_nominal_bar = [2.4, 2.4, 2.4, 2.4]\n[fields]\n"
    )
    buses = tuple(BusConfig(name=name, recording=str(path), channel=n, step_ms=20.0) for n, name in enumerate("ab"))
    with bus() as b:
        node = b.start(SERVICE, CanConfig(lockstep=True, buses=buses, profile=str(profile)))
        conductor = b.node("simulator", ServiceConfig(lockstep=True))
        for step in range(1, 26):
            conductor.conduct_step(step * 50_000_000, {"can"})
    told = {name: node.detail[f"bus {name}"] for name in "ab"}
    for name, other in ("ab", "ba"):
        words = told[name].split("; ")
        assert words[0].startswith("stepped two.asc: ")
        assert any(word.startswith("left out") and f"of channel {'ab'.index(other)}" in word for word in words)


@pytest.mark.parametrize(
    ("name", "text", "complaint"),
    [
        ("drive.txt", "", r"buses\[0\].recording: drive.txt is none of .asc, .blf"),
        ("none.log", None, r"buses\[0\].recording: there is no file"),
        ("drive.mf4", "", r"buses\[0\].recording: drive.mf4 takes the package asammdf: pip install asammdf"),
        ("drive.blf", "nonsense", r"buses\[0\].recording: drive.blf holds no frame to replay; 1 malformed, first drive.blf: after"),
        ("drive.log", "", r"buses\[0\].recording: drive.log holds no frame to replay; it is empty"),
    ],
)  # fmt: skip
def test_a_log_that_cannot_be_replayed_is_told_before_anything_starts(
    tmp_path: Path, name: str, text: str | None, complaint: str
) -> None:
    if text is not None:
        (tmp_path / name).write_text(text)
    with bus() as b, pytest.raises(ConfigError, match=complaint):
        b.start(SERVICE, CanConfig(buses=(BusConfig(recording=str(tmp_path / name)),)))

"""A recording as a bus: its pace, its steps, and what the service tells of it."""

from pathlib import Path

import can
import pytest

from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError
from drivemcp.files.can_logs.log import CanLog
from drivemcp.paths import data
from drivemcp.testing import bus
from proto import topics
from services.can.buses.link import to_message
from services.can.buses.opening import BusConfig
from services.can.buses.replay import Replay, Step
from services.can.service import SERVICE, CanConfig
from tests.unit.drivemcp.files.can_logs.written import CLASSIC, NS, drive, write


def log_of(tmp_path: Path, count: int = 10) -> CanLog:
    """A frame every 100 ms."""
    path = tmp_path / "even.log"
    path.write_text("".join(f"({1 + number / 10}) can0 101#{number:02X}\n" for number in range(count)))
    return CanLog(path)


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
    assert "no stepped recording on bus 'x' [field: bus] [do: take one of can0]" in wrong.error


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
        ("drive.txt", "", r"buses\[0\].recording: drive.txt does not end in one of .asc, .blf"),
        ("drive.candump", "(1714550400.0) can0 123#11\n", r"does not end in .*; it is a candump log under another ending: rename"),
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

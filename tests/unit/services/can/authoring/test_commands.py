"""`drivemcp can profile`: from a description to a profile, and from a drive to what is wrong in it."""

import math
from pathlib import Path

import can
import pytest

from drivemcp.cli import run
from drivemcp.paths import data
from services.can.authoring.signal_matching import HINTS
from services.can.profiles.curated import FIELDS
from services.can.profiles.profile import load_profile
from services.simulator.car.state import CarModel, Controls
from services.simulator.ecus.can_frames import FrameEncoder

START_NS = 1_000_000_000
STEP_S = 0.02


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Twelve seconds of accelerating, bends and braking, as candump writes them."""
    path = tmp_path_factory.mktemp("drive") / "drive.log"
    encoder, model = FrameEncoder(data("vehicles/sim/sim.dbc")), CarModel()
    with can.CanutilsLogWriter(path) as writer:
        for step in range(600):
            at_s = step * STEP_S
            speed, yaw = 15.0 - 8.0 * math.cos(at_s / 3.0), 0.1 * math.sin(at_s)
            controls = Controls(
                speed_mps=speed,
                acceleration_mps2=8.0 / 3.0 * math.sin(at_s / 3.0),
                yaw_rate_radps=yaw,
                road_wheel_rad=math.atan(2.8 * yaw / speed),
            )
            state = model.step(STEP_S, controls)
            for frame in encoder.due(state, START_NS + round(at_s * 1e9)):
                writer(
                    can.Message(
                        timestamp=frame.stamp_ns / 1e9,
                        arbitration_id=frame.arbitration_id,
                        is_extended_id=False,
                        data=frame.data,
                        channel="can0",
                    )
                )
    return path


@pytest.fixture
def scaffolded(tmp_path: Path) -> Path:
    assert run(["can", "profile", "new", str(data("vehicles/sim/sim.dbc")), "--out", str(tmp_path / "car")]) == 0
    return tmp_path / "car" / "profile.toml"


def test_a_profile_is_scaffolded_from_a_description_and_marks_its_guesses(scaffolded: Path) -> None:
    guessed, own = load_profile(scaffolded).fields, load_profile(data("vehicles/sim/profile.toml")).fields
    right = [name for name, rule in guessed.items() if name in own and rule.signals == own[name].signals]
    assert len(right) >= 55
    assert [name for name in guessed if name not in right] == []
    assert guessed["speed_mps"].counter == "", "the description declares it"
    lines = [line for line in scaffolded.read_text(encoding="utf-8").splitlines() if " = { " in line]
    assert all("# guess" in line or line.startswith("# ") for line in lines)


def test_every_curated_field_is_looked_for() -> None:
    assert HINTS.keys() == FIELDS.keys()


def test_range_cycle_and_counter_of_the_description_shape_a_guess(tmp_path: Path) -> None:
    dbc = tmp_path / "plain.dbc"
    dbc.write_text(
        """VERSION ""
BU_: A
BO_ 1 Motion: 8 A
 SG_ VehicleSpeed : 0|16@1+ (0.01,0) [0|180] "km/h" A
 SG_ YawRate : 16|16@1- (0.01,0) [0|0] "" A
 SG_ RollingCounter : 48|4@1+ (1,0) [0|15] "" A
BA_DEF_ BO_ "GenMsgCycleTime" INT 0 10000;
BA_DEF_DEF_ "GenMsgCycleTime" 0;
BA_ "GenMsgCycleTime" BO_ 1 100;
""",
        encoding="utf-8",
    )
    assert run(["can", "profile", "new", str(dbc), "--out", str(tmp_path / "car"), "--bus", "chassis"]) == 0
    profile = load_profile(tmp_path / "car" / "profile.toml")
    speed = profile.fields["speed_mps"]
    assert (speed.minimum, speed.maximum, speed.max_age_s, speed.counter) == (0.0, 50.0, 0.5, "RollingCounter")
    assert "yaw_rate_radps" not in profile.fields, "a unit that nobody states is the engineer's to find"
    assert list(profile.buses) == ["chassis"]


def test_a_profile_is_never_written_over(scaffolded: Path) -> None:
    dbc = str(data("vehicles/sim/sim.dbc"))
    assert run(["can", "profile", "new", dbc, "--out", str(scaffolded.parent)]) == 2


def test_a_sound_profile_agrees_with_its_drive(drive: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run(["can", "profile", "check", str(data("vehicles/sim/profile.toml")), "--log", str(drive)])
    told = capsys.readouterr().out
    assert "sound" in told
    assert "OPPOSITE" not in told
    assert "UNIT OR FACTOR" not in told
    for field in ("acceleration_mps2", "lateral_acceleration_mps2", "yaw_rate_radps", "wheel_fl_mps"):
        assert f"{field:28} agrees" in told


@pytest.mark.parametrize(
    ("field", "key", "verdict"),
    [
        ("acceleration_mps2", "sign = -1", "OPPOSITE SIGN"),
        ("yaw_rate_radps", "sign = -1", "OPPOSITE SIGN"),
        ("lateral_acceleration_mps2", "sign = -1", "OPPOSITE SIGN"),
        ("wheel_rl_mps", 'dbc_unit = "m/s"', "UNIT OR FACTOR: 3.6 times too much"),
    ],
)
def test_a_wrong_sign_or_unit_is_seen_in_a_drive(
    scaffolded: Path, drive: Path, capsys: pytest.CaptureFixture[str], field: str, key: str, verdict: str
) -> None:
    text = scaffolded.read_text(encoding="utf-8")
    scaffolded.write_text(text.replace(f"\n{field} = {{ ", f"\n{field} = {{ {key}, "), encoding="utf-8")
    assert run(["can", "profile", "check", str(scaffolded), "--log", str(drive)]) == 1
    assert f"{field:28} {verdict}" in capsys.readouterr().out


def test_a_field_whose_message_is_not_on_the_bus_is_told(
    scaffolded: Path, drive: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = [line for line in drive.read_text().splitlines() if " 131#" not in line]
    (scaffolded.parent / "part.log").write_text("\n".join(kept) + "\n")
    assert run(["can", "profile", "check", str(scaffolded), "--log", str(scaffolded.parent / "part.log")]) == 1
    told = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("outside_temperature_c"))
    assert "never seen" in told


def test_a_log_of_two_buses_is_checked_by_the_one_that_is_named(
    scaffolded: Path, drive: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    both = scaffolded.parent / "both.log"
    lines = drive.read_text().splitlines()
    channel = lines[0].split()[1]
    both.write_text("".join(f"{line}\n{line.replace(f' {channel} ', ' other ')}\n" for line in lines))
    arguments = ["can", "profile", "check", str(scaffolded), "--log", str(both)]
    assert run(arguments) == 2
    assert f"channel {channel} ({len(lines)} frames), channel other" in capsys.readouterr().err
    assert run([*arguments, "--channel", channel]) == 0
    assert f"left out {len(lines)} frames of channel other" in capsys.readouterr().out


def test_a_log_without_a_frame_is_no_drive(scaffolded: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (scaffolded.parent / "empty.log").write_text("what is this\n")
    assert run(["can", "profile", "check", str(scaffolded), "--log", str(scaffolded.parent / "empty.log")]) == 2
    assert "empty.log holds no frame: 1 malformed" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["new", "no.dbc"], "no.dbc cannot be read"),
        (["check", "no.toml"], "no.toml"),
        (["check", str(data("vehicles/sim/profile.toml")), "--log", "body=x.log"], "there are can0"),
        (["check", str(data("vehicles/sim/profile.toml")), "--log", "x.pdf"], "x.pdf"),
    ],
)
def test_a_mistake_is_told_in_one_line(
    arguments: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["can", "profile", *arguments]) in (1, 2)
    told = capsys.readouterr().err
    assert complaint in told
    assert told.count("\n") == 1

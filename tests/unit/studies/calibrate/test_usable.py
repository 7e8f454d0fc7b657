"""What may be calibrated on: drives of the calibration split in which nobody braked, and recordings of a car."""

from pathlib import Path
from typing import Any

import msgspec
import pytest
from mcap.writer import CompressionType, Writer

from drivemcp.cli import run
from drivemcp.errors import UserError
from evaluation.campaign.store import SPEC
from evaluation.run.methods import METHODS, applied
from evaluation.run.spec import RunSpec
from proto import topics
from proto.truth import ScenarioState
from studies.calibrate.constants import shipped
from studies.calibrate.drives import NOBODY_BRAKES
from studies.calibrate.files import Provenance, profile_text
from studies.calibrate.search import Trial
from studies.calibrate.usable import usable
from tests.unit.services.arbiter.support import CALIBRATED

QUIET: dict[str, dict[str, Any]] = {"arbiter": dict(NOBODY_BRAKES)}


def log(folder: Path, scenario: str) -> Path:
    """A log that tells which scenario the simulator drives; of a car's drive it tells none."""
    folder.mkdir()
    with (path := folder / "log.mcap").open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start()
        schema = writer.register_schema(name="drivemcp.X", encoding="jsonschema", data=b"{}")
        state = ScenarioState(scenario=scenario, seed=1, time_s=0.5, duration_s=9.0, running=True)
        sent = {topics.SCENARIO.name: msgspec.json.encode(state)} if scenario else {topics.EGO.name: b"{}"}
        for name, data in sent.items():
            channel = writer.register_channel(schema_id=schema, topic=name, message_encoding="json")
            writer.add_message(channel_id=channel, log_time=1, publish_time=1, data=data)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def driven(folder: Path, place: str, settings: dict[str, dict[str, Any]] = QUIET, method: str = "DriveMCP") -> Path:
    path = log(folder, place.replace("/", "-"))
    spec = applied(METHODS[method], RunSpec(scenario=place, settings=settings, sensors="model"))
    (folder / SPEC).write_bytes(msgspec.json.encode(spec))
    return path


@pytest.mark.parametrize("split", ["test", "development"])
def test_drives_of_the_splits_that_judge_are_refused(tmp_path: Path, split: str) -> None:
    fine = driven(tmp_path / "fine", "urb-rain/calibration/0")
    wrong = driven(tmp_path / "wrong", f"cross-border/{split}/3")
    with pytest.raises(UserError, match=rf"wrong/log\.mcap is a drive of cross-border/{split}/3"):
        usable([fine, wrong])


def test_the_command_refuses_them_before_it_tries_anything(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    wrong = driven(tmp_path / "wrong", "urb-rain/test/3")
    assert run(["calibrate", "--from", str(wrong), "--out", str(tmp_path / "out"), "--quick"]) == 2
    assert "is a drive of urb-rain/test/3" in capsys.readouterr().err


@pytest.mark.parametrize("spec", [True, False])
def test_a_test_scenario_that_was_driven_from_a_file_is_known_by_its_log(tmp_path: Path, spec: bool) -> None:
    path = log(tmp_path / "a", "urb-rain-test-0")
    if spec:
        (path.parent / SPEC).write_bytes(msgspec.json.encode(RunSpec(scenario="mine.json", settings=QUIET)))
    with pytest.raises(UserError, match="is a drive of urb-rain/test/0"):
        usable([path])


def test_a_simulated_drive_without_its_spec_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"simulated drive of urb-rain-calibration-0, and no spec"):
        usable([log(tmp_path / "a", "urb-rain-calibration-0")])


def test_drives_in_which_an_arbiter_may_have_braked_and_those_of_other_methods_are_left_out(tmp_path: Path) -> None:
    fine = driven(tmp_path / "fine", "urb-rain/calibration/0")
    braked = driven(tmp_path / "braked", "urb-rain/calibration/0", {})
    other = driven(tmp_path / "other", "urb-rain/calibration/0", method="VLM-Tools-NoArbiter")
    assert usable([fine, braked, other]) == ((fine,), 2, "calibration drives")
    with pytest.raises(UserError, match="in all 2 drives the arbiter may have braked"):
        usable([braked, other])


def test_a_recording_of_a_car_is_taken_and_called_so_in_the_profile(tmp_path: Path) -> None:
    fine, car = driven(tmp_path / "fine", "urb-rain/calibration/0"), log(tmp_path / "car", "")
    assert usable([fine, car]) == ((fine, car), 0, "recordings")
    best = shipped(CALIBRATED).moved("tau_s", 3.9)
    trial = Trial(candidate=best, objective=1.0)
    provenance = Provenance(
        made="", code="", command="", machine="", places=(), drives=usable([car]).kind, km=2.0, sensors="unknown",
        optimiser="", seed=1, trials=1, objective="", before=trial, after=trial, verdict="Taken.",
    )  # fmt: skip
    text = profile_text("fitted", best, "calibrated", provenance)
    assert "Fitted on 2.0 km of recordings: tau_s" in text
    assert "# km: 2.00 of recordings" in text
    assert "calibration drives" not in text

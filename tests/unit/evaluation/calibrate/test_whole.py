"""The whole way on one short drive: recorded, decided again, searched, written, and loaded by the arbiter."""

from pathlib import Path

import msgspec
import pytest

from drivemcp.cli import run
from drivemcp.errors import UserError
from evaluation.calibrate import drives
from evaluation.calibrate.again import again
from evaluation.calibrate.constants import shipped
from evaluation.calibrate.files import Provenance
from evaluation.calibrate.margins import as_if_asked
from evaluation.calibrate.recordings import Recording, find, load
from evaluation.calibrate.search import on_cores
from evaluation.evaluate.store import Store
from services.arbiter.profiles import load as load_profile
from services.orchestrator.inputs import Method
from tests.unit.services.arbiter.support import CALIBRATED

SECONDS = 6.0


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One drive of the calibration split in which nobody brakes."""
    store = Store(tmp_path_factory.mktemp("runs"))
    settings = {"arbiter": dict(drives.NOBODY_BRAKES)}
    spec = drives.specs("calibration", [0], "model", SECONDS, settings)[0]
    assert drives.driven(store, [spec], 1, lambda *_: None) == {}
    (found,) = drives.logs(store, [spec])
    return found


@pytest.fixture(scope="module")
def recording(log: Path) -> Recording:
    return load(log)


def test_with_the_constants_that_it_was_driven_with_a_drive_comes_out_as_it_was(recording: Recording) -> None:
    driven_with = msgspec.structs.replace(CALIBRATED, delta=drives.NOBODY_BRAKES["delta"])
    found = again(recording, shipped(CALIBRATED), driven_with)
    measured = {"event_to_advice_ms": None, "snapshot_to_advice_ms": None}
    assert len(found.advisories) > 10 * SECONDS / 2
    assert any(each.message.kind == "SPEAK" for each in found.advisories)
    for then, now in zip(recording.record.advisories, found.advisories, strict=True):
        assert msgspec.structs.replace(then.message, **measured) == now.message
    for then_tick, now_tick in zip(recording.record.traces, found.traces, strict=True):
        assert then_tick.message.events == now_tick.message.events


def test_as_if_the_arbiter_had_been_asked_is_as_when_it_was(recording: Recording) -> None:
    silent = Method(name="silent")
    untold = recording._replace(
        steps=tuple(
            step._replace(own=None, seen=msgspec.structs.replace(step.seen, method=silent)) for step in recording.steps
        )
    )
    asked = as_if_asked(untold, CALIBRATED)
    pairs = [(then.own, now.own) for then, now in zip(recording.steps, asked.steps, strict=True)]
    assert all(then is not None and now is not None and then.reading == now.reading for then, now in pairs)
    assert [step.seen for step in asked.steps] == [step.seen for step in recording.steps]


def test_other_constants_make_another_drive(recording: Recording) -> None:
    mute = shipped(CALIBRATED).moved("budget_messages", 0.0)
    as_shipped = again(recording, shipped(CALIBRATED), CALIBRATED)
    assert len(again(recording, mute, CALIBRATED).spoken) < len(as_shipped.spoken)
    deaf = shipped(CALIBRATED).moved("event.overspeed", 99.0).moved("event.closing_lead", 99.0)
    assert "overspeed" not in {e.kind for t in again(recording, deaf, CALIBRATED).traces for e in t.message.events}


def test_processes_side_by_side_count_what_one_counts(log: Path, tmp_path: Path) -> None:
    twin = tmp_path / "twin" / log.name
    twin.parent.mkdir()
    for file in log.parent.iterdir():
        if file.is_file():
            (twin.parent / file.name).write_bytes(file.read_bytes())
    with on_cores([log, twin], CALIBRATED, 1) as one, on_cores([log, twin], CALIBRATED, 2) as two:
        assert one(shipped(CALIBRATED)) == two(shipped(CALIBRATED))


def test_the_command_leaves_a_profile_that_the_arbiter_loads(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["calibrate", "--from", str(log), "--quick", "--verify", "0", "--points", "2", "--jobs", "1"]
    assert run([*words, "--out", str(tmp_path)]) == 0
    told = capsys.readouterr()
    assert f"--set arbiter.profile={tmp_path / 'profile.toml'}" in told.out
    assert "left" in told.err
    profile = load_profile(tmp_path / "profile.toml")
    provenance = msgspec.json.decode((tmp_path / "provenance.json").read_bytes(), type=Provenance)
    assert provenance.verdict.startswith("The shipped constants stay"), "nothing was driven in closed loop"
    same = msgspec.structs.replace(profile, sha256=CALIBRATED.sha256)
    assert same == CALIBRATED
    assert provenance.places == ("urb-rain/calibration/0 seed 1",)
    head = (tmp_path / "profile.toml").read_text(encoding="utf-8")
    for field in (
        "# made:",
        "# code:",
        "# places:",
        "# optimiser: CMA-ES (cma ",
        "# objective:",
        "# before:",
        "# after:",
    ):
        assert field in head
    fitted = load_profile(tmp_path / "fitted.toml")
    assert {
        key: getattr(fitted, key) for key in provenance.after.candidate.constants
    } == provenance.after.candidate.constants
    plot = (tmp_path / "sensitivity.svg").read_text(encoding="utf-8")
    assert "tau_s" in plot
    assert "event.closing_lead" in plot
    tried = (tmp_path / "trials.jsonl").read_bytes()
    assert run([*words, "--out", str(tmp_path)]) == 0
    assert (tmp_path / "trials.jsonl").read_bytes() == tried, "nothing is tried twice"


def test_what_cannot_be_calibrated_on_is_told(log: Path, tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"there is no log\.mcap"):
        find([tmp_path])
    (alone := tmp_path / log.name).write_bytes(log.read_bytes())
    with pytest.raises(UserError, match="no truth lies beside it"):
        load(alone)

"""The whole way on one short drive: recorded, decided again, searched, written, and loaded by the arbiter."""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path

import msgspec
import pytest
from mcap.writer import CompressionType, Writer

from drivemcp.cli import run
from drivemcp.errors import UserError
from evaluation.campaign.pool import Done, Job
from evaluation.campaign.store import Store
from evaluation.metrics.record import TRUTH_FILE
from evaluation.scenarios import FAMILIES
from services.arbiter.profiles.profile import load as load_profile
from services.logger.format.reader import messages
from services.orchestrator.observations.inputs import Method
from studies.calibrate import drives, whole
from studies.calibrate.again import again
from studies.calibrate.constants import shipped
from studies.calibrate.files import Provenance
from studies.calibrate.margins import as_if_asked
from studies.calibrate.recordings import Recording, find, load
from studies.calibrate.search import on_cores
from tests.unit.services.arbiter.support import CALIBRATED
from tests.unit.studies.calibrate.landscape import Landscape

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


@pytest.fixture
def crashed(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    """Which places were driven how often, where every drive crashes; what is searched in is made up."""
    found = Counter[str]()

    class Pool:
        def __init__(self, *_: object) -> None:
            pass

        def done(self, jobs: Sequence[Job]) -> Iterator[Done]:
            for job in jobs:
                found[job.spec.scenario] += 1
                yield Done(job.key, "it crashed", 0.0)

    monkeypatch.setattr(drives, "Pool", Pool)
    monkeypatch.setattr(whole, "on_cores", lambda *_: nullcontext(Landscape()))
    return found


@pytest.mark.parametrize(("words", "places"), [(("--trials", "4"), 6), (("--quick",), 1)])
def test_as_many_places_are_driven_in_closed_loop_as_verify_names(
    log: Path, tmp_path: Path, crashed: Counter[str], words: Sequence[str], places: int
) -> None:
    run(["calibrate", "--from", str(log), "--verify", "6", "--points", "2", "--out", str(tmp_path), *words])
    assert crashed == {f"{family}/calibration/{at}": 2 for family in FAMILIES for at in range(places)}


def test_drives_that_fail_in_closed_loop_are_told_with_their_constants_and_by_the_exit_status(
    log: Path, tmp_path: Path, crashed: Counter[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["calibrate", "--from", str(log), "--quick", "--points", "2", "--out", str(tmp_path)]) == 1
    told = capsys.readouterr().err
    for place in crashed:
        for whose in ("shipped", "fitted"):
            assert f"{place} with the {whose} constants failed: it crashed" in told
    assert told.count("failed: it crashed") == 6


def beside_its_truth(log: Path, folder: Path, data: bytes) -> Path:
    """Another log beside the same truth."""
    (folder / TRUTH_FILE).write_bytes((log.parent / TRUTH_FILE).read_bytes())
    (other := folder / log.name).write_bytes(data)
    return other


@pytest.mark.parametrize("share", [0.0, 0.5, 0.9, 1.0])
def test_a_log_that_was_cut_is_not_taken_for_the_whole_drive(log: Path, tmp_path: Path, share: float) -> None:
    raw = log.read_bytes()
    cut = beside_its_truth(log, tmp_path, raw[: round(share * (len(raw) - 1))])
    with pytest.raises(UserError, match=r"log\.mcap was cut, never closed or changed .*delete its folder"):
        load(cut)


@pytest.mark.parametrize("at", [10, 100_000, -10])
def test_a_log_that_is_not_as_it_was_written_is_refused(log: Path, tmp_path: Path, at: int) -> None:
    raw = bytearray(log.read_bytes())
    raw[at] ^= 1
    with pytest.raises(UserError, match=r"log\.mcap was cut, never closed or changed .*delete its folder"):
        load(beside_its_truth(log, tmp_path, bytes(raw)))


def unsigned(log: Path, folder: Path) -> bytes:
    """The same messages by another writer."""
    with (path := folder / "unsigned.mcap").open("wb") as file:
        writer = Writer(file, compression=CompressionType.NONE)
        writer.start()
        schema = writer.register_schema(name="drivemcp.X", encoding="jsonschema", data=b"{}")
        channels: dict[str, int] = {}
        for one in messages(log):
            if one.name not in channels:
                channels[one.name] = writer.register_channel(schema_id=schema, topic=one.name, message_encoding="json")
            writer.add_message(channels[one.name], one.log_time_ns, one.data, one.stamp_ns)
        writer.finish()  # type: ignore[no-untyped-call]
    return path.read_bytes()


def test_a_log_of_another_writer_is_taken_if_it_is_whole(log: Path, recording: Recording, tmp_path: Path) -> None:
    raw = unsigned(log, tmp_path)
    assert load(beside_its_truth(log, tmp_path, raw)).steps == recording.steps
    with pytest.raises(UserError, match="was cut"):
        load(beside_its_truth(log, tmp_path, raw[: len(raw) // 2]))

"""A run measured as it goes and measured from its log."""

import gzip
import random
from pathlib import Path

import msgspec
import pytest

from drivemcp.errors import UserError
from evaluation.metrics import TRUTH_FILE, At, Record, Recorder, from_log, keep, measure, record
from evaluation.metrics.__main__ import main
from evaluation.run.host import drive
from evaluation.run.spec import RunSpec
from proto import topics
from proto.truth import Corrupted, CorruptionKind
from tests.unit.evaluation.metrics.logs import said, steady


def test_the_log_and_the_truth_beside_it_measure_the_same_as_the_run(tmp_path: Path) -> None:
    recorder = Recorder()
    drive(RunSpec(scenario="dynamic-vsl", seed=3, seconds=1.5), tmp_path, recorder.follow)
    (log,) = tmp_path.glob("**/*.mcap")
    live = recorder.record()
    assert (len(live.truths), live.truths[0].time_s) == (30, 0.05)
    assert 0.0 <= live.advisories[0].time_s <= 0.2
    assert len(live.advisories) == len(live.traces) == len(live.decisions)

    alone = measure(from_log(log))
    assert (alone.infractions, alone.messages) == (None, measure(live).messages)
    assert alone.seconds > 1.0
    alone_outcome = from_log(log).outcome()

    assert keep(recorder, log.parent).name == TRUTH_FILE
    again = from_log(log)
    assert again.truths == live.truths
    assert measure(again) == measure(live)
    assert again.outcome() == live.outcome() != alone_outcome
    assert msgspec.json.decode(msgspec.json.encode(measure(live)), type=type(measure(live))) == measure(live)


def test_what_was_corrupted_is_counted_live_and_from_the_log(tmp_path: Path) -> None:
    # at 120 km/h the first gantry, 200 m on, is met within the 6 s
    recorder = Recorder()
    spec = RunSpec(scenario="dynamic-vsl", seed=3, seconds=6.0, sensors="model", corruption="sign_miss=1")
    drive(spec, tmp_path, recorder.follow)
    (log,) = tmp_path.glob("**/*.mcap")
    live, again = measure(recorder.record()), measure(from_log(log))
    assert live.signs_corrupted == live.signs_drawn > 0
    assert (again.signs_corrupted, again.signs_drawn) == (live.signs_corrupted, live.signs_drawn)


def test_the_share_that_a_rate_came_to_is_of_signs_and_not_of_windows() -> None:
    told: list[tuple[CorruptionKind, bool]] = [
        ("sign_miss", True), ("sign_miss", False), ("limit_misread", False), ("dropout", True)
    ]  # fmt: skip
    corrupted = tuple(At(1.0, Corrupted(kind=kind, subject="x", stamp_ns=1, hit=hit)) for kind, hit in told)
    found = measure(Record(corrupted=corrupted))
    assert (found.signs_corrupted, found.signs_drawn) == (1, 3)


def test_a_truth_of_another_version_is_named(tmp_path: Path) -> None:
    log = tmp_path / "log.mcap"
    log.write_bytes(b"")
    (tmp_path / TRUTH_FILE).write_bytes(gzip.compress(msgspec.msgpack.encode([(1, {"time_s": "soon"})])))
    with pytest.raises(UserError, match="does not fit this version's Truth"):
        from_log(log)


@pytest.mark.parametrize(
    "data", [b'{"kind":"\xff"}', b'{"unknown":' + b"[" * 100_000], ids=["no UTF-8", "nested too deep"]
)
def test_a_message_that_cannot_be_decoded_is_named_with_its_topic(data: bytes) -> None:
    with pytest.raises(UserError, match=r"log\.mcap: arbiter/decision does not fit this version"):
        record._decoded(topics.DECISION, data, Path("log.mcap"))


CUT = gzip.compress(b"truth" * 100)[:-20]
SPOILED = gzip.compress(random.Random(0).randbytes(1000))
SPOILED = SPOILED[:12] + bytes(each ^ 255 for each in SPOILED[12:40]) + SPOILED[40:]


@pytest.mark.parametrize("truth", [b"no truth", CUT, SPOILED], ids=["no gzip file", "cut", "spoiled"])
def test_a_damaged_truth_is_named(tmp_path: Path, truth: bytes, capsys: pytest.CaptureFixture[str]) -> None:
    (log := tmp_path / "log.mcap").write_bytes(b"")
    (tmp_path / TRUTH_FILE).write_bytes(truth)
    with pytest.raises(UserError, match=rf"{TRUTH_FILE}: the truth is damaged: "):
        from_log(log)
    assert main([str(log)]) == 2
    assert "the truth is damaged" in capsys.readouterr().err


def test_truth_is_found_by_time() -> None:
    kept = Record(truths=steady(2.0), advisories=(said(1.0),))
    found = kept.truth_at(1.02)
    assert found is not None
    assert found.time_s == 1.0
    assert [truth.time_s for truth in kept.truths_between(0.5, 0.6)] == [0.5, 0.55, 0.6]
    assert Record().truth_at(1.0) is None

"""All methods on the snapshots of one log."""

from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.replay.again import traces
from drivemcp.errors import UserError
from evaluation.metrics import TRUTH_FILE, from_log, measure
from evaluation.run.methods import METHODS
from studies.openloop.answers import Answered, answers, waited_ms
from studies.openloop.table import OPEN, main, rows, sheet
from tests.unit.app.replay.drive import write_log


def run(log: Path, label: str) -> list[Answered]:
    return list(answers(log, METHODS[label]))


def test_each_method_answers_every_snapshot_with_the_tools_it_has(log: Path) -> None:
    full, direct, open_ = (run(log, label) for label in ("DriveMCP", "VLM-Direct", "VLM-Tools-NoArbiter"))
    assert len(full) >= 20
    assert [each.stamp_ns for each in full] == [each.stamp_ns for each in direct] == [each.stamp_ns for each in open_]
    asked = [{tool for each in rows for tool in each.tools} for rows in (full, direct, open_)]
    assert "applicable_limit" in asked[0]
    assert asked[0] == asked[2]
    assert asked[1] <= {"answer_prompt"}
    assert all(each.kind in ("SILENT", "SPEAK") for each in direct)
    assert all(each.latency_ms > 0.0 for each in full)


@given(live_ms=st.floats(0.0, 1e3), logged_ms=st.lists(st.floats(0.0, 1e3)))
def test_side_by_side_a_tick_takes_as_long_as_its_slowest_call_and_one_by_one_as_all_together(
    live_ms: float, logged_ms: list[float]
) -> None:
    assert live_ms + waited_ms(live_ms, logged_ms, parallel=True) == pytest.approx(max([live_ms, *logged_ms]))
    assert waited_ms(live_ms, logged_ms, parallel=False) == pytest.approx(sum(logged_ms))


def test_the_oracle_needs_a_drive_of_its_own(log: Path) -> None:
    with pytest.raises(UserError, match="drive of its own"):
        run(log, "Oracle")


def test_the_table_scores_every_method_that_can_be_asked_on_the_same_snapshots(log: Path) -> None:
    found = {row.label: row for row in rows([log])}
    assert list(found) == [method.label for method in OPEN]
    assert {"VLM-Direct", "VLM-Direct+RAG", "DriveMCP"} <= set(found)
    driven, ours, direct = measure(from_log(log)), found["DriveMCP"], found["VLM-Direct"]
    assert len({row.ticks for row in found.values()}) == 1
    assert driven.event_f1 is not None
    assert ours.event_f1 == pytest.approx(driven.event_f1), "asked again about its own drive, it notices the same"
    assert ours.tools_right == pytest.approx(driven.correct_tool_rate)
    assert direct.tools_right is not None
    assert ours.tools_right is not None
    assert direct.tools_right < ours.tools_right, "it has no tools to be right with"
    assert ours.asked_p50_ms is not None
    assert ours.tick_p50_ms is not None
    assert 0.0 < ours.tick_p50_ms < ours.asked_p50_ms
    assert f"| DriveMCP | {ours.ticks} |" in sheet(found.values()).markdown()


def test_a_log_without_truth_is_refused(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (alone := tmp_path / "log.mcap").write_bytes(log.read_bytes())
    assert main([str(alone)]) == 2
    assert "the truth of its run is not beside it" in capsys.readouterr().err


def test_a_log_with_a_gap_is_refused(log: Path, tmp_path: Path) -> None:
    kept = [each for each in traces([log]) if each.tick != 10]
    write_log(tmp_path / "gap.mcap", kept, tmp_path / "secrets")
    with pytest.raises(UserError, match=r"gap\.mcap: tick 10 is missing: "):
        run(tmp_path / "gap.mcap", "DriveMCP")


def test_a_log_whose_truth_is_spoiled_is_named(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (alone := tmp_path / "log.mcap").write_bytes(log.read_bytes())
    truth = (log.parent / TRUTH_FILE).read_bytes()
    for spoiled in (truth[:-20], truth[:40] + bytes(each ^ 255 for each in truth[40:400]) + truth[400:]):
        (tmp_path / TRUTH_FILE).write_bytes(spoiled)
        assert main([str(alone)]) == 2
        assert f"{tmp_path / TRUTH_FILE}: " in capsys.readouterr().err


def test_a_log_of_another_version_is_named(log: Path, tmp_path: Path) -> None:
    first, second = list(traces([log]))[:2]
    old = msgspec.structs.replace(first.decision, own={"reading": 3})
    for name, trace in (
        ("inputs", msgspec.structs.replace(second, inputs={"now_ns": "noon"})),
        ("own", msgspec.structs.replace(second, decision=old)),
    ):
        write_log(tmp_path / f"{name}.mcap", [first, trace], tmp_path / "secrets")
        with pytest.raises(UserError, match=rf"{name}\.mcap: tick 2 does not fit this version: .*; drive it anew"):
            run(tmp_path / f"{name}.mcap", "DriveMCP")


@pytest.mark.parametrize("share", [0.3, 0.6, 0.95])
def test_a_log_that_was_cut_short_is_refused(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], share: float
) -> None:
    (tmp_path / TRUTH_FILE).write_bytes((log.parent / TRUTH_FILE).read_bytes())
    whole = log.read_bytes()
    (cut := tmp_path / "log.mcap").write_bytes(whole[: int(share * len(whole))])
    assert main([str(cut)]) == 2
    assert f"{cut}: it is not as it was written: " in capsys.readouterr().err


def test_a_log_that_was_altered_is_refused(log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / TRUTH_FILE).write_bytes((log.parent / TRUTH_FILE).read_bytes())
    altered = bytearray(log.read_bytes())
    altered[len(altered) // 2] ^= 1
    (other := tmp_path / "log.mcap").write_bytes(altered)
    assert main([str(other)]) == 2
    assert f"{other}: it is not as it was written: " in capsys.readouterr().err


@pytest.mark.parametrize("made", [False, True])
def test_a_log_that_is_none_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str], made: bool) -> None:
    if made:
        (tmp_path / "log.mcap").touch()
    assert main([str(tmp_path / "log.mcap")]) == 2
    assert str(tmp_path / "log.mcap") in capsys.readouterr().err

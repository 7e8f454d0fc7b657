"""All methods on the snapshots of one log."""

from pathlib import Path

import pytest

from drivemcp.errors import UserError
from evaluation.methods import METHODS
from evaluation.openloop import Answered, answers
from evaluation.run.host import drive
from evaluation.run.spec import RunSpec


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("open")
    drive(RunSpec(scenario="dynamic-vsl", seed=3, seconds=3.0), folder)
    (found,) = folder.glob("**/*.mcap")
    return found


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


def test_the_oracle_needs_a_drive_of_its_own(log: Path) -> None:
    with pytest.raises(UserError, match="drive of its own"):
        run(log, "Oracle")

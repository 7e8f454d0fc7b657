"""`drivemcp up --corrupt`: the whole stack drives with it, twice alike, and the log verifies and replays."""

import json
from pathlib import Path

import pytest

from evaluation.corruption.logged import logged_records
from evaluation.corruption.record import read_records
from proto.truth import Corrupted
from services.logger.format.reader import messages
from tests.stack.test_drive import cli, traces, up

pytestmark = pytest.mark.stack
SPEC = "sign_miss=1,dropout=0.3,lidar_loss=0.3,freeze=0.1,jitter_ms=10,seed=4"


def corrupted(folder: Path) -> tuple[tuple[Corrupted, ...], list[tuple[object, ...]], set[str], bytes]:
    """What was corrupted, what each tick came to, the kinds of facts that reached it, and the distance driven."""
    ran = up(folder, "--scenario", "cross-border", "--seconds", "8", "--lockstep", "--corrupt", SPEC, timeout_s=400)
    assert ran.returncode == 0, ran.stderr[-3000:]
    summary = json.loads(ran.stdout.strip().splitlines()[-1])
    assert summary["log_verified"] is True
    assert cli("replay", summary["log"]).returncode == 0
    log = Path(summary["log"])
    assert "sign_miss" in ran.stderr
    assert sorted(logged_records(log), key=repr) == sorted(read_records(log.parents[1]), key=repr)
    return read_records(log.parents[1]), traces(log), kinds_of(log), str(summary["distance_m"]).encode()


def kinds_of(log: Path) -> set[str]:
    """The kinds of facts in the traces."""
    records = (json.loads(record.data) for record in messages(log) if record.name.endswith("trace"))
    return {
        fact["kind"] for trace in records for facts in trace["inputs"]["facts"] for fact in facts["message"]["facts"]
    }


def test_two_corrupted_lockstep_drives_are_alike_and_see_no_sign(tmp_path: Path) -> None:
    once, again = corrupted(tmp_path / "first"), corrupted(tmp_path / "second")
    assert once[0]
    assert {record.kind for record in once[0]} >= {"sign_miss", "dropout", "lidar_loss"}
    assert sorted(once[0], key=repr) == sorted(again[0], key=repr)
    assert once[1:] == again[1:]
    assert once[2] & {"limit", "sign", "message"} == set()
    assert "jurisdiction" in once[2]


def test_a_mistake_in_the_corruption_is_told_before_anything_starts(tmp_path: Path) -> None:
    ran = up(tmp_path, "--corrupt", "sign_mis=0.1")
    assert ran.returncode == 2
    assert "sign_mis" in ran.stderr
    assert list(tmp_path.iterdir()) == []

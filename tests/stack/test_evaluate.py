"""`drivemcp evaluate` whole: driven, interrupted, gone on with, reported, replayed."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from drivemcp.cli import run

pytestmark = pytest.mark.stack
LONGEST_S = 1500.0
ROOT = Path(__file__).parents[2]
COMMAND = ("evaluate", "delta", "--quick", "--jobs", "2")
RAY = ("evaluate", "can-fault", "--quick", "--method", "DriveMCP", "--sensors", "model")


def finished(folder: Path) -> dict[str, float]:
    """Run -> when it was finished."""
    return {
        path.parent.name: path.stat().st_mtime
        for path in folder.glob("runs/*/metrics.json")
        if path.parent.suffix == ""
    }


def test_an_interrupted_table_goes_on_where_it_was_and_its_logs_replay(tmp_path: Path) -> None:
    out = tmp_path / "out"
    process = subprocess.Popen([sys.executable, "-m", "drivemcp.cli", *COMMAND, "--out", str(out)])
    try:
        until_s = time.monotonic() + LONGEST_S
        while not finished(out) and process.poll() is None and time.monotonic() < until_s:
            with pytest.raises(subprocess.TimeoutExpired):
                process.wait(0.5)
        process.send_signal(signal.SIGINT)
        assert process.wait(120) == 130
    finally:
        process.kill()
    before = finished(out)
    assert before
    assert run([*COMMAND, "--out", str(out)]) == 0
    after = finished(out)
    assert len(after) == 7
    assert before.items() <= after.items(), "what was finished was not driven again"
    text = (out / "report.html").read_text(encoding="utf-8")
    logs = set(re.findall(r'href="(runs/[^"]+/log\.mcap)"', text))
    assert len(logs) == 7
    assert run(["replay", str(out / sorted(logs)[0])]) == 0


@pytest.mark.filterwarnings("ignore")
def test_a_ray_cluster_drives_the_same_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]))
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    assert run([*RAY, "--ray", "local", "--out", str(tmp_path / "ray")]) == 0
    assert run([*RAY, "--out", str(tmp_path / "pool")]) == 0
    ours, theirs = (came_to(tmp_path / name) for name in ("pool", "ray"))
    assert len(ours) == 2
    assert ours == theirs


def came_to(out: Path) -> dict[str, str]:
    """Run -> what it came to."""
    return {path.parent.name: json.loads(path.read_text())["outcome"] for path in out.glob("runs/*/metrics.json")}

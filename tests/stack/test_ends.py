"""What is left when `drivemcp up` is killed, and what a lockstep drive says when a service ends."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from drivemcp.bus.session import wait_settled
from drivemcp.client import RunningStack
from tests.stack.marked import marked

ROOT = Path(__file__).parents[2]
pytestmark = [pytest.mark.stack, pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")]


@contextmanager
def up(folder: Path, *arguments: str) -> Iterator[subprocess.Popen[str]]:
    """`drivemcp up` with a mark in its environment, which all that it starts inherits."""
    command = [sys.executable, "-m", "drivemcp.cli", "up", "--headless", "--out", str(folder), *arguments]
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder)}
    process = subprocess.Popen(command, cwd=ROOT, env=environment, stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate(timeout=20.0)
        for pid in marked(folder):
            os.kill(pid, signal.SIGKILL)


def drives(folder: Path) -> bool:
    """Whether the stack noted itself, and its simulator runs."""
    noted = folder / f"drivemcp-{os.getuid()}" / "stack.json"
    return noted.exists() and any("services.simulator" in line for line in marked(folder).values())


def test_up_that_is_killed_leaves_no_process(tmp_path: Path) -> None:
    with up(tmp_path, "--seconds", "600") as process:
        assert wait_settled(lambda: drives(tmp_path), 120.0)
        assert len(marked(tmp_path)) > 10
        process.kill()
        process.wait(10.0)
        assert wait_settled(lambda: not marked(tmp_path), 30.0), marked(tmp_path)
    logs = sorted(tmp_path.rglob("*.mcap"))
    verified = subprocess.run(
        [sys.executable, "-m", "drivemcp.cli", "audit", "verify", "--closed", *map(str, logs)],
        cwd=ROOT, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert verified.returncode == 0, verified.stdout


def test_a_lockstep_drive_whose_service_ends_says_so_at_once(tmp_path: Path) -> None:
    with up(tmp_path, "--lockstep", "--seconds", "600") as process:
        assert wait_settled(lambda: drives(tmp_path), 120.0)
        stack = json.loads((tmp_path / f"drivemcp-{os.getuid()}" / "stack.json").read_text())
        folder = Path(RunningStack(**stack).folder)
        log = folder / "log" / "simulator.log"
        assert wait_settled(lambda: any(one.stat().st_size > 200_000 for one in folder.glob("logs/*.mcap")), 120.0)
        (pid,) = [pid for pid, line in marked(tmp_path).items() if "services.weather" in line]
        os.kill(pid, signal.SIGKILL)
        assert wait_settled(lambda: "the drive ends" in log.read_text(), 15.0)  # a step may be under way
        _, said = process.communicate(timeout=60.0)
    assert process.returncode == 1
    assert "weather ended" in said

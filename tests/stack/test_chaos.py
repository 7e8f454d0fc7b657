"""Drives that are disturbed: processes killed and stopped, a network that loses, a disk, memory, files and a clock that fail.

Judged alike: nothing hangs, advice comes back, and while something is missing it is no less careful than before; what was lost stands in
summary and exit status, and the log verifies. Times are of an idle machine, and are stretched by how long the drive took to start.
`make chaos` tells what it saw; CHAOS_SEED chooses order and moments.
"""

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.stack.chaos.drive import ROOT, Drive, Ended, driving, pause
from tests.stack.chaos.judge import NOTICED_MPS, SOON_S, Verdict, judge, slowness
from tests.stack.chaos.surroundings import Clock, few_files, network, small_disk, without_shared_memory

pytestmark = [pytest.mark.stack, pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")]
PROCESSES = (
    "perception", "drivelm", "can", "weather", "rules", "retrieval", "arbiter", "orchestrator", "logger", "gateway", "cockpit",
    "router", "simulator",
)  # fmt: skip
SETTLES_S = 8.0
"""Watched after a disturbance."""
LONG = ("--seconds", "3000")


@pytest.fixture
def tell(capsys: pytest.CaptureFixture[str]) -> Iterator[list[str]]:
    """Lines that are told at the end, whatever came of the test."""
    lines: list[str] = []
    yield lines
    with capsys.disabled():
        sys.stdout.write("\n" + "".join(f"  {line}\n" for line in lines))


def verified(ended: Ended) -> bool:
    """Whether `drivemcp audit verify` passes every file of the log."""
    command = [sys.executable, "-m", "drivemcp.cli", "audit", "verify", *map(str, ended.logs)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    return bool(ended.logs) and done.returncode == 0


def check_end(ended: Ended, tell: list[str]) -> None:
    """The log verifies, and status and summary agree on what is missing from it."""
    summary = ended.summary
    tell.append(
        f"ended with {ended.status} in {ended.took_s:.1f} s; {summary['log_missed']} did not reach the logger, "
        f"{summary['log_lost']} could not be written; {summary['log_trouble'] or 'log whole'}; "
        f"restarts {sum(summary['restarts'].values())}"
    )
    assert verified(ended), ended.said
    assert summary["log_verified"] is True
    assert (ended.status == 0) == (not summary["log_trouble"]), ended.said
    assert bool(summary["log_trouble"]) == ("the log is not whole" in ended.said)


def check(verdicts: list[Verdict], slow: float, tell: list[str]) -> None:
    """The same of every disturbance."""
    tell.append(f"machine {slow:.2f} times slower than idle")
    tell.extend(verdict.line() for verdict in verdicts)
    late = [one.line() for one in verdicts if one.silent_s > one.lasted_s + SOON_S * slow]
    assert not late, late
    bold = [one.line() for one in verdicts if one.rise_mps > NOTICED_MPS]
    assert not bold, bold


def started_s(drive: Drive) -> float:
    """How long it took to its 30th tick."""
    return drive.seen()[29].at_s - drive.begun_s


@pytest.mark.parametrize("third", [0, 1, 2])
@pytest.mark.parametrize(("how", "lasts_s"), [("killed", 0.0), ("stopped", 3.0), ("stopped", 20.0)])
def test_each_process_killed_or_stopped(tmp_path: Path, tell: list[str], how: str, lasts_s: float, third: int) -> None:
    chance = random.Random(f"{os.environ.get('CHAOS_SEED', '1')} {how} {lasts_s}")
    names = chance.sample(PROCESSES, len(PROCESSES))[third::3]
    marks: list[tuple[str, float, float, float]] = []
    with driving(tmp_path, *LONG) as drive:
        slow = slowness(started_s(drive))
        for name in names:
            pause(chance.uniform(2.0, 4.0))
            pid, from_s = drive.pid(name), time.monotonic()
            assert pid is not None, f"{name} is not running"
            os.kill(pid, signal.SIGKILL if how == "killed" else signal.SIGSTOP)
            if how == "stopped":
                pause(lasts_s)
                os.kill(pid, signal.SIGCONT)
            to_s = time.monotonic()
            assert drive.wait_seen(10, SOON_S * 3.0 * slow), f"no advice after {name} was {how}: {drive.said()}"
            pause(SETTLES_S)
            marks.append((name, from_s, to_s, time.monotonic()))
        seen = drive.seen()
        ended = drive.end()
    check([judge(f"{mark[0]} {how}", seen, *mark[1:], process=mark[0]) for mark in marks], slow, tell)
    check_end(ended, tell)
    assert set(ended.summary["restarts"]) == (set(names) if how == "killed" else set())


def test_a_network_that_parts_and_loses(tmp_path: Path, tell: list[str]) -> None:
    marks: list[tuple[str, float, float, float]] = []
    with network() as wire, driving(tmp_path, *LONG, before=wire.inside, around=wire.inside) as drive:
        slow = slowness(started_s(drive))
        for percent, lasts_s in ((10, 20.0), (40, 20.0), (100, 5.0), (100, 30.0)):
            pause(3.0)
            from_s = time.monotonic()
            with wire.losing(drive, percent):
                pause(lasts_s)
            to_s = time.monotonic()
            assert drive.wait_seen(10, SOON_S * 5.0 * slow), drive.said()
            pause(SETTLES_S)
            marks.append((f"{percent} % of packets lost", from_s, to_s, time.monotonic()))
        seen = drive.seen()
        ended = drive.end()
    check([judge(mark[0], seen, *mark[1:]) for mark in marks], slow, tell)
    check_end(ended, tell)
    assert ended.summary["log_missed"] > 100
    assert "did not reach the logger" in ended.said


def test_a_disk_that_fills_up(tmp_path: Path, tell: list[str]) -> None:
    folder = tmp_path / "full"
    with small_disk(folder / "out", 6), driving(folder, *LONG) as drive:
        slow = slowness(started_s(drive))
        from_s = time.monotonic()
        pause(40.0)
        assert os.statvfs(folder / "out").f_bavail < 100
        seen = drive.seen()
        verdict = judge("disk of 6 MB", seen, from_s, from_s, time.monotonic())
        ended = drive.end()
        check([verdict], slow, tell)
        check_end(ended, tell)
    assert ended.status == 1
    assert ended.summary["log_lost"] > 0
    assert "No space left" in ended.summary["log_trouble"]


@pytest.mark.parametrize("lack", ["no /dev/shm", "64 files"])
def test_a_drive_that_lacks_shared_memory_or_files(tmp_path: Path, tell: list[str], lack: str) -> None:
    before = without_shared_memory() if lack == "no /dev/shm" else few_files(64)
    with driving(tmp_path, *LONG, before=before) as drive:
        slow = slowness(started_s(drive))
        from_s = time.monotonic()
        pause(15.0)
        verdict = judge(lack, drive.seen(), from_s, from_s, time.monotonic())
        ended = drive.end()
    check([verdict], slow, tell)
    check_end(ended, tell)
    assert ended.summary["restarts"] == {}


@pytest.mark.parametrize("step_s", [3600, -3600])
def test_a_clock_that_is_set(tmp_path: Path, tell: list[str], step_s: int) -> None:
    clock = Clock(tmp_path)
    with driving(tmp_path, *LONG, environment=clock.environment) as drive:
        slow = slowness(started_s(drive))
        pause(3.0)
        from_s = time.monotonic()
        clock.set_s(step_s)
        assert drive.wait_seen(10, SOON_S * 3.0 * slow), drive.said()
        pause(15.0)
        verdict = judge(f"clock set by {step_s} s", drive.seen(), from_s, from_s, time.monotonic())
        ended = drive.end()
    check([verdict], slow, tell)
    check_end(ended, tell)

"""Runs side by side: no end is lost, whatever happens to a run."""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from evaluation.campaign.pool import Job, Pool, allowed_s
from evaluation.campaign.spread import Spread
from evaluation.run.spec import RunSpec
from tests.unit.evaluation.evaluate.works import touch


def jobs(*scenarios: str) -> list[Job]:
    return [Job(f"{number}", RunSpec(scenario=scenario)) for number, scenario in enumerate(scenarios)]


def alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def running(pid: int) -> bool:
    """Whether it is there, and no zombie that nobody has asked about yet."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def ends(pid: int) -> bool:
    """Whether it does so within 10 s."""
    return until(lambda: not running(pid), 10.0)


def until(holds: Callable[[], bool], seconds: float) -> bool:
    end_s = time.monotonic() + seconds
    while not holds() and time.monotonic() < end_s:
        threading.Event().wait(0.01)
    return holds()


def test_a_crash_a_refusal_and_a_bug_are_told_and_the_others_go_on(tmp_path: Path) -> None:
    pool = Pool(str(tmp_path), 2, touch)
    ends = {done.key: done.problem for done in pool.done(jobs("a", "crash", "refuse", "bug", "b", "c"))}
    assert sorted(ends) == ["0", "1", "2", "3", "4", "5"]
    assert ends["0"] == ends["4"] == ends["5"] == ""
    assert ends["1"] == "its process ended with 9"
    assert ends["2"] == "UserError: no such scenario"
    assert "ZeroDivisionError: a bug" in ends["3"]
    assert {path.name for path in tmp_path.glob("?")} == {"0", "4", "5"}


def test_a_stuck_run_is_ended_and_told(tmp_path: Path) -> None:
    (done,) = Pool(str(tmp_path), 1, touch, allowed=lambda spec: 0.5).done(jobs("stick"))
    assert done.problem.startswith("stuck: not done after")


def test_one_slot_drives_one_run_after_another_in_one_process(tmp_path: Path) -> None:
    assert [done.problem for done in Pool(str(tmp_path), 1, touch).done(jobs("a", "b"))] == ["", ""]
    assert (tmp_path / "0").read_text() == (tmp_path / "1").read_text() != str(os.getpid())


def test_whoever_stops_listening_leaves_no_process_and_keeps_what_was_finished(tmp_path: Path) -> None:
    ends = Pool(str(tmp_path), 1, touch).done(jobs("a", "stick"))
    assert next(iter(ends)).key == "0"
    pid = int((tmp_path / "0").read_text())
    ends.close()  # type: ignore[attr-defined]
    assert not alive(pid)
    assert (tmp_path / "0").exists()


def test_no_jobs_need_no_process(tmp_path: Path) -> None:
    assert list(Pool(str(tmp_path), 2, touch).done([])) == []
    assert list(Spread(str(tmp_path), "nobody:1", touch).done([])) == [], "nor a cluster that answers"


def test_a_longer_run_may_take_longer() -> None:
    assert allowed_s(RunSpec(scenario="a", seconds=6.0)) < allowed_s(RunSpec(scenario="a"))


@pytest.mark.filterwarnings("ignore")
def test_ray_gives_the_same_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(
        "PYTHONPATH", os.pathsep.join([str(Path(__file__).parents[4]), os.environ.get("PYTHONPATH", "")])
    )
    monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "0")
    ends = {
        done.key: done.problem for done in Spread(str(tmp_path), "local", touch).done(jobs("a", "crash", "refuse", "b"))
    }
    assert ends["0"] == ends["3"] == ""
    assert ends["1"].startswith("its process ended")
    assert ends["2"] == "UserError: no such scenario"
    assert {path.name for path in tmp_path.glob("?")} == {"0", "3"}
    (stuck,) = Spread(str(tmp_path), "local", touch, allowed=lambda spec: 2.0).done(jobs("stick"))
    assert stuck.problem.startswith("its process ended (a run that is stuck is ended after 2 s)")


def test_a_process_that_dies_between_two_runs_costs_no_run(tmp_path: Path) -> None:
    problems: dict[str, str] = {}
    for done in Pool(str(tmp_path), 1, touch).done(jobs("a", "die later", "b", "c")):
        problems[done.key] = done.problem
        if done.key == "1":
            (tmp_path / "1.heard").touch()
            pid = int((tmp_path / "1").read_text())
            assert ends(pid), "it dies before it is given the next"
    assert problems == {"0": "", "1": "", "2": "", "3": ""}
    assert (tmp_path / "2").read_text() == (tmp_path / "3").read_text() != (tmp_path / "1").read_text()


def test_a_killed_parent_leaves_no_slot_driving(tmp_path: Path) -> None:
    script = (
        "from tests.unit.evaluation.campaign.test_pool import Pool, jobs, touch\n"
        f"if __name__ == '__main__': list(Pool({str(tmp_path)!r}, 1, touch).done(jobs('a', 'stick')))\n"
    )
    (file := tmp_path / "parent.py").write_text(script, encoding="utf-8")
    root = str(Path(__file__).parents[4])
    with subprocess.Popen([sys.executable, str(file)], env={**os.environ, "PYTHONPATH": root}) as parent:
        assert until((tmp_path / "0").exists, 60.0)
        parent.kill()
    assert ends(int((tmp_path / "0").read_text()))


def test_who_dies_leaves_no_child(tmp_path: Path) -> None:
    (done,) = Pool(str(tmp_path), 1, touch).done(jobs("leave a child"))
    assert done.problem == "its process ended with 9"
    child = int((tmp_path / "0.child").read_text())
    assert ends(child)

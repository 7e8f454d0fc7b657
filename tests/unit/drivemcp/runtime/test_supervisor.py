"""The supervisor, with small processes of its own."""

import os
import signal
import threading
from pathlib import Path

import pytest

from drivemcp.bus.session import wait_settled
from drivemcp.runtime.supervisor import StackFailed, Supervisor


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A module that runs until it is ended, and one that ends at once."""
    (tmp_path / "lives.py").write_text("import signal\nsignal.pause()\n")
    (tmp_path / "dies.py").write_text("raise SystemExit('the reason')\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    return "lives"


def test_a_killed_process_is_started_again_and_ended_with_the_rest(module: str, tmp_path: Path) -> None:
    said: list[str] = []
    with Supervisor(tmp_path / "run", said.append) as supervisor:
        child = supervisor.run("one", module, [])
        first = child.pid
        assert first is not None
        os.kill(first, signal.SIGKILL)
        assert wait_settled(lambda: child.pid not in (None, first), 5.0)
        second = child.pid
        assert second is not None
        assert child.restarts == 1
    assert said
    with pytest.raises(ProcessLookupError):
        os.kill(second, 0)


def test_restarts_after_a_calm_time_begin_with_the_shortest_wait_and_still_count(module: str, tmp_path: Path) -> None:
    said: list[str] = []
    with Supervisor(tmp_path / "run", said.append, calm_s=0.0) as supervisor:
        child = supervisor.run("one", module, [])
        for restart in (1, 2, 3):
            pid = child.pid
            assert pid is not None
            os.kill(pid, signal.SIGKILL)
            assert wait_settled(lambda ended=pid: child.pid not in (None, ended), 5.0)  # type: ignore[misc]
            assert child.restarts == restart
    assert all("again in 0.05 s" in line for line in said)


def test_a_process_that_keeps_ending_fails_the_start_with_its_last_words(module: str, tmp_path: Path) -> None:
    with Supervisor(tmp_path / "run") as supervisor:
        supervisor.run("broken", "dies", [])
        with pytest.raises(StackFailed, match="the reason"):
            supervisor.wait_until(lambda: False, "broken", 10.0)


def test_an_interrupt_ends_a_wait_at_once(tmp_path: Path) -> None:
    interrupted = threading.Event()

    def interrupt() -> bool:
        interrupted.set()
        return False

    with Supervisor(tmp_path / "run", interrupted=interrupted) as supervisor, pytest.raises(KeyboardInterrupt):
        supervisor.wait_until(interrupt, "nothing", 10.0)

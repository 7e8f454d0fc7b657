"""`drivemcp up`, on a stack that is only this process: when the drive is over, and what is said then."""

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Self

import pytest

from app.drive import run as driving
from app.drive.screen import Screen
from app.drive.stack import Stack, StackPlan
from drivemcp.cli import run
from drivemcp.node import Node
from drivemcp.testing import TestBus, bus
from proto import topics
from proto.truth import ScenarioState

PATIENCE_S = 60.0


class OneNode:
    """In the place of a stack: a node on a bus of this process; nothing is started."""

    def __init__(self, node: Node, begin: Callable[[threading.Event], None], interrupted: threading.Event) -> None:
        self._node, self._begin, self._interrupted = node, begin, interrupted

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def start(self) -> Node:
        """The node."""
        return self._node

    def wait_for_source(self) -> None:
        """What a test wants to happen as the source begins."""
        self._begin(self._interrupted)

    def restarts(self) -> dict[str, int]:
        """None."""
        return {}


@contextmanager
def impatient() -> Iterator[threading.Event]:
    """A drive that does not end by itself is ended, and that is told."""
    ended = threading.Event()

    def end() -> None:
        ended.set()
        os.kill(os.getpid(), signal.SIGTERM)

    timer = threading.Timer(PATIENCE_S, end)
    timer.start()
    try:
        yield ended
    finally:
        timer.cancel()


@pytest.fixture
def up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[Callable[[TestBus, threading.Event], None]], int]:
    """`drivemcp up`; what happens as its source begins is the test's. The exit status."""

    def drive(begin: Callable[[TestBus, threading.Event], None]) -> int:
        with bus() as stack, impatient() as ended:

            def one_node(_: object, __: object, interrupted: threading.Event) -> Any:
                return OneNode(stack.probe, lambda event: begin(stack, event), interrupted)

            monkeypatch.setattr(driving, "Stack", one_node)
            status = run(["up", "--headless", "--out", str(tmp_path)])
            assert not ended.is_set(), "it did not end by itself"
            return status

    return drive


@pytest.fixture
def hangup() -> Iterator[list[int]]:
    """What came of SIGHUP outside a drive, for which it would end this process."""
    heard: list[int] = []
    before = signal.signal(signal.SIGHUP, lambda number, _: heard.append(number))
    yield heard
    signal.signal(signal.SIGHUP, before)


def test_a_drive_that_ended_before_its_time_ends_the_command_and_is_told(
    up: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    broken = ScenarioState(scenario="s", seed=1, time_s=0.0, duration_s=0.0, running=False, problem="no OpenGL here")
    assert up(lambda stack, _: stack.node("simulator").publish(topics.SCENARIO, broken)) == 1
    assert "the drive is not whole: no OpenGL here" in capsys.readouterr().err


def test_a_terminal_that_closes_ends_the_drive_in_order(up: Callable[..., int], hangup: list[int]) -> None:
    stopped: list[bool] = []

    def close(_: TestBus, interrupted: threading.Event) -> None:
        os.kill(os.getpid(), signal.SIGHUP)
        stopped.append(interrupted.wait(PATIENCE_S / 2))

    up(close)
    assert stopped == [True]
    assert hangup == []
    os.kill(os.getpid(), signal.SIGHUP)
    assert hangup == [signal.SIGHUP], "afterwards all is as before"


def test_a_terminal_that_closes_ends_no_drive_under_nohup(up: Callable[..., int], hangup: list[int]) -> None:
    stopped: list[bool] = []

    def close(stack: TestBus, interrupted: threading.Event) -> None:
        os.kill(os.getpid(), signal.SIGHUP)
        stopped.append(interrupted.is_set())
        state = ScenarioState(scenario="s", seed=1, time_s=1.0, duration_s=1.0, running=False, finished=True)
        stack.node("simulator").publish(topics.SCENARIO, state)

    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    up(close)
    assert stopped == [False]


def test_a_stack_that_is_interrupted_as_it_starts_waits_for_nothing_more(tmp_path: Path) -> None:
    interrupted = threading.Event()
    said: list[str] = []
    with Stack(StackPlan(folder=str(tmp_path)), said.append, interrupted) as stack:
        interrupted.set()
        with pytest.raises(KeyboardInterrupt):
            stack.start()
        router = stack.child("router").pid
    assert router is not None
    with pytest.raises(ProcessLookupError):
        os.kill(router, 0)


def test_what_is_said_to_a_terminal_that_is_gone_is_lost_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    with open("/dev/full", "w", buffering=1, encoding="utf-8") as gone:
        monkeypatch.setattr("sys.stderr", gone)
        screen = Screen()
        screen.say("stopping")
        monkeypatch.undo()
        with pytest.raises(OSError, match="space"):
            gone.close()

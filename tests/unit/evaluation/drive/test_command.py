"""`drivemcp up`, on a stack that is only this process: when the drive is over, and what is said then."""

import os
import signal
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

import pytest

from drivemcp.cli import run
from drivemcp.node import Node
from drivemcp.testing import bus
from evaluation.drive import command
from proto import topics
from proto.truth import ScenarioState

PATIENCE_S = 10.0


class OneNode:
    """In the place of a stack: a node on a bus of this process; nothing is started."""

    def __init__(self, node: Node, source: Callable[[], None]) -> None:
        self.node, self.wait_for_source = node, source

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def start(self) -> Node:
        """The node."""
        return self.node

    def restarts(self) -> dict[str, int]:
        """None."""
        return {}


def test_a_drive_that_ended_before_its_time_ends_the_command_and_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    broken = ScenarioState(scenario="s", seed=1, time_s=0.0, duration_s=0.0, running=False, problem="no OpenGL here")
    impatient = threading.Timer(PATIENCE_S, os.kill, (os.getpid(), signal.SIGTERM))
    with bus() as stack:

        def source() -> None:
            stack.node("simulator").publish(topics.SCENARIO, broken)

        def one_node(*_: Any) -> OneNode:
            return OneNode(stack.probe, source)

        monkeypatch.setattr(command, "Stack", one_node)
        impatient.start()
        try:
            status = run(["up", "--headless", "--out", str(tmp_path)])
        finally:
            ended_by_itself = impatient.is_alive()
            impatient.cancel()
    assert ended_by_itself
    assert status == 1
    assert "it ended before its time: no OpenGL here" in capsys.readouterr().err

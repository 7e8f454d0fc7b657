"""The logger as a process: killed, it has lost little; started again, it goes on from the old head."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from drivemcp.bus.session import open_bus, wait_settled
from drivemcp.config import BusConfig, ServiceConfig
from drivemcp.node import Node
from proto import topics
from proto.vehicle import Ego
from services.logger.format.reader import messages
from services.logger.verification.verifier import verify
from services.logger.writing import log_folder

pytestmark = pytest.mark.stack
READY_S = 20.0
LOST_NS = 200_000_000


@pytest.fixture
def probe(start_router: Callable[..., str]) -> Iterator[tuple[Node, str]]:
    """A node on a router, and the router's endpoint."""
    endpoint = start_router()
    with open_bus(BusConfig(connect=(endpoint,))) as bus:
        node = Node(bus, "can", ServiceConfig())
        node.watch_services()
        node.open(announce=False)
        yield node, endpoint
        node.close()


def _logger(node: Node, endpoint: str, folder: Path) -> "subprocess.Popen[bytes]":
    command = [sys.executable, "-m", "services.logger", "--connect", endpoint, "--set", f"out_dir={folder}"]
    process = subprocess.Popen(command, stdin=subprocess.DEVNULL)
    assert wait_settled(lambda: "logger" in node.alive_services(), READY_S)
    return process


def _publish_until_logged(node: Node, folder: Path, seconds: float) -> int:
    """Publishes the ego at 100 Hz for a while once the first record is in a file; the stamp of the last publication."""
    known = len(log_folder.logs(folder / "logs"))
    pace, started_s, logging_s, stamp_ns = _Pace(0.01), time.monotonic(), None, 0
    while logging_s is None or time.monotonic() - logging_s < seconds:
        assert time.monotonic() - started_s < READY_S
        if logging_s is None and len(log_folder.logs(folder / "logs")) > known:
            logging_s = time.monotonic()
        stamp_ns = time.time_ns()
        node.publish(topics.EGO, Ego(speed_mps=10.0), stamp_ns=stamp_ns)
        pace.wait()
    return stamp_ns


class _Pace:
    """Keeps a rate."""

    def __init__(self, period_s: float) -> None:
        self._period_s, self._due_s = period_s, time.monotonic()

    def wait(self) -> None:
        self._due_s += self._period_s
        time.sleep(max(0.0, self._due_s - time.monotonic()))


def test_kill_minus_nine_loses_little_and_the_next_file_goes_on_from_the_old_head(
    probe: tuple[Node, str], tmp_path: Path
) -> None:
    node, endpoint = probe
    first = _logger(node, endpoint, tmp_path)
    last_ns = _publish_until_logged(node, tmp_path, 1.0)
    first.send_signal(signal.SIGKILL)
    first.wait(READY_S)
    assert wait_settled(lambda: "logger" not in node.alive_services(), READY_S)
    (old,) = log_folder.logs(tmp_path / "logs")
    cut = verify(old)
    assert cut.intact
    assert not cut.closed
    *_, newest = (one for one in messages(old) if one.name == "can/ego")
    assert last_ns - newest.stamp_ns <= LOST_NS

    second = _logger(node, endpoint, tmp_path)
    _publish_until_logged(node, tmp_path, 0.3)
    second.send_signal(signal.SIGTERM)
    assert second.wait(READY_S) == 0
    _, new = log_folder.logs(tmp_path / "logs")
    report = verify(new)
    assert report.closed
    assert report.origin is not None
    assert (report.origin.previous_file, report.origin.previous_head) == (old.name, cut.head)

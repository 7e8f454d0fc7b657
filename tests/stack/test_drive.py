"""The whole stack as processes: it drives, ends cleanly, and goes on when any of its processes is killed."""

import itertools
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.drive.stack import Stack, StackPlan
from drivemcp.bus.session import wait_settled
from drivemcp.node import Node
from proto import topics
from proto.decision import Advisory

pytestmark = pytest.mark.stack
ROOT = Path(__file__).parents[2]


def up(folder: Path, *arguments: str, timeout_s: float = 240.0) -> subprocess.CompletedProcess[str]:
    """`drivemcp up`, as a user types it."""
    command = [sys.executable, "-m", "drivemcp.cli", "up", "--headless", "--json", "--out", str(folder), *arguments]
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder)}
    return subprocess.run(
        command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=timeout_s, check=False
    )


def cli(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Another command."""
    command = [sys.executable, "-m", "drivemcp.cli", *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=180, check=False)


@pytest.mark.parametrize("scenario", ["urb-rain", "cross-border", "dynamic-vsl"])
def test_a_scenario_drives_and_its_log_verifies_and_replays(tmp_path: Path, scenario: str) -> None:
    ran = up(tmp_path, "--scenario", scenario, "--seconds", "20")
    assert ran.returncode == 0, ran.stderr[-3000:]
    summary = json.loads(ran.stdout.strip().splitlines()[-1])
    assert summary["log_verified"] is True
    assert summary["distance_m"] > 50
    assert summary["ticks"] > 60
    assert summary["collisions"] == 0
    assert cli("audit", "verify", summary["log"]).returncode == 0
    open_to_others = [path for path in Path(summary["log"]).parents[1].rglob("*") if path.stat().st_mode & 0o027]
    assert open_to_others == []
    replayed = cli("replay", summary["log"])
    assert replayed.returncode == 0, replayed.stdout + replayed.stderr


def test_two_lockstep_runs_decide_alike_and_replay_alike(tmp_path: Path) -> None:
    decisions = []
    for name in ("first", "second"):
        ran = up(tmp_path / name, "--seconds", "12", "--seed", "3", "--lockstep", timeout_s=400)
        assert ran.returncode == 0, ran.stderr[-3000:]
        summary = json.loads(ran.stdout.strip().splitlines()[-1])
        assert cli("replay", summary["log"]).returncode == 0
        decisions.append(traces(Path(summary["log"])))
    assert decisions[0]
    assert decisions[0] == decisions[1]


def traces(log: Path) -> list[tuple[object, ...]]:
    """What each tick came to."""
    from services.logger.format.reader import messages

    found: list[tuple[object, ...]] = []
    for record in messages(log):
        if record.name.endswith("/trace") or record.name == "trace":
            trace = json.loads(record.data)
            advisory = trace["advisory"]
            found.append(
                (trace["tick"], trace["stamp_ns"], [e["kind"] for e in trace["events"]], trace["decision"]["kind"],
                 advisory["directive"], advisory["target_mps"], trace["state_sha256"])
            )  # fmt: skip
    return found


def test_ctrl_c_ends_cleanly_with_the_summary_so_far(tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "drivemcp.cli",
        "up",
        "--headless",
        "--json",
        "--out",
        str(tmp_path),
        "--seconds",
        "120",
    ]
    process = subprocess.Popen(
        command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "XDG_RUNTIME_DIR": str(tmp_path)},
    )  # fmt: skip
    try:
        assert process.stderr is not None
        driving = threading.Event()
        lines: list[str] = []

        def read() -> None:
            assert process.stderr is not None
            for line in process.stderr:
                lines.append(line)
                if " km/h |" in line and "tick ?" not in line:
                    driving.set()

        reader = threading.Thread(target=read, daemon=True)
        reader.start()
        assert driving.wait(60), "".join(lines)
        process.send_signal(signal.SIGINT)
        assert process.wait(25) == 0, "".join(lines)
        reader.join(5)
        assert process.stdout is not None
        summary = json.loads(process.stdout.read().strip().splitlines()[-1])
        assert summary["log_verified"] is True
        assert 0 < summary["seconds"] < 110
    finally:
        if process.poll() is None:
            process.kill()
        with process:  # closes its pipes
            process.wait(5)


class Listener:
    """Advisories as they arrive."""

    def __init__(self, node: Node) -> None:
        self.heard: list[tuple[float, Advisory]] = []
        node.subscribe(topics.ADVISORY, lambda advisory, _: self.heard.append((time.monotonic(), advisory)))

    def since(self, start_s: float) -> list[tuple[float, Advisory]]:
        """Those after an instant."""
        return [item for item in self.heard if item[0] >= start_s]


@pytest.fixture(scope="module")
def driving(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Stack, Node, Listener]]:
    """A stack in the middle of a drive."""
    folder = tmp_path_factory.mktemp("drive")
    settings = {"simulator": {"scenario": "urb-rain", "seed": 1, "seconds": 400, "autostart": True}}
    with Stack(StackPlan(folder=str(folder), settings=settings), print) as stack:
        node = stack.start()
        listener = Listener(node)
        stack.wait_for_source()
        assert wait_settled(lambda: len(listener.heard) > 20, 40.0)
        yield stack, node, listener


QUESTIONS = (
    "What does this sign mean?",
    "Are we in mph now?",
    "Why did the limit drop?",
    "A warning light came on; is it safe?",
)


@pytest.mark.parametrize("question", QUESTIONS)
def test_the_papers_four_questions_are_answered_from_the_running_drive(
    driving: tuple[Stack, Node, Listener], question: str
) -> None:
    _, node, _ = driving

    def cited() -> bool:
        return bool((node.call("ask", {"question": question}, deadline_ms=5000).result or {}).get("citations"))

    assert wait_settled(cited, 20.0), "no sign came into sight, or nothing is cited"
    outcome = node.call("ask", {"question": question}, deadline_ms=5000)
    assert outcome.ok, outcome.error
    assert outcome.result is not None
    assert len(outcome.result["text"]) > 20


def kill(stack: Stack, name: str) -> float:
    """kill -9 of one of our own processes; the instant."""
    pid = stack.child(name).pid
    assert pid
    os.kill(pid, signal.SIGKILL)
    return time.monotonic()


KILLABLE = ("perception", "drivelm", "can", "weather", "rules", "retrieval", "arbiter", "logger", "gateway", "cockpit")


@pytest.mark.parametrize("name", KILLABLE)
def test_kill_9_of_a_service_leaves_advice_degraded_and_brings_it_back(
    driving: tuple[Stack, Node, Listener], name: str
) -> None:
    stack, node, listener = driving
    assert wait_settled(lambda: name in node.alive_services(), 10.0)
    killed_s = kill(stack, name)
    assert wait_settled(lambda: name not in node.alive_services(), 3.0)
    assert wait_settled(lambda: name in node.alive_services(), 10.0)
    back_s = time.monotonic() - killed_s
    assert wait_settled(lambda: len(listener.since(killed_s)) > 10, 10.0)
    heard = [killed_s, *(at_s for at_s, _ in listener.since(killed_s))]
    gaps = [later - earlier for earlier, later in itertools.pairwise(heard)]
    assert max(gaps) < 1.5, f"advice was silent for {max(gaps):.1f} s"
    assert back_s < 3.0, f"{name} was back after {back_s:.1f} s"


@pytest.mark.parametrize("name", ["orchestrator", "router"])
def test_router_and_orchestrator_come_back_by_themselves(driving: tuple[Stack, Node, Listener], name: str) -> None:
    stack, _, listener = driving
    before = len(listener.heard)
    assert wait_settled(lambda: len(listener.heard) > before + 3, 10.0)
    killed_s = kill(stack, name)
    last_s = listener.heard[-1][0]
    assert wait_settled(lambda: any(at_s > killed_s + 0.3 for at_s, _ in listener.since(killed_s)), 15.0)
    first_s = next(at_s for at_s, _ in listener.since(killed_s) if at_s > killed_s + 0.3)
    assert first_s - last_s < 5.0, f"advice came back after {first_s - last_s:.1f} s"


@pytest.mark.parametrize("name", ["router", "simulator"])
def test_map_and_position_are_back_soon_after_a_router_or_simulator_stood_still(
    driving: tuple[Stack, Node, Listener], name: str
) -> None:
    stack, node, _ = driving
    heard: dict[str, float] = {}
    node.subscribe(topics.MAP, lambda *_: heard.update(map=time.monotonic()))
    node.subscribe(topics.GNSS, lambda *_: heard.update(gnss=time.monotonic()))
    assert wait_settled(lambda: len(heard) == 2, 20.0)
    pid = stack.child(name).pid
    assert pid
    os.kill(pid, signal.SIGSTOP)
    threading.Event().wait(3.0)
    os.kill(pid, signal.SIGCONT)
    went_on_s = time.monotonic()
    assert wait_settled(lambda: min(heard.values()) > went_on_s + 0.5, 15.0), heard

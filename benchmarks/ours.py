"""Subject: one call, one decision, or three 20 ms tools in parallel, through ours. `python -m benchmarks.ours ENDPOINT MODE COUNT`"""

import json
import subprocess
import sys
import threading
import time
from typing import Any

from benchmarks.decision import SNAPSHOT, WANTED, decide, route
from benchmarks.workload import ARGUMENTS, RESULT, SLOW_MS, TOOL
from drivemcp.bus.session import open_bus, wait_settled
from drivemcp.config import BusConfig, ServiceConfig
from drivemcp.node import Node
from proto.rules import Situation

SLOW = ("slow_one", "slow_two", "slow_three")


def serve(endpoint: str, *, router: bool) -> None:
    """The server process: answers until its standard input ends."""
    config = BusConfig(connect=(endpoint,)) if router else BusConfig(mode="peer", listen=(endpoint,))
    with open_bus(config) as bus:
        node = Node(bus, "rules", ServiceConfig(tool_workers=8))

        @node.tool(deadline_ms=1000)
        def applicable_limit(situation: Situation) -> dict[str, Any]:
            """The workload's answer."""
            return RESULT

        for name in SLOW:
            node.tools.add(_slow, deadline_ms=1000, name=name)
        node.open()
        sys.stdin.read()
        node.close()


def _slow(situation: Situation) -> dict[str, Any]:
    """A tool of 20 ms."""
    time.sleep(SLOW_MS / 1000)
    return RESULT


def main() -> None:
    """Measure."""
    endpoint, mode, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
    router = mode.endswith("router")
    server = subprocess.Popen(
        [sys.executable, "-m", "benchmarks.ours", endpoint, "serve", str(int(router))], stdin=subprocess.PIPE
    )
    try:
        with open_bus(BusConfig(connect=(endpoint,), mode="client" if router else "peer")) as bus:
            node = Node(bus, "orchestrator", ServiceConfig())
            node.watch_services()
            node.open(announce=False)
            if not wait_settled(lambda: TOOL in node.catalogue(), 10.0):
                raise RuntimeError("the server did not come up")
            measure = _MEASURES[mode.partition("-")[0]]
            print(json.dumps({"ms": measure(node, count)}))  # noqa: T201
            node.close()
    finally:
        assert server.stdin is not None
        server.stdin.close()
        server.wait(5)


def _single(node: Node, count: int) -> list[float]:
    times: list[float] = []
    for number in range(count + 200):
        started = time.perf_counter()
        outcome = node.call(TOOL, ARGUMENTS, deadline_ms=1000)
        elapsed = (time.perf_counter() - started) * 1000
        if not outcome.ok:
            raise RuntimeError(f"{outcome.status}: {outcome.error}")
        if number >= 200:
            times.append(elapsed)
    return times


def _decision(node: Node, count: int) -> list[float]:
    """Route, ask, decide."""
    times: list[float] = []
    for number in range(count + 50):
        started = time.perf_counter()
        outcome = node.call(route(SNAPSHOT), {"situation": SNAPSHOT["situation"]}, deadline_ms=1000)
        advice = decide(SNAPSHOT, outcome.result or {})
        elapsed = (time.perf_counter() - started) * 1000
        if advice != WANTED:
            raise RuntimeError(f"another advice: {advice}")
        if number >= 50:
            times.append(elapsed)
    return times


def _parallel(node: Node, count: int) -> list[float]:
    times: list[float] = []
    for number in range(count + 5):
        started = time.perf_counter()
        outcomes = node.call_all([(name, ARGUMENTS, 1000.0) for name in SLOW])
        elapsed = (time.perf_counter() - started) * 1000
        if not all(outcome.ok for outcome in outcomes):
            raise RuntimeError("a parallel call failed")
        if number >= 5:
            times.append(elapsed)
    return times


_MEASURES = {"direct": _single, "router": _single, "decision": _decision, "parallel": _parallel}


if __name__ == "__main__":
    if sys.argv[2] == "serve":
        threading.stack_size(256 * 1024)
        serve(sys.argv[1], router=sys.argv[3] == "1")
    else:
        main()

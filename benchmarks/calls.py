"""One tool call, and three in parallel: ours beside the others, in rounds, so that the machine's moods meet all alike."""

import subprocess
import sys
from collections.abc import Callable

from app.drive.summary import percentile
from benchmarks.figures import median, table
from benchmarks.subject import run_subject
from benchmarks.workload import SLOW_MS
from drivemcp.runtime.supervisor import free_port

ROUNDS = 3
CALLS = 1500
PARALLEL = 60


def endpoint() -> str:
    """A free one."""
    return f"tcp/127.0.0.1:{free_port()}"


def _through_router(module: str, mode: str, count: int) -> list[float]:
    where = endpoint()
    router = subprocess.Popen([sys.executable, "-m", "drivemcp.bus.router", "--listen", where])
    try:
        return list(run_subject(module, where, mode, str(count))["ms"])
    finally:
        router.terminate()
        router.wait(5)


_SINGLE: dict[str, Callable[[], list[float]]] = {
    "bare Zenoh query, direct": lambda: run_subject("benchmarks.bare_zenoh", endpoint(), "direct", str(CALLS))["ms"],
    "ours, direct": lambda: run_subject("benchmarks.ours", endpoint(), "direct", str(CALLS))["ms"],
    "bare Zenoh query, router": lambda: _through_router("benchmarks.bare_zenoh", "router", CALLS),
    "ours, router": lambda: _through_router("benchmarks.ours", "router", CALLS),
    "gRPC": lambda: run_subject("benchmarks.peers.grpc_call", str(free_port()), str(CALLS), peer=True)["ms"],
    "MCP SDK, stdio": lambda: run_subject("benchmarks.peers.mcp_client", "stdio", str(CALLS // 3), peer=True)["ms"],
    "MCP SDK, HTTP": lambda: run_subject("benchmarks.peers.mcp_client", str(free_port()), str(CALLS // 3), peer=True)[
        "ms"
    ],
}
_PARALLEL: dict[str, Callable[[], list[float]]] = {
    "ours, direct": lambda: run_subject("benchmarks.ours", endpoint(), "parallel", str(PARALLEL))["ms"],
    "ours, router": lambda: _through_router("benchmarks.ours", "parallel-router", PARALLEL),
    "LangGraph nodes over MCP stdio": lambda: run_subject(
        "benchmarks.peers.langgraph_parallel", str(PARALLEL), peer=True
    )["ms"],
}


def _rounds(subjects: dict[str, Callable[[], list[float]]]) -> dict[str, list[float]]:
    times: dict[str, list[float]] = {name: [] for name in subjects}
    for number in range(ROUNDS):
        for name, run in subjects.items():
            sys.stderr.write(f"  round {number + 1} of {ROUNDS}: {name}\n")
            times[name] += run()
    return times


def tool_call() -> str:
    """The table of one call, with the ratios that the project promises."""
    times = _rounds(_SINGLE)
    medians = {name: median(values) for name, values in times.items()}
    base = medians["ours, direct"]
    rows = [
        [name, f"{medians[name]:.3f}", f"{percentile(values, 0.99):.3f}", f"{medians[name] / base:.2f}"]
        for name, values in times.items()
    ]
    promised = [
        ("ours over a bare query, direct", base / medians["bare Zenoh query, direct"], "at most 1.5"),
        (
            "ours over a bare query, router",
            medians["ours, router"] / medians["bare Zenoh query, router"],
            "at most 1.5",
        ),
        ("MCP stdio over ours, direct", medians["MCP SDK, stdio"] / base, "at least 4"),
        ("MCP stdio over ours, router", medians["MCP SDK, stdio"] / medians["ours, router"], "at least 2.5"),
    ]
    return (
        "## One tool call\n\n"
        + table(["subject", "p50 ms", "p99 ms", "p50 over ours, direct"], rows)
        + "\n\n"
        + table(
            ["ratio of medians", "measured", "promised"],
            [[name, f"{value:.2f}", goal] for name, value, goal in promised],
        )
    )


def parallel() -> str:
    """Three tools of 20 ms side by side: what comes on top of 20 ms."""
    times = _rounds(_PARALLEL)
    rows = [
        [name, f"{median(values):.2f}", f"{median(values) - SLOW_MS:.2f}", f"{percentile(values, 0.99) - SLOW_MS:.2f}"]
        for name, values in times.items()
    ]
    return f"## Three tools of {SLOW_MS:g} ms in parallel\n\n" + table(
        ["subject", "p50 ms", "over 20 ms, p50", "over 20 ms, p99"], rows
    )

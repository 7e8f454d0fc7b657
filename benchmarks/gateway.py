"""Time per call through the gateway beside a server of the official SDK that answers by itself, in turns in one run."""

import sys
from collections.abc import Callable

from app.drive.summary import percentile
from benchmarks.calls import endpoint
from benchmarks.figures import median, table
from benchmarks.subject import run_subject
from drivemcp.runtime.supervisor import free_port

ROUNDS, CALLS = 3, 500
PROMISED = "at most 1.5"


def gateway() -> str:
    """The table, with the ratio of medians. Both speak HTTP in revision 2026-07-28, with the same client."""
    subjects: dict[str, Callable[[], list[float]]] = {
        "MCP SDK, HTTP, answers by itself": lambda: run_subject(
            "benchmarks.peers.mcp_client", str(free_port()), str(CALLS)
        )["ms"],
        "our gateway, HTTP, a tool over the bus": lambda: run_subject(
            "benchmarks.through_gateway", endpoint(), str(free_port()), str(CALLS)
        )["ms"],
    }
    times: dict[str, list[float]] = {name: [] for name in subjects}
    for number in range(ROUNDS):
        for name, run in subjects.items():
            sys.stderr.write(f"  round {number + 1} of {ROUNDS}: {name}\n")
            times[name] += run()
    base = median(times["MCP SDK, HTTP, answers by itself"])
    rows = [
        [name, f"{median(values):.2f}", f"{percentile(values, 0.99):.2f}", f"{median(values) / base:.2f}"]
        for name, values in times.items()
    ]
    heads = ["subject", "p50 ms", "p99 ms", f"p50 over the SDK's ({PROMISED})"]
    return "## A call through the gateway\n\n" + table(heads, rows)

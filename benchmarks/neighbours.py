"""The time of a decision: the same question through LangGraph with MCP and through ours, in turns in one run."""

import sys
from collections.abc import Callable
from typing import Any

from app.drive.summary import percentile
from benchmarks.calls import endpoint
from benchmarks.figures import median, table
from benchmarks.subject import LANGGRAPH, LANGGRAPH_PACKAGES, make_environment, run_subject

ROUNDS, DECISIONS, FRESH = 3, 300, 5


def neighbours() -> str:
    """The table, with the ratio of medians."""
    make_environment(LANGGRAPH, LANGGRAPH_PACKAGES)
    graph = "benchmarks.peers.langgraph_decision"
    subjects: dict[str, Callable[[], dict[str, Any]]] = {
        "ours, direct": lambda: run_subject("benchmarks.ours", endpoint(), "decision", str(DECISIONS)),
        "LangGraph, MCP over stdio, session held open": lambda: run_subject(
            graph, "held", str(DECISIONS), environment=LANGGRAPH
        ),
        "LangGraph, MCP over stdio, a session a call (default)": lambda: run_subject(
            graph, "fresh", str(FRESH), environment=LANGGRAPH
        ),
    }
    times: dict[str, list[float]] = {name: [] for name in subjects}
    for number in range(ROUNDS):
        for name, run in subjects.items():
            sys.stderr.write(f"  round {number + 1} of {ROUNDS}: {name}\n")
            times[name] += run()["ms"]
    base = median(times["ours, direct"])
    rows = [
        [
            name,
            str(len(values)),
            f"{median(values):.2f}",
            f"{percentile(values, 0.99):.2f}",
            f"{median(values) / base:.1f}",
        ]
        for name, values in times.items()
    ]
    return "## A decision that asks one tool\n\n" + table(
        ["subject", "decisions", "p50 ms", "p99 ms", "p50 over ours"], rows
    )

"""The decision that both sides of `neighbours` make around the same call. Standard library only: peers import it, too."""

from typing import Any

from benchmarks.workload import ARGUMENTS, TOOL

SNAPSHOT: dict[str, Any] = {"events": ["speed_limit_change"], "situation": ARGUMENTS["situation"], "speed_mps": 25.0}
"""A limit sign was passed: what holds here?"""
_ROUTES = {"speed_limit_change": TOOL}


def route(snapshot: dict[str, Any]) -> str:
    """The tool that the snapshot's event calls for; empty: none."""
    return next((_ROUTES[event] for event in snapshot["events"] if event in _ROUTES), "")


def decide(snapshot: dict[str, Any], answer: dict[str, Any]) -> dict[str, Any]:
    """The advice; the limit is rounded to a tenth as it is told."""
    limit = round(answer["limit_mps"], 1)
    return {
        "kind": "SPEAK" if snapshot["speed_mps"] > limit else "SILENT",
        "target_mps": limit,
        "of": answer["rulepack_version"],
    }


WANTED = {"kind": "SPEAK", "target_mps": 22.2, "of": "DEU-v1@1.0.0#0123456789ab"}

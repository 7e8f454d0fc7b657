"""Whether a candidate may take the shipped constants' place: closed loop, the same places, worse in no safety number."""

from collections.abc import Mapping, Sequence
from statistics import fmean
from typing import Any, NamedTuple

import msgspec

SLOWER_S = 0.05
"""A mean hazard response that is later by no more than this, half a tick, is not worse."""
LEAST_HAZARDS = 10
"""Ours: with fewer on either side, "no worse" says nothing."""


class Closed(msgspec.Struct, frozen=True, kw_only=True):
    """Drives in closed loop, pooled."""

    runs: int = 0
    km: float = 0.0
    hazards: int = 0
    missed: int = 0
    response_s: float | None = None
    """Mean over those answered."""
    collisions: int = 0
    near_collisions: int = 0
    interventions: int = 0
    false_interventions: int = 0
    infractions: int = 0
    unnecessary_slow_downs: int = 0
    messages: int = 0
    nags: int = 0


def closed(metrics: Sequence[Mapping[str, Any]]) -> Closed:
    """Of runs' metrics (`evaluation.metrics.Metrics` as kept)."""

    def total(name: str) -> int:
        return sum(row.get(name) or 0 for row in metrics)

    times = [each for row in metrics for each in row.get("hazard_response_s") or ()]
    return Closed(
        runs=len(metrics),
        km=sum(row.get("distance_m") or 0.0 for row in metrics) / 1e3,
        hazards=total("hazards"),
        missed=total("hazards") - total("hazards_answered"),
        response_s=fmean(times) if times else None,
        collisions=total("collisions"),
        near_collisions=total("near_collisions"),
        interventions=total("interventions"),
        false_interventions=total("false_interventions"),
        infractions=total("infractions_total"),
        unnecessary_slow_downs=total("unnecessary_slow_downs"),
        messages=total("messages"),
        nags=total("nags"),
    )


class Verdict(NamedTuple):
    """Whether it may, and why not."""

    taken: bool
    why: str


def verdict(before: Closed, after: Closed) -> Verdict:
    """Worse in nothing that is safety, and better in something."""
    if after.runs < before.runs or not before.runs:
        return Verdict(False, f"only {after.runs} of {before.runs} drives in closed loop came to their end")
    if min(before.hazards, after.hazards) < LEAST_HAZARDS:
        met = f"{before.hazards} hazards with the shipped constants and {after.hazards} with the fitted ones"
        return Verdict(False, f"closed loop met only {met}; below {LEAST_HAZARDS} nothing is proved: more --verify")
    worse = [
        f"{name.replace('_', ' ')} {getattr(before, name)} -> {getattr(after, name)}"
        for name in ("missed", "collisions", "near_collisions", "infractions")
        if getattr(after, name) > getattr(before, name)
    ]
    if before.response_s is not None and (after.response_s or 0.0) > before.response_s + SLOWER_S:
        worse.append(f"hazard response {before.response_s:.2f} s -> {after.response_s or 0.0:.2f} s")
    if worse:
        return Verdict(False, f"worse in closed loop: {'; '.join(worse)}")
    better = [
        f"{name.replace('_', ' ')} {getattr(before, name)} -> {getattr(after, name)}"
        for name in ("missed", "near_collisions", "false_interventions", "nags", "messages")
        if getattr(after, name) < getattr(before, name)
    ]
    return Verdict(True, "; ".join(better)) if better else Verdict(False, "better in nothing in closed loop")

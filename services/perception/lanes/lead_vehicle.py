"""The lead vehicle: the next vehicle in the ego's path along its lane, not the nearest one anywhere."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import msgspec

from proto.perception import Track
from services.perception.lanes.model import LaneModel

EGO_WIDTH_M = 1.9
MARGIN_M = 0.25
"""Room beside the ego that belongs to its path."""
FADED = 0.5
"""A track below this confidence is the lead only if no surer one is: an established track falls below it after 0.6 s unseen."""
CUT_IN_S = 1.0
"""A body that will reach into the path within this time, at its lateral speed now, is in it."""
STEEPEST = 0.5
"""Sideways by forwards of a vehicle that pulls out: 27 degrees."""
CROSSES_MPS, CROSSES_S = 2.0, 3.0
"""From this lateral speed on a vehicle crosses: no noise makes so much; and the time within which it then counts as in the path."""
CUT_IN_MPS = 0.4
"""Lateral speeds below this are noise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Placed:
    """A track with its lane, and how far along the ego's lane its middle is."""

    track: Track
    along_m: float


def place(track: Track, model: LaneModel, ego_mps: float | None = None) -> Placed:
    """The track with lane id, whether its body reaches into the ego's path, and whether its lane is an oncoming one.

    With the ego's speed unknown, every road user may be rolling, and a noisy lateral speed counts in full.
    """
    lane = model.lane_of(track.x_m, track.y_m)
    along, left = model.ego.place(track.x_m, track.y_m)
    _, ego_left = model.ego.place(0.0, 0.0)
    aside = left - ego_left * max(0.0, 1.0 - along / 30.0)
    against_us = lane is not None and lane.oncoming and track.kind == "vehicle"
    # a vehicle that keeps to an oncoming lane passes beside us; one that leaves it stands in ours, and is in the path then
    clearance = abs(aside) - (EGO_WIDTH_M + track.width_m) / 2
    in_path = along > 0 and not against_us and _reaches(track, aside, clearance, ego_mps)
    placed = msgspec.structs.replace(
        track,
        lane_id=lane.lane_id if lane else "",
        in_ego_path=in_path,
        oncoming=track.oncoming or against_us,
        clearance_m=clearance,
    )
    return Placed(track=placed, along_m=along)


def crosses(track: Track, ego_mps: float | None) -> bool:
    """Whether a vehicle drives across our way rather than along it; unknown speeds of our own tell nothing."""
    along_mps = abs(track.vx_mps + ego_mps) if ego_mps is not None else math.inf
    return track.kind == "vehicle" and abs(track.vy_mps) >= max(CROSSES_MPS, along_mps)


def _rolls_mps(track: Track, ego_mps: float | None) -> float:
    """How fast it may move sideways: a vehicle does so only while it rolls, and one that is parked not at all."""
    if track.kind != "vehicle" or ego_mps is None or abs(track.vy_mps) >= CROSSES_MPS:
        return math.inf
    return STEEPEST * abs(track.vx_mps + ego_mps)


def _reaches(track: Track, aside_m: float, clearance_m: float, ego_mps: float | None) -> bool:
    """Whether the body lies, or within a moment will lie, in the strip that the ego needs."""
    free = clearance_m - MARGIN_M
    if free <= 0:
        return True
    inwards = min(-track.vy_mps if aside_m > 0 else track.vy_mps, _rolls_mps(track, ego_mps))
    within_s = CROSSES_S if crosses(track, ego_mps) else CUT_IN_S
    return inwards >= CUT_IN_MPS and free - inwards * within_s <= 0


def lead_of(placed: Sequence[Placed]) -> int | None:
    """The track id of the next vehicle or cyclist going our way in our path; `None` without one."""
    ahead = [
        each
        for each in placed
        if each.track.in_ego_path and not each.track.oncoming and each.track.kind != "pedestrian" and each.along_m > 0
    ]
    sure = [each for each in ahead if each.track.confidence >= FADED]
    return min(sure or ahead, key=lambda each: each.along_m).track.track_id if ahead else None

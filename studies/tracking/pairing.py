"""Whose track is whose: tracks beside true vehicles by the ground distance of their near surfaces.

A vehicle counts within `REACH_M` where the front camera shows at least half of it, 12 px high. All other vehicles are
ignore regions: no track of theirs is missed, and none on them is false. So is what lies outside the camera's view.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from proto.perception import Track
from proto.truth import TrueActor, Truth
from services.simulator.session import CAMERAS
from studies.tracking.seeing import View
from training.dataset.shards import MIN_HEIGHT_PX, MIN_VISIBLE
from training.labelling import Label

Floats = NDArray[np.float64]
REACH_M = 60.0
GATE_M = 2.0
MOVING_MPS = 1.0
_FRONT = CAMERAS["front"]
HALF_VIEW = _FRONT.width_px / 2 / _FRONT.focal_px
"""Tangent of half the front camera's angle of view."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Vehicle:
    """A true vehicle: the middle of its near surface in the ego frame, its relative speed along, whether it counts."""

    actor_id: int
    x_m: float
    y_m: float
    vx_mps: float
    in_ego_path: bool
    counts: bool


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """One picture: the vehicles that count, the tracks that are theirs or of no vehicle, distances (N, M), and all pairs.

    `pairs` holds track ids by actor id, those of ignored vehicles included.
    """

    stamp_ns: int
    vehicles: tuple[Vehicle, ...]
    tracks: tuple[Track, ...]
    apart_m: Floats
    everyone: tuple[Vehicle, ...]
    pairs: dict[int, int]


def scene(view: View) -> Scene:
    """Pair the tracks of a picture and leave out what is ignored."""
    everyone = vehicles(view.truth, view.look.labels)
    tracks = tuple(track for track in view.tracks.tracks if track.kind == "vehicle")
    paired = _pair(distances(everyone, tracks))
    owner = {column: everyone[row] for row, column in paired}
    kept = tuple(track for k, track in enumerate(tracks) if _kept(track, owner.get(k)))
    counted = tuple(vehicle for vehicle in everyone if vehicle.counts)
    pairs = {everyone[row].actor_id: tracks[column].track_id for row, column in paired}
    return Scene(view.stamp_ns, counted, kept, distances(counted, kept), everyone, pairs)


def vehicles(truth: Truth, labels: Sequence[Label]) -> tuple[Vehicle, ...]:
    """All true vehicles of a picture with these labels."""
    plain = {label.id for label in labels if label.kind == "vehicle" and _plain(label)}
    return tuple(_vehicle(actor, truth, plain) for actor in truth.actors if actor.kind == "vehicle")


def _plain(label: Label) -> bool:
    return label.visible_fraction >= MIN_VISIBLE and label.box_px[3] - label.box_px[1] >= MIN_HEIGHT_PX


def _vehicle(actor: TrueActor, truth: Truth, plain: set[int]) -> Vehicle:
    ground = actor.vx_mps + truth.speed_mps, actor.vy_mps
    heading = math.atan2(ground[1], ground[0]) if math.hypot(*ground) > MOVING_MPS else 0.0
    near_m = actor.x_m - _half_m(heading, actor.length_m, actor.width_m)
    return Vehicle(
        actor_id=actor.actor_id,
        x_m=near_m,
        y_m=actor.y_m,
        vx_mps=actor.vx_mps,
        in_ego_path=actor.in_ego_path,
        counts=actor.actor_id in plain and math.hypot(near_m, actor.y_m) < REACH_M,
    )


def near_m(track: Track) -> float:
    """Where a track's near surface is; its place is the middle of the body."""
    return track.x_m - _half_m(track.heading_rad, track.length_m, track.width_m)


def _half_m(heading_rad: float, length_m: float, width_m: float) -> float:
    """Half of a turned body's extent along the ego's direction."""
    return (abs(math.cos(heading_rad)) * length_m + abs(math.sin(heading_rad)) * width_m) / 2


def distances(vehicles: Sequence[Vehicle], tracks: Sequence[Track]) -> Floats:
    """Ground distances (N, M) between the near surfaces' middles."""
    ours = np.array([(each.x_m, each.y_m) for each in vehicles]).reshape(-1, 1, 2)
    theirs = np.array([(near_m(each), each.y_m) for each in tracks]).reshape(1, -1, 2)
    apart: Floats = np.hypot(*np.moveaxis(ours - theirs, 2, 0))
    return apart


def _pair(apart_m: Floats) -> list[tuple[int, int]]:
    """Rows and columns within the gate: as many pairs as there can be, then the nearest."""
    cost = np.where(apart_m <= GATE_M, apart_m, 1e3)
    rows, columns = linear_sum_assignment(cost)
    return [(r, c) for r, c in zip(rows.tolist(), columns.tolist(), strict=True) if apart_m[r, c] <= GATE_M]


def _kept(track: Track, owner: Vehicle | None) -> bool:
    if owner is not None:
        return owner.counts
    inside = abs(track.y_m) < HALF_VIEW * track.x_m
    return inside and math.hypot(near_m(track), track.y_m) < REACH_M

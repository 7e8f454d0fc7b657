"""Who moves, by LiDAR alone: what stands now where a moment ago rays passed through.

A car that comes from the side, on a course that meets ours, stays under one bearing, and that is often wider than the front
camera's view. Two sweeps some tenths of a second apart show it: free space that is taken since can only be taken by who
moved there, while houses, hedges and the shadows that things throw prove nothing and are passed over.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from services.perception.kalman import Fix, Floats
from services.perception.sizes import CAR, LORRY
from services.perception.tracker import EgoState, Sighting

BACK_S, LEAST_BACK_S = 0.4, 0.25
"""How much earlier the sweep is that showed free space; younger ones show too little of who moves."""
BODY_M = (0.3, 2.5)
"""Heights of returns from bodies."""
SENSOR_HEIGHT_M = 1.75
"""Taken for any LiDAR: on the roof, above the ego's origin."""
RAYS_M = (0.25, 1.4)
"""A ray that passes at such a height passes where a vehicle would be."""
NEAR_M, FAR_M, CELL_M = 10.0, 60.0, 1.0
SECTORS = 360
BEHIND_M = 1.0
"""A ray is free up to so far before where it ended."""
GRID_M = 0.8
"""Returns in cells of this size that touch are of one thing."""
AHEAD_M, ASIDE_M = (-2.0, 60.0), 50.0
LEAST_NEW, LEAST_SHARE = 4, 0.2
"""Of a thing's returns, so many lie where it was free: fewer are noise, or the moving edge of a shadow."""
LONG_M, WIDE_M = (1.2, 12.0), 4.0
"""Over ground, the longer and the shorter side of a vehicle as far as it is seen."""
LORRY_M = 6.5
SIGMA_M = (0.3, 0.5)
SCORE = 0.9
"""As sure as a box of that score."""
ACROSS_SIGMA_MPS = 8.0
"""Of its speed across, which nothing tells at first."""

Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class _Swept:
    """A sweep and where the ego stood then, by dead reckoning: x, y and heading since the first."""

    stamp_ns: int
    free: Mask
    """By sector and distance: rays passed, and nothing stood near by."""
    pose: tuple[float, float, float]


@dataclass(slots=True)
class Movers:
    """Give it every sweep in order; it remembers half a second of them."""

    _past: deque[_Swept] = field(default_factory=deque)

    def step(self, stamp_ns: int, points: Floats, ego: EgoState) -> tuple[Sighting, ...]:
        """Moving vehicles in a sweep: returns (N, 3 or more) in the ego frame of its instant, in metres, as `open_sweep` gives them.

        With the ego's motion unknown there are none: standing things would seem to move.
        """
        if ego.speed_mps is None or ego.yaw_rate_radps is None:
            self._past.clear()
            return ()
        pose = self._moved_on(stamp_ns, ego.speed_mps, ego.yaw_rate_radps)
        before = self._before(stamp_ns)
        body = points[(points[:, 2] > BODY_M[0]) & (points[:, 2] < BODY_M[1]), :3]
        self._past.append(_Swept(stamp_ns, _free(points), pose))
        return tuple(_movers(body, before, pose)) if before is not None and len(body) else ()

    def _moved_on(self, stamp_ns: int, speed_mps: float, yaw_rate_radps: float) -> tuple[float, float, float]:
        if not self._past:
            return 0.0, 0.0, 0.0
        dt = (stamp_ns - self._past[-1].stamp_ns) / 1e9
        if not 0.0 < dt <= BACK_S:
            self._past.clear()
            return 0.0, 0.0, 0.0
        x, y, heading = self._past[-1].pose
        middle = heading + yaw_rate_radps * dt / 2
        return (
            x + speed_mps * dt * math.cos(middle),
            y + speed_mps * dt * math.sin(middle),
            heading + yaw_rate_radps * dt,
        )

    def _before(self, stamp_ns: int) -> _Swept | None:
        """The latest sweep that is old enough; the older ones are forgotten."""
        while len(self._past) > 1 and (stamp_ns - self._past[1].stamp_ns) / 1e9 >= BACK_S:
            self._past.popleft()
        old = self._past[0] if self._past else None
        return old if old is not None and (stamp_ns - old.stamp_ns) / 1e9 >= LEAST_BACK_S else None


def _free(points: Floats) -> Mask:
    """By sector and metre: whether rays passed at a body's height, in the sectors beside too, and no body stood near by."""
    cells = int(FAR_M / CELL_M)
    away = np.hypot(points[:, 0], points[:, 1])
    sector = _sector(points)
    fall = np.maximum(SENSOR_HEIGHT_M - points[:, 2], 1e-3)
    enters = away * (SENSOR_HEIGHT_M - RAYS_M[1]) / fall
    leaves = np.minimum(away - BEHIND_M, away * (SENSOR_HEIGHT_M - RAYS_M[0]) / fall)
    first, last = np.ceil(enters / CELL_M).astype(int), np.floor(leaves / CELL_M).astype(int)
    passing = (last > first) & (first < cells) & (points[:, 2] < RAYS_M[1])
    steps = np.zeros((SECTORS, cells + 1), np.int32)
    np.add.at(steps, (sector[passing], first[passing]), 1)
    np.add.at(steps, (sector[passing], np.minimum(last[passing], cells)), -1)
    passed = steps.cumsum(axis=1)[:, :cells] > 0
    stood = np.zeros((SECTORS, cells), bool)
    body = (points[:, 2] > BODY_M[0]) & (away < FAR_M)
    stood[sector[body], (away[body] / CELL_M).astype(int)] = True
    stood[:, 1:] |= stood[:, :-1]
    stood[:, :-1] |= stood[:, 1:].copy()
    open_cells = passed & ~stood
    both: Mask = open_cells & np.roll(open_cells, 1, axis=0) & np.roll(open_cells, -1, axis=0)
    return both


def _sector(points: Floats) -> NDArray[np.int_]:
    angle = np.arctan2(points[:, 1], points[:, 0])
    return ((angle + math.pi) / (2 * math.pi) * SECTORS).astype(int) % SECTORS


def _movers(body: Floats, before: _Swept, pose: tuple[float, float, float]) -> Iterator[Sighting]:
    inside = (body[:, 0] > AHEAD_M[0]) & (body[:, 0] < AHEAD_M[1]) & (np.abs(body[:, 1]) < ASIDE_M)
    body = body[inside & (np.hypot(body[:, 0], body[:, 1]) > NEAR_M)]
    new = _was_free(body, before, pose)
    if int(new.sum()) < LEAST_NEW:
        return
    thing = _things(body)
    for number in np.unique(thing[new]).tolist():
        own = thing == number
        mover = _vehicle(body[own])
        if mover is not None and int((own & new).sum()) >= max(LEAST_NEW, LEAST_SHARE * int(own.sum())):
            yield mover


def _was_free(body: Floats, before: _Swept, pose: tuple[float, float, float]) -> Mask:
    """Which returns lie where the sweep before passed through."""
    turned = pose[2] - before.pose[2]
    dx, dy = pose[0] - before.pose[0], pose[1] - before.pose[1]
    c, s = math.cos(before.pose[2]), math.sin(before.pose[2])
    forward, left = dx * c + dy * s, dy * c - dx * s
    ct, st = math.cos(turned), math.sin(turned)
    there = np.stack([forward + ct * body[:, 0] - st * body[:, 1], left + st * body[:, 0] + ct * body[:, 1]], axis=1)
    cell = (np.hypot(there[:, 0], there[:, 1]) / CELL_M).astype(int)
    known = cell < before.free.shape[1]
    was: Mask = known & before.free[_sector(there), np.minimum(cell, before.free.shape[1] - 1)]
    return was


def _things(body: Floats) -> NDArray[np.int_]:
    """For each return which thing it belongs to."""
    column = ((body[:, 0] - AHEAD_M[0]) / GRID_M).astype(int)
    row = ((body[:, 1] + ASIDE_M) / GRID_M).astype(int)
    grid = np.zeros((int(2 * ASIDE_M / GRID_M) + 1, int((AHEAD_M[1] - AHEAD_M[0]) / GRID_M) + 1), np.uint8)
    grid[row, column] = 1
    _, named = cv2.connectedComponents(grid, connectivity=8)
    numbers: NDArray[np.int_] = named[row, column].astype(int)
    return numbers


def _vehicle(thing: Floats) -> Sighting | None:
    """The sighting of a thing; None where it is too small or too large for a vehicle."""
    low, high = thing[:, :2].min(axis=0), thing[:, :2].max(axis=0)
    short_m, long_m = sorted((high - low).tolist())
    if not LONG_M[0] <= long_m <= LONG_M[1] or short_m > WIDE_M:
        return None
    place = np.array([low[0], (low[1] + high[1]) / 2])
    return Sighting(
        kind="vehicle",
        fix=Fix(place, np.diag([SIGMA_M[0] ** 2, SIGMA_M[1] ** 2])),
        score=SCORE,
        body=LORRY if long_m > LORRY_M else CAR,
        across_sigma_mps=ACROSS_SIGMA_MPS,
    )

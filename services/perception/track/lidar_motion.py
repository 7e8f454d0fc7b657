"""Moving objects by LiDAR alone: returns where rays passed freely a moment ago.

A car that comes from the side, on a course that meets ours, stays under one bearing, and that is often wider than the front
camera's view. Two sweeps some tenths of a second apart show it: free space that is taken since can only be taken by an
object that moved there. Houses, hedges and the shadows that things throw prove nothing and are passed over.
An object that is seen so in three sweeps has a velocity, if the two earlier ones agree on it.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from services.perception.range.sizes import CAR, LORRY
from services.perception.track.kalman import Fix, Floats
from services.perception.track.road_user import EgoState, OverGround, Sighting

BACK_S, LEAST_BACK_S = 0.4, 0.25
"""How much earlier the sweep is that showed free space; younger ones show too little of the vehicles that move."""
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
HIDDEN_M = 6.0
"""So far behind a return is the rest of the same body: rays that pass over a bonnet or a roof show nothing of what stands below them.
A body that a ray at `SENSOR_HEIGHT_M` passes over is no longer than a car."""
GRID_M = 0.8
"""Returns in cells of this size that touch are of one thing."""
AHEAD_M, ASIDE_M = (-2.0, 60.0), 50.0
LEAST_NEW, LEAST_SHARE = 4, 0.2
"""Of a thing's returns, so many lie where it was free: fewer are noise, or the moving edge of a shadow."""
LEAST_BEARINGS, BESIDE_DEG, SAME_DEG = 2, 1.0, 0.1
"""They come from so many rays side by side: a post is thinner than the gap between two rays, and slips through it at times. Of 700
rows of two to four posts, 0.35 to 1 m apart, 13 still seem to move. With three rays as many do, and a vehicle that crosses 45 m away
was missed."""
LONG_M, WIDE_M = (1.2, 12.0), 4.0
"""Over ground, the longer and the shorter side of a vehicle as far as it is seen."""
LORRY_M = 6.5
SIGMA_M = (0.3, 0.5)
SCORE = 0.9
"""As sure as a box of that score."""
ACROSS_SIGMA_MPS = 8.0
"""Of its speed across, which nothing tells at first."""

FIRST_STEP_M, SIGMAS = 3.0, 3.0
"""Where it was before is looked for so far about, where no other road user can have been; or, where a velocity is known already, so many
sigmas of that."""
PART_M = 0.6
"""So much less or more of a thing may show: returns lie that far from each other."""
LEAST_AGREE = 2
"""Of sweeps: in one alone rain may have hidden a part of it."""
EDGE_SIGMA_M = 0.22
"""How well the way of its edges is known from one sweep to another: mostly to 0.03 m. Where rain hides its leading end in one of
them, the way is off by up to `PART_M` and the returns' scatter, which is three of these sigmas."""

Mask = NDArray[np.bool_]
Pose = tuple[float, float, float]
"""x, y and heading."""
Step = tuple[float, float]
"""Ahead and to the left, in metres."""
_Past = tuple[float, list[Floats]]
"""How long ago (s), and what moved then, in the present frame."""


@dataclass(frozen=True, slots=True, eq=False)
class _Swept:
    """A sweep and where the ego stood then, by dead reckoning: x, y and heading since the first."""

    stamp_ns: int
    free: Mask
    """By sector and distance: rays passed, and nothing stood near by."""
    pose: Pose
    moved: list[Floats] = field(default_factory=list)
    """The returns of each thing that had moved."""


@dataclass(slots=True)
class LidarMotion:
    """Give it every sweep in order; it remembers half a second of them."""

    _past: deque[_Swept] = field(default_factory=deque)

    def step(self, stamp_ns: int, points: Floats, ego: EgoState) -> tuple[Sighting, ...]:
        """Moving vehicles in a sweep: returns (N, 3 or more) in the ego frame of its instant, in metres, as `open_sweep` gives them.

        With the ego's motion unknown the result is empty: standing things would seem to move.
        """
        if ego.speed_mps is None or ego.yaw_rate_radps is None:
            self._past.clear()
            return ()
        pose = self._moved_on(stamp_ns, ego.speed_mps, ego.yaw_rate_radps)
        before = self._before(stamp_ns)
        body = points[(points[:, 2] > BODY_M[0]) & (points[:, 2] < BODY_M[1]), :3]
        now = _Swept(stamp_ns, _free(points), pose)
        if before is not None and len(body):
            now.moved.extend(_movers(body, pose, before))
        past = self._earlier(now) if now.moved else []
        told = tuple(_sighting(thing, _velocity(thing, past)) for thing in now.moved)
        self._past.append(now)
        return told

    def _earlier(self, now: _Swept) -> list[_Past]:
        """Earlier sweeps, the latest first."""
        return [
            ((now.stamp_ns - before.stamp_ns) / 1e9, [_seen_from(now.pose, each, before.pose) for each in before.moved])
            for before in reversed(self._past)
        ]

    def _moved_on(self, stamp_ns: int, speed_mps: float, yaw_rate_radps: float) -> Pose:
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
    stood[:, :-1] |= stood[:, 1:].copy()
    stood = _with_the_rest(stood)
    open_cells = passed & ~stood
    both: Mask = open_cells & np.roll(open_cells, 1, axis=0) & np.roll(open_cells, -1, axis=0)
    return both


def _with_the_rest(stood: Mask) -> Mask:
    """With all cells up to `HIDDEN_M` behind each that holds a return, in the same sector."""
    behind = int(HIDDEN_M / CELL_M)
    before = np.pad(stood.cumsum(axis=1), ((0, 0), (behind + 1, 0)))
    hidden: Mask = before[:, behind + 1 :] > before[:, : -(behind + 1)]
    return hidden


def _sector(points: Floats) -> NDArray[np.int_]:
    angle = np.arctan2(points[:, 1], points[:, 0])
    return ((angle + math.pi) / (2 * math.pi) * SECTORS).astype(int) % SECTORS


def _movers(body: Floats, pose: Pose, before: _Swept) -> Iterator[Floats]:
    """Returns (N, 2) of each thing that is as large as a vehicle and stands where the sweep before passed through."""
    inside = (body[:, 0] > AHEAD_M[0]) & (body[:, 0] < AHEAD_M[1]) & (np.abs(body[:, 1]) < ASIDE_M)
    body = body[inside & (np.hypot(body[:, 0], body[:, 1]) > NEAR_M), :2]
    new = _free_in(before, _seen_from(before.pose, body, pose))
    if int(new.sum()) < LEAST_NEW:
        return
    number = _things(body)
    for each in np.unique(number[new]).tolist():
        own = number == each
        enough = int((own & new).sum()) >= max(LEAST_NEW, LEAST_SHARE * int(own.sum()))
        if enough and _like_a_vehicle(body[own]) and _side_by_side(body[own & new]) >= LEAST_BEARINGS:
            yield body[own]


def _seen_from(pose: Pose, points: Floats, taken_from: Pose) -> Floats:
    """Points (N, 2) in the ego frame of one pose that were taken from another."""
    turned = taken_from[2] - pose[2]
    dx, dy = taken_from[0] - pose[0], taken_from[1] - pose[1]
    c, s = math.cos(pose[2]), math.sin(pose[2])
    forward, left = dx * c + dy * s, dy * c - dx * s
    ct, st = math.cos(turned), math.sin(turned)
    x, y = points[:, 0], points[:, 1]
    return np.stack([forward + ct * x - st * y, left + st * x + ct * y], axis=1)


def _free_in(swept: _Swept, points: Floats) -> Mask:
    """Which points (N, 2), in its frame, the rays of a sweep passed through."""
    cell = (np.hypot(points[:, 0], points[:, 1]) / CELL_M).astype(int)
    known = cell < swept.free.shape[1]
    free: Mask = known & swept.free[_sector(points), np.minimum(cell, swept.free.shape[1] - 1)]
    return free


def _things(body: Floats) -> NDArray[np.int_]:
    """For each return which thing it belongs to."""
    column = ((body[:, 0] - AHEAD_M[0]) / GRID_M).astype(int)
    row = ((body[:, 1] + ASIDE_M) / GRID_M).astype(int)
    grid = np.zeros((int(2 * ASIDE_M / GRID_M) + 1, int((AHEAD_M[1] - AHEAD_M[0]) / GRID_M) + 1), np.uint8)
    grid[row, column] = 1
    _, named = cv2.connectedComponents(grid, connectivity=8)
    numbers: NDArray[np.int_] = named[row, column].astype(int)
    return numbers


def _like_a_vehicle(thing: Floats) -> bool:
    short_m, long_m = sorted(np.ptp(thing, axis=0).tolist())
    return bool(LONG_M[0] <= long_m <= LONG_M[1] and short_m <= WIDE_M)


def _side_by_side(points: Floats) -> int:
    """The most rays side by side, whatever their heights, that these returns (N, 2) came from."""
    bearings = np.sort(np.degrees(np.arctan2(points[:, 1], points[:, 0])))
    gaps = np.diff(bearings)
    most = row = 1
    for gap in gaps[gaps > SAME_DEG].tolist():
        row = row + 1 if gap < BESIDE_DEG else 1
        most = max(most, row)
    return most


def _velocity(thing: Floats, past: Sequence[_Past]) -> OverGround | None:
    """Its velocity since it was first seen to move: from the latest sweep that shows it, alone, on to earlier ones that agree."""
    found: OverGround | None = None
    agree = 0
    for between_s, moved in past:
        steps = [_step(thing, each) for each in moved]
        earlier = _over_ground([step for step in steps if step is not None], between_s, found)
        agree += earlier is not None
        found = earlier or found
    return found if agree >= LEAST_AGREE else None


def _over_ground(steps: list[Step], between_s: float, known: OverGround | None) -> OverGround | None:
    """The velocity that one of these steps tells, and no other can.

    With one known, that of a shorter time, it is sought where that leads.
    """
    if known is None:
        ahead_m, across_m, about_m = 0.0, 0.0, FIRST_STEP_M
    else:
        about_m = SIGMAS * known.sigma_mps * between_s
        ahead_m, across_m = known.ahead_mps * between_s, known.across_mps * between_s
    near = [step for step in steps if math.hypot(step[0] - ahead_m, step[1] - across_m) < about_m]
    if len(near) != 1:
        return None
    ((ahead_m, across_m),) = near
    return OverGround(ahead_m / between_s, across_m / between_s, EDGE_SIGMA_M / between_s)


def _step(thing: Floats, before: Floats) -> Step | None:
    """How far a vehicle's near end came ahead and its leading side across; None where one place shows another part of it.

    The middle does not tell: that of a vehicle which comes out from behind a house moves half as fast. The side behind comes as far
    as the leading one, or stands, at the house's corner.
    """
    low_m, high_m = thing.min(axis=0) - before.min(axis=0), thing.max(axis=0) - before.max(axis=0)
    sides_m = float(low_m[1]), float(high_m[1])
    across_m, behind_m = sides_m if sum(sides_m) < 0 else sides_m[::-1]
    lags_m = across_m - behind_m
    if min(abs(lags_m), abs(behind_m)) > PART_M:
        return None
    return float(low_m[0]), across_m


def _sighting(thing: Floats, over_ground: OverGround | None) -> Sighting:
    low, high = thing.min(axis=0), thing.max(axis=0)
    return Sighting(
        kind="vehicle",
        fix=Fix(np.array([low[0], (low[1] + high[1]) / 2]), np.diag([SIGMA_M[0] ** 2, SIGMA_M[1] ** 2])),
        score=SCORE,
        body=LORRY if float((high - low).max()) > LORRY_M else CAR,
        across_sigma_mps=ACROSS_SIGMA_MPS,
        over_ground=over_ground,
        boxed=False,
    )

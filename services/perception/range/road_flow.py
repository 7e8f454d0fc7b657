"""The focal length of a camera whose field of view was not given, from the road that flows past at a known speed.

A point of a level road, `a` rows below the horizon and `b` rows after the ego drove `d` metres, tells focal length times the camera's
height: d / (1/a - 1/b). Rain on the pane, kerbs and cars tell something else, each its own: of all horizons and focal lengths those
count on which most points agree. They give the pitch as well.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import cv2
import msgspec
import numpy as np

from domain.cameras import ASSUMED_FOV_DEG, FOCAL_SPREAD
from services.perception.detect.detection import Detection
from services.perception.range.camera import PITCH_SIGMA_RAD, Camera, Floats

Image = np.ndarray[Any, np.dtype[np.uint8]]
SLOWEST_MPS, LONGEST_S = 5.0, 0.15
"""A slower ego moves the road by too little; after a longer pause other points are taken for the same (of a motorway's pictures 0.2 s
apart: a focal length 40 % too long)."""
ABOVE, ROWS, COLUMNS = 0.45, (0.6, 0.95), (0.15, 0.85)
"""Where in the picture the road before the ego is, as shares of its height and width; what is higher is not looked at."""
CORNERS, QUALITY, APART_PX, WINDOW_PX, LEVELS = 120, 0.03, 7, 7, 4
"""A small window: the road near by grows by a third from picture to picture, and a larger one loses it."""
BACK_PX, AROUND_PX = 1.0, 10
"""A point is the same one if it is found again from there, by so much; so far around a box all is the box's."""
ENOUGH, MOST = 600, 2000
"""Points: each time that so many are new it is tried, on the latest of them. The answer is found once, so that ranges jump once."""
HORIZONS = (0.25, 0.65, 101)
LEAST_A, LEAST_MOVE = 1 / 30, 1 / 240
"""Of the picture's height: points nearer to the horizon, or that move by less, tell nothing."""
AGREEMENT, LEAST_SHARE = 0.1, 0.12
"""Points agree within this (logarithm of the focal length); where a smaller share of them does, nothing was found: of points that move at
random up to 0.08 do."""
NEARLY = 0.9
"""Of horizons on which about as many points agree, that counts on which they agree best."""
ALIKE = 0.15
"""Two halves of the points must tell the same focal length, to this logarithm."""
FOCAL_SHARES = (0.3, 1.6)
"""Of the picture's width: 118 to 35 degrees. What is found beyond is not believed."""
LEARNED_SPREAD = 0.18
"""One sigma of what is found: the camera's height is assumed, 1.4 m by 0.2 m, what was found in drawn and rendered
drives was off by up to 7 %."""


class Found(NamedTuple):
    """A focal length, and the row of the horizon."""

    focal_px: float
    horizon_px: float


class RoadFlow:
    """One for each camera whose field of view was not given."""

    def __init__(self) -> None:
        self._before: tuple[int, Image] | None = None
        self._points, self._new = np.zeros((0, 3)), 0
        self.found: Found | None = None
        self.told = f"{ASSUMED_FOV_DEG:.0f} degrees assumed, ranges to {FOCAL_SPREAD:.0%}"

    def learn(
        self, stamp_ns: int, rgb: Image, boxes: Sequence[Detection], speed_mps: float | None, level: Camera
    ) -> None:
        """Take in a picture; road users' `boxes` hide the road."""
        if self.found is not None or speed_mps is None or speed_mps < SLOWEST_MPS:
            self._before = None
            return
        grey = np.asarray(cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY), np.uint8)
        before, self._before = self._before, (stamp_ns, grey)
        took_s = (stamp_ns - before[0]) / 1e9 if before is not None else 0.0
        if before is None or not 0.0 < took_s <= LONGEST_S or before[1].shape != grey.shape:
            return
        rows = moved_rows(before[1], grey, boxes)
        moved = np.column_stack([rows, np.full(len(rows), speed_mps * took_s)])
        self._points, self._new = np.concatenate([self._points, moved])[-MOST:], self._new + len(moved)
        if self._new >= ENOUGH:
            c, self._new = level.calibration, 0
            halves = [focal_of(self._points[i::2], c.width_px, c.height_px, c.z_m) for i in (0, 1)]
            self.found = focal_of(self._points, c.width_px, c.height_px, c.z_m) if alike(*halves) else None
            if self.found is not None:
                fov_deg = 2 * math.degrees(math.atan(c.width_px / 2 / self.found.focal_px))
                self.told = f"{fov_deg:.0f} degrees learned from the road, ranges to {LEARNED_SPREAD:.0%}"

    def apply(self, camera: Camera) -> Camera:
        """The camera with the focal length and pitch found, and what doubt is left; as it was where nothing was found yet."""
        if self.found is None:
            return camera
        c, (focal_px, horizon_px) = camera.calibration, self.found
        pitch = math.atan((horizon_px - c.cy_px) / focal_px)
        told = msgspec.structs.replace(c, fx_px=focal_px, fy_px=focal_px, pitch_rad=pitch, focal_spread=LEARNED_SPREAD)
        tilted = Camera.of(told)
        return Camera(told, tilted.axes, tilted.eye, 2.5 * PITCH_SIGMA_RAD)


def moved_rows(before: Image, now: Image, boxes: Sequence[Detection]) -> Floats:
    """The rows (N, 2) of points of the road in the picture before and in this one."""
    height, width = now.shape
    mask = np.zeros_like(now)
    mask[int(ROWS[0] * height) : int(ROWS[1] * height), int(COLUMNS[0] * width) : int(COLUMNS[1] * width)] = 255
    for box in boxes:
        x0, y0, x1, y1 = (max(0, int(edge)) for edge in box.box_px)
        mask[max(0, y0 - AROUND_PX) : y1 + AROUND_PX, max(0, x0 - AROUND_PX) : x1 + AROUND_PX] = 0
    top = int(ABOVE * height)
    before, now = before[top:], now[top:]
    here = cv2.goodFeaturesToTrack(now, CORNERS, QUALITY, APART_PX, mask=mask[top:])
    if here is None:
        return np.zeros((0, 2))  # type: ignore[unreachable]  # where there is no corner, whatever OpenCV's stubs say
    size = (WINDOW_PX, WINDOW_PX)
    there, seen, _ = cv2.calcOpticalFlowPyrLK(now, before, here, here.copy(), winSize=size, maxLevel=LEVELS)
    again, back, _ = cv2.calcOpticalFlowPyrLK(before, now, there, there.copy(), winSize=size, maxLevel=LEVELS)
    same = (seen[:, 0] == 1) & (back[:, 0] == 1) & (np.abs(again - here).max(axis=(1, 2)) < BACK_PX)
    return np.column_stack([there[same, 0, 1], here[same, 0, 1]]).astype(np.float64) + top


def alike(one: Found | None, other: Found | None) -> bool:
    """Whether two sets of points tell the same."""
    return one is not None and other is not None and abs(math.log(one.focal_px / other.focal_px)) <= ALIKE


def focal_of(points: Floats, width_px: int, height_px: int, camera_height_m: float) -> Found | None:
    """What most points (N, 3: rows before and after, metres driven) agree on; None where they do not, or it cannot be."""
    seen: list[tuple[int, float, Found]] = []
    for horizon_px in np.linspace(*HORIZONS[:2], HORIZONS[2]) * height_px:
        a, b = points[:, 0] - horizon_px, points[:, 1] - horizon_px
        told = (a > LEAST_A * height_px) & (b > a + LEAST_MOVE * height_px)
        focals = np.sort(np.log(points[told, 2] / (1 / a[told] - 1 / b[told]) / camera_height_m))
        counts = np.searchsorted(focals, focals + AGREEMENT, side="right") - np.arange(len(focals))
        if len(focals) and counts.max() > LEAST_SHARE * len(points):
            agreeing = focals[counts.argmax() :][: counts.max()]
            found = Found(math.exp(float(np.median(agreeing))), float(horizon_px))
            seen.append((int(counts.max()), float(agreeing.std()), found))
    most = max((count for count, *_ in seen), default=0)
    best = min(((spread, found) for count, spread, found in seen if count >= NEARLY * most), default=None)
    if best is None or not FOCAL_SHARES[0] <= best[1].focal_px / width_px <= FOCAL_SHARES[1]:
        return None
    return best[1]

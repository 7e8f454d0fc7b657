"""What of a picture depends on the weather, as numbers: brightness and contrast over distance, streaks, mirrored lamps.

Distances come from the calibration and a level road. Air adds its own light with distance (Koschmieder 1924): what is
dark brightens towards the horizon, and contrast falls as exp(-beta d). A wet road is dark near the car and mirrors the
sky far off (Fresnel). Rain draws upright streaks of equal strength everywhere. All brightness is relative to the
picture's own, because every camera exposes in its own way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from services.perception.detect.detector import Picture
from services.perception.range.camera import Camera, Floats

Numbers = NDArray[np.float32]
WIDTH_PX = 640
"""Pictures are brought to this width: streaks and grain are counted in pixels."""
AHEAD_M = np.geomspace(3.6, 90.0, 20)
ACROSS_M = np.linspace(-14.0, 14.0, 57)
OWN, ROAD = np.abs(ACROSS_M) <= 1.5, np.abs(ACROSS_M) <= 5.0
NEAR_M, LANE_M = np.linspace(6.0, 20.0, 40), np.linspace(-1.6, 1.6, 48)
RANGES = 4
"""The distances by fours: what one range says of grass and sky, single ones would say noisily."""
GREEN = 1.1
"""Grass: green by this share above the other colours."""
BANDS_DEG = np.array([-1.5, -0.5, 0.0, 0.5, 1.0, 2.0, 3.5, 5.5, 8.0, 11.0])
"""Edges of bands about the horizon, upwards."""
BETAS_PER_M = np.geomspace(0.001, 0.1, 13)
MIRRORS = [0, 3, 6, 9]
RIDGE = 1e-4
TILES = (6, 8)
STREAK_PX = 13
SHARES = (0.1, 0.25, 0.5, 0.75)
SCALED = np.arange(256, dtype=np.float32) / 255.0
SQUARES = np.square(SCALED)
FLOOR = 0.004
"""Linear light (0 to 1) below which a camera sees only its own noise."""


@dataclass(frozen=True, slots=True, eq=False)
class Planes:
    """A picture prepared, all float32, 0 to 1: linear light (H / 2, W / 2, 3) and its mean, grey (H, W) as the camera codes it."""

    linear: Numbers
    light: Numbers
    grey: Numbers

    @staticmethod
    def of(picture: Picture) -> Planes:
        """From RGB."""
        half = cv2.resize(picture, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)
        linear = SQUARES[half]
        light = cv2.transform(linear, np.full((1, 3), 1 / 3, np.float32))
        return Planes(linear, light.astype(np.float32, copy=False), SCALED[cv2.cvtColor(picture, cv2.COLOR_RGB2GRAY)])


def features(picture: Picture, camera: Camera) -> Numbers:
    """All numbers of one RGB picture (H, W, 3), always as many; `camera` is of the picture's size."""
    picture, camera = _sized(picture, camera)
    planes = Planes.of(picture)
    level = float(np.exp(np.log(planes.light + FLOOR).mean()))
    bands = _bands(planes, camera, level)
    own, verge, road = _road(planes, camera, level)
    sky = bands[-3:, 2].mean()
    beside = np.concatenate([own - verge, own - sky, own[:-1] - own[-1:], [math.log(level)]])
    lane = _lane(planes.grey, camera)
    return np.concatenate([beside, verge, road, bands.ravel(), lane, _streaks(planes.grey)]).astype(np.float32)


def _sized(picture: Picture, camera: Camera) -> tuple[Picture, Camera]:
    height, width = picture.shape[:2]
    if width == WIDTH_PX:
        return picture, camera
    size = (WIDTH_PX, max(1, round(height * WIDTH_PX / width)))
    return cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.uint8, copy=False), camera.scaled(*size)


def _road(planes: Planes, camera: Camera, level: float) -> tuple[Floats, Floats, Floats]:
    """From above: the own lane's light and the grass's in four ranges, and more by distance: spread, colour, extinction."""
    pixels = 0.5 * _ground_pixels(camera, AHEAD_M, ACROSS_M)
    seen_from_above = cv2.remap(
        planes.linear, pixels[..., 0], pixels[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    ground: Numbers = seen_from_above.astype(np.float32, copy=False)
    seen = ground[:, ROAD]
    light = seen.mean(axis=2)
    own = np.median(ground[:, OWN].mean(axis=2), axis=1)
    low, high = np.quantile(light, (0.1, 0.95), axis=1)
    middle = np.median(ground[:, OWN], axis=1)
    red = np.quantile(seen[..., 0] - seen[..., 1:].max(axis=2), 0.98, axis=1)
    colour = (middle[:, 2] - middle[:, 0]) / (middle.mean(axis=1) + FLOOR)
    more = [_log(own / level), _log(low / level), _log(high / level), np.log((high + FLOOR) / (low + FLOOR))]
    eye_m, wide = float(camera.eye[2]), np.median(light, axis=1)
    fits = [_fits(own, eye_m), _fits(wide, eye_m)]
    told = np.concatenate([*more, colour, _log(np.maximum(red, 0.0) / level), _log(wide / level), *fits])
    return _ranged(_log(own / level)), _verge(ground, level), told


def _ranged(values: Floats) -> Floats:
    told: Floats = values.reshape(RANGES, -1).mean(axis=1)
    return told


def _verge(ground: Numbers, level: float) -> Floats:
    """The light of what is green on the ground, range by range; 0 where nothing is."""
    green = ground[..., 1] > GREEN * np.maximum(ground[..., 0], ground[..., 2])
    count = green.reshape(RANGES, -1).sum(axis=1)
    light = (ground.mean(axis=2) * green).reshape(RANGES, -1).sum(axis=1)
    return np.where(count > 3, _log(light / np.maximum(count, 1) / level), 0.0)


def _lane(grey: Numbers, camera: Camera) -> Floats:
    """The grain of the own lane's surface, 6 to 20 m ahead, and how it differs along and across: water evens it and mirrors upright."""
    pixels = _ground_pixels(camera, NEAR_M, LANE_M)
    seen = cv2.remap(grey, pixels[..., 0], pixels[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    mean = seen.mean() + 0.02
    fine = cv2.absdiff(seen, cv2.blur(seen, (3, 3))).mean() / mean
    broad = cv2.blur(seen, (5, 5))
    along, across = np.abs(np.diff(broad, axis=0)).mean() / mean, np.abs(np.diff(broad, axis=1)).mean() / mean
    columns, rows = broad.mean(axis=0).std() / mean, broad.mean(axis=1).std() / mean
    marks = np.quantile(seen, (0.02, 0.5, 0.98)) / mean
    return np.log(np.concatenate([[fine, along, across, along / (across + 1e-4), columns, rows], marks]) + 1e-3)


def _ground_pixels(camera: Camera, ahead_m: Floats, across_m: Floats) -> Numbers:
    """Where the picture shows the road so far ahead (N) and to the left (M): (N, M, 2)."""
    ahead, across = np.meshgrid(ahead_m, across_m, indexing="ij")
    ground = np.stack([ahead + camera.eye[0], across + camera.eye[1], np.zeros_like(ahead)], axis=-1)
    return camera.project(ground.reshape(-1, 3))[0].reshape(*ahead.shape, 2).astype(np.float32)


def _fits(profile: Floats, eye_m: float) -> Floats:
    """For each extinction: the share of the profile's variance that it leaves unexplained, and how much mirror it takes.

    Light at a distance is `a t + m t f + c (1 - t)`: the road's own, the sky in a wet road (f by Schlick, of the grazing
    angle), the air's; t is exp(-beta d).
    """
    through = np.exp(-BETAS_PER_M[:, None] * AHEAD_M)
    mirror = np.power(1.0 - eye_m / np.hypot(AHEAD_M, eye_m), 5)
    bases = np.stack([through, through * mirror, 1.0 - through], axis=2)
    squares = bases.transpose(0, 2, 1) @ bases + RIDGE * np.eye(3)
    shares = np.linalg.solve(squares, (bases.transpose(0, 2, 1) @ profile)[..., None])
    left = np.square(profile - (bases @ shares)[..., 0]).sum(axis=1)
    spread = np.square(profile - profile.mean()).sum() + FLOOR**2
    mirrored = shares[:, 1, 0] / (np.abs(shares[:, 0, 0]) + 0.1 * profile.mean() + FLOOR)
    return np.concatenate([np.log(left / spread + 1e-3), np.clip(mirrored[MIRRORS], -20.0, 20.0)])


def _bands(planes: Planes, camera: Camera, level: float) -> Floats:
    """By height over the horizon: quantiles of light and of the darkest colour, colourfulness, contrast of neighbours."""
    c = camera.calibration
    pitch = math.asin(float(np.clip(camera.axes[2, 2], -1.0, 1.0)))
    rows = 0.5 * (c.cy_px - c.fy_px * np.tan(np.radians(BANDS_DEG) - pitch))
    edges = np.clip(np.round(rows), 1, planes.light.shape[0] - 1).astype(int)
    return np.stack([_band(planes, min(top, bottom - 1), bottom, level) for bottom, top in pairwise(edges)])


def _band(planes: Planes, top: int, bottom: int, level: float) -> Floats:
    linear, light, grey = planes.linear[top:bottom], planes.light[top:bottom], planes.grey[2 * top : 2 * bottom]
    darkest = cv2.min(cv2.min(linear[..., 0], linear[..., 1]), linear[..., 2])
    spread = np.quantile(light, (0.03, 0.25, 0.5, 0.9))
    dark = np.quantile(darkest, (0.03, 0.25))
    colourful = np.mean((light - darkest) / (light + FLOOR))
    sideways = cv2.absdiff(grey[:, 1:], grey[:, :-1]).mean() / (grey.mean() + 0.02)
    return np.concatenate([_log(spread / level), _log(dark / level), [colourful, math.log(sideways + 1e-3)]])


def _streaks(grey: Numbers) -> Floats:
    """Thin upright lines against thin level ones, tile by tile: rain is everywhere, a post is not."""
    upright = _moments(_lines(grey, (9, 1), (1, STREAK_PX)))
    level = _moments(_lines(grey, (1, 9), (STREAK_PX, 1)))
    grain = np.log(_by_tile(np.abs(grey - cv2.blur(grey, (3, 3)))) + 2e-4)
    columns = [*upright, *level, upright[0] - level[0], grain]
    halves = (slice(None, TILES[0] // 2), slice(TILES[0] // 2, None))
    return np.concatenate([np.quantile(column[half], SHARES) for column in columns for half in halves])


def _lines(grey: Numbers, across: tuple[int, int], along: tuple[int, int]) -> Numbers:
    fine = grey - cv2.blur(grey, across)
    return cv2.blur(fine, along).astype(np.float32, copy=False)


def _moments(plane: Numbers) -> tuple[Numbers, Numbers]:
    """Logarithm of the spread, and skewness, of each tile."""
    square = plane * plane
    spread = np.sqrt(_by_tile(square))
    return np.log(spread + 2e-4), np.clip(_by_tile(square * plane) / (spread**3 + 1e-9), -5.0, 5.0)


def _by_tile(plane: Numbers) -> Numbers:
    """Means of tiles, rows from the top."""
    return cv2.resize(plane, TILES[::-1], interpolation=cv2.INTER_AREA).astype(np.float32, copy=False)


def _log(share: NDArray[np.floating[Any]]) -> Floats:
    told: Floats = np.log(share + 0.01)
    return told

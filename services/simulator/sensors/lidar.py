"""A spinning LiDAR of 32 rings and 512 columns: rays against flat ground and oriented boxes, in numpy.

Rain weakens returns with the way there and back, drops some, and scatters some back close to the sensor (shape after
Goodin et al. 2019; the constants are ours, provisional).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

RINGS, COLUMNS = 32, 512
LOWEST_RAD, HIGHEST_RAD = math.radians(-18.0), math.radians(6.0)
HEIGHT_M = 1.75
MAX_RANGE_M = 100.0
NOISE_M = 0.03
GROUND_INTENSITY, BODY_INTENSITY = 0.12, 0.55
Floats = NDArray[np.float32]
Reals = NDArray[np.floating]


@dataclass(frozen=True, slots=True)
class BoxOnGround:
    """An oriented box in the ego frame: centre on the ground, yaw anticlockwise, metres. What hangs begins at a height."""

    x_m: float
    y_m: float
    yaw_rad: float
    length_m: float
    width_m: float
    height_m: float
    base_m: float = 0.0


def _rings() -> Floats:
    return np.linspace(LOWEST_RAD, HIGHEST_RAD, RINGS, dtype=np.float32)


_ELEVATION = _rings()
_AZIMUTH = (np.arange(COLUMNS, dtype=np.float32) / COLUMNS * 2 * np.pi - np.pi).astype(np.float32)
_COS_E, _SIN_E = np.cos(_ELEVATION)[:, None], np.sin(_ELEVATION)[:, None]
_COS_A, _SIN_A = np.cos(_AZIMUTH), np.sin(_AZIMUTH)
_GROUND_M = np.where(_SIN_E < -1e-3, -HEIGHT_M / np.minimum(_SIN_E, -1e-3), np.inf).astype(np.float32)


def sweep(boxes: Sequence[BoxOnGround], rain_mm_h: float, chance: np.random.Generator) -> Floats:
    """Returns of one turn: rows (x, y, z, intensity) in the ego frame, float32, shape (N, 4)."""
    ranges = np.broadcast_to(_GROUND_M, (RINGS, COLUMNS)).copy()
    intensity = np.full((RINGS, COLUMNS), GROUND_INTENSITY, dtype=np.float32)
    for box in boxes:
        _hit(box, ranges, intensity)
    noise = chance.standard_normal((RINGS, COLUMNS), dtype=np.float32)
    luck = chance.random((RINGS, COLUMNS), dtype=np.float32)
    seen = ranges <= MAX_RANGE_M
    ranges += noise * NOISE_M
    if rain_mm_h > 0.0:
        seen, ranges = _rain(ranges, seen, luck, rain_mm_h, chance)
    # Far and dull returns are lost now and then even on a dry day.
    seen &= luck < 1.0 - 0.25 * (ranges / MAX_RANGE_M) ** 2
    return _points(ranges, intensity, seen)


def _hit(box: BoxOnGround, ranges: Floats, intensity: Floats) -> None:
    """Shorten the rays that meet the box; only columns that can are looked at."""
    columns = _columns(box)
    if columns is None:
        return
    c, s = math.cos(box.yaw_rad), math.sin(box.yaw_rad)
    # The sensor and the rays in the box's own frame, where its sides are the planes |u| = length/2, |v| = width/2.
    u0, v0 = -(box.x_m * c + box.y_m * s), box.x_m * s - box.y_m * c
    du, dv = _COS_A[columns] * c + _SIN_A[columns] * s, _SIN_A[columns] * c - _COS_A[columns] * s
    near_u, far_u = _slab(u0, du, box.length_m / 2)
    near_v, far_v = _slab(v0, dv, box.width_m / 2)
    near, far = np.maximum(near_u, near_v), np.minimum(far_u, far_v)
    flat = np.where((near <= far) & (near > 0.5), near, np.inf)  # distance on the ground, per column
    along = flat[None, :] / _COS_E
    height = HEIGHT_M + flat[None, :] * (_SIN_E / _COS_E)
    part = ranges[:, columns]
    met = (height >= box.base_m) & (height <= box.height_m) & (along < part)
    ranges[:, columns] = np.where(met, along, part)
    intensity[:, columns] = np.where(met, np.float32(BODY_INTENSITY), intensity[:, columns])


def _columns(box: BoxOnGround) -> NDArray[np.intp] | None:
    distance, radius = math.hypot(box.x_m, box.y_m), math.hypot(box.length_m, box.width_m) / 2
    if distance - radius > MAX_RANGE_M:
        return None
    if distance <= radius + 0.1:  # close by a long one: it may lie all around
        return np.arange(COLUMNS)
    middle, half = math.atan2(box.y_m, box.x_m), math.asin(min(radius / distance, 1.0))
    first = math.floor((middle - half + math.pi) / (2 * math.pi) * COLUMNS)
    last = math.ceil((middle + half + math.pi) / (2 * math.pi) * COLUMNS)
    return np.arange(first, last + 1) % COLUMNS


def _slab(start: float, direction: Reals, half: float) -> tuple[Reals, Reals]:
    slope = np.where(np.abs(direction) < 1e-6, np.float32(1e-6), direction)
    one, other = (-half - start) / slope, (half - start) / slope
    return np.minimum(one, other), np.maximum(one, other)


def _rain(
    ranges: Floats, seen: NDArray[np.bool_], luck: Floats, rain_mm_h: float, chance: np.random.Generator
) -> tuple[NDArray[np.bool_], Floats]:
    weakening_per_m = 0.0006 * rain_mm_h**0.6
    heard = np.exp(-2.0 * weakening_per_m * np.minimum(ranges, MAX_RANGE_M)) * (1.0 - 0.0008 * rain_mm_h)
    drops = int(RINGS * COLUMNS * min(0.0004 * rain_mm_h, 0.02))
    kept: NDArray[np.bool_] = seen & (luck < heard)
    where = chance.integers(0, RINGS * COLUMNS, drops)
    nearer = chance.gamma(2.0, 1.6, drops).astype(np.float32) + np.float32(0.8)
    flat = ranges.reshape(-1)
    flat[where] = np.minimum(flat[where], nearer)
    kept.reshape(-1)[where] = True
    return kept, ranges


def _points(ranges: Floats, intensity: Floats, seen: NDArray[np.bool_]) -> Floats:
    rows, columns = np.nonzero(seen)
    distance = ranges[rows, columns]
    flat = distance * _COS_E[rows, 0]
    points = np.empty((len(rows), 4), dtype=np.float32)
    points[:, 0], points[:, 1] = flat * _COS_A[columns], flat * _SIN_A[columns]
    points[:, 2] = HEIGHT_M + distance * _SIN_E[rows, 0]
    points[:, 3] = intensity[rows, columns] * np.exp(-distance / 60.0)
    return points

"""What the detector is trained towards: heat around object centres, box sides there, and what does not count."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from training.dataset.shards import CLASSES, counted

Floats = NDArray[np.float32]
STRIDE = 4
CORE = 0.54
"""Share of a box over which its heat spreads and its sides are learned (as in TTFNet, Liu et al. 2020)."""
TRAIN_HEIGHT_PX = 9.0
"""A little below what is scored, so that the score's edge is not the training's edge."""
SIDES_SHARE = {"pedestrian": 2.0}
"""An object's weight in learning sides: alike for small and large; narrow boxes are the hardest to get half right."""


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """For a picture of h x w cells: heat (K, h, w), its mask (K, h, w), sides in px (4, h, w), their weights (h, w)."""

    heat: Floats
    mask: Floats
    sides: Floats
    weight: Floats


def encode(objects: Floats, height_px: int, width_px: int) -> Targets:
    """Targets of the rows (class, x0, y0, x1, y1, visible share) of one picture. Small boxes are drawn over large ones."""
    h, w = height_px // STRIDE, width_px // STRIDE
    targets = Targets(
        np.zeros((len(CLASSES), h, w), np.float32),
        np.ones((len(CLASSES), h, w), np.float32),
        np.zeros((4, h, w), np.float32),
        np.zeros((h, w), np.float32),
    )
    wanted = counted(objects, TRAIN_HEIGHT_PX)
    for row in objects[~wanted]:
        _ignore(targets, row)
    areas = (objects[:, 3] - objects[:, 1]) * (objects[:, 4] - objects[:, 2])
    for index in np.argsort(-areas):
        if wanted[index]:
            _draw(targets, objects[index])
    return targets


def _ignore(targets: Targets, row: Floats) -> None:
    x0, y0, x1, y1 = (row[1:5] / STRIDE).tolist()
    rows = slice(max(int(y0), 0), max(int(np.ceil(y1)), 0))
    columns = slice(max(int(x0), 0), max(int(np.ceil(x1)), 0))
    targets.mask[int(row[0]), rows, columns] = 0.0


def _draw(targets: Targets, row: Floats) -> None:
    kind = int(row[0])
    x0, y0, x1, y1 = row[1:5].tolist()
    h, w = targets.weight.shape
    u, v = int((x0 + x1) / 2 / STRIDE), int((y0 + y1) / 2 / STRIDE)
    if not (0 <= u < w and 0 <= v < h):
        return
    reach_u, reach_v = int((x1 - x0) / 2 * CORE / STRIDE), int((y1 - y0) / 2 * CORE / STRIDE)
    columns = np.arange(max(u - reach_u, 0), min(u + reach_u, w - 1) + 1)
    rows = np.arange(max(v - reach_v, 0), min(v + reach_v, h - 1) + 1)
    sigma_u, sigma_v = (2 * reach_u + 1) / 6, (2 * reach_v + 1) / 6
    bell = (
        np.exp(-((columns - u) ** 2) / (2 * sigma_u**2))[None, :]
        * np.exp(-((rows - v) ** 2) / (2 * sigma_v**2))[:, None]
    )
    window = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
    heat = targets.heat[kind][window]
    np.maximum(heat, bell, out=heat)
    targets.mask[kind][window] = 1.0
    centre_u, centre_v = columns[None, :] * STRIDE + STRIDE / 2, rows[:, None] * STRIDE + STRIDE / 2
    shape = bell.shape
    sides = (centre_u - x0, centre_v - y0, x1 - centre_u, y1 - centre_v)
    for side, values in enumerate(sides):
        targets.sides[side][window] = np.broadcast_to(values, shape)
    targets.weight[window] = bell / bell.sum() * SIDES_SHARE.get(CLASSES[kind], 1.0)

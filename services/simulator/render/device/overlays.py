"""Pictures laid over the whole frame: sensor grain, rain streaks, drops on the lens."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

GRAIN = 256
STREAKS = 512
DROPS = (256, 144)
Bytes = NDArray[np.uint8]


def grain() -> Bytes:
    """Gaussian noise (GRAIN, GRAIN, 3) around 127.5, deviation one quarter of the range."""
    rng = np.random.default_rng(51)
    return (127.5 + 64 * rng.normal(size=(GRAIN, GRAIN, 3))).clip(0, 255).astype(np.uint8)


def streaks() -> Bytes:
    """Falling drops (STREAKS, STREAKS, 2): near ones long and few, far ones fine and many."""
    rng = np.random.default_rng(52)
    out = np.zeros((STREAKS, STREAKS, 2), dtype=np.float32)
    for channel, (count, length, width) in enumerate(((130, (30, 90), 2), (420, (14, 40), 1))):
        layer = np.zeros((STREAKS, STREAKS), dtype=np.float32)
        for _ in range(count):
            x, y = int(rng.integers(0, STREAKS)), int(rng.integers(0, STREAKS))
            size = int(rng.integers(*length))
            for shift in (0, -STREAKS):  # wraps around, so that the picture tiles
                end = (x + size // 16, y + size + shift)
                cv2.line(layer, (x, y + shift), end, float(rng.uniform(0.25, 1.0)), width, cv2.LINE_AA)
        out[:, :, channel] = cv2.blur(layer, (2, 7))
    return (out * 255).clip(0, 255).astype(np.uint8)


def drops(seed: int) -> Bytes:
    """Refraction offsets and brightness (H, W, 3) of drops on the lens; 127 is no offset."""
    rng = np.random.default_rng((53, seed))
    wide, high = DROPS
    out = np.zeros((high, wide, 3), dtype=np.float32)
    rows, columns = np.mgrid[0:high, 0:wide].astype(np.float32)
    for _ in range(int(rng.integers(16, 34))):
        radius = float(rng.uniform(1.5, 6.5))
        x, y = float(rng.uniform(0, wide)), float(rng.uniform(0, high))
        dx, dy = (columns - x) / radius, (rows - y) / (radius * float(rng.uniform(1.0, 1.4)))
        r2 = dx * dx + dy * dy
        inside = r2 < 1
        bend = np.sqrt(np.maximum(1 - r2, 0))
        out[:, :, 0][inside] = (-dx * (1 - bend))[inside]
        out[:, :, 1][inside] = (-dy * (1 - bend))[inside]
        out[:, :, 2][inside] = (0.8 - r2)[inside] * np.sign(dy - 0.2)[inside]
    soft = np.asarray(cv2.GaussianBlur(out, (3, 3), 0), dtype=np.float32)
    soft[:, :, :2] = 127.0 + 127.0 * soft[:, :, :2]
    soft[:, :, 2] = np.maximum(soft[:, :, 2], 0) * 255
    return soft.clip(0, 255).astype(np.uint8)

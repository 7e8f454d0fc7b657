"""What lens and sensor do to a picture: drops, dirt, glare, smear, noise, hard compression. Pixels stay where they are."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]
Rng = np.random.Generator


def through_lens(picture: Picture, rng: Rng, share: float = 0.4) -> Picture:
    """The RGB picture (H, W, 3); with the given chance one or two of the effects upon it."""
    if rng.uniform() >= share:
        return picture
    for effect in rng.choice(len(EFFECTS), size=1 + int(rng.uniform() < 0.3), replace=False):
        picture = EFFECTS[int(effect)](picture, rng)
    return picture


def drops(picture: Picture, rng: Rng) -> Picture:
    """Water on the glass: out of focus in soft discs."""
    return _blend(picture, cv2.GaussianBlur(picture, (0, 0), float(rng.uniform(2.0, 5.0))), _discs(picture, rng, 16))


def dirt(picture: Picture, rng: Rng) -> Picture:
    """Mud on the glass: soft discs of a dull colour."""
    colour = np.full_like(picture, rng.uniform(40, 130) * np.array([1.0, 0.92, 0.8]))
    return _blend(picture, colour, _discs(picture, rng, 9) * float(rng.uniform(0.3, 0.7)))


def glare(picture: Picture, rng: Rng) -> Picture:
    """A low sun or a lamp in the picture: a veil around it."""
    height, width = picture.shape[:2]
    rows, columns = np.mgrid[0:height, 0:width].astype(np.float32)
    x, y, reach = rng.uniform(0, width), rng.uniform(0, 0.6 * height), rng.uniform(0.15, 0.6) * width
    veil = np.exp(-(np.square(columns - x) + np.square(rows - y)) / (2.0 * reach**2)) * float(rng.uniform(0.2, 0.8))
    return _blend(picture, np.full_like(picture, (255, 246, 222)), veil.astype(np.float32))


def smear(picture: Picture, rng: Rng) -> Picture:
    """The car or the hand moved while the shutter was open: 3 to 7 px."""
    length = int(rng.integers(3, 8))
    kernel = np.zeros((length, length), np.float32)
    kernel[length // 2] = 1.0 / length
    return _pixels(cv2.filter2D(picture, -1, kernel if rng.uniform() < 0.7 else kernel.T))


def noise(picture: Picture, rng: Rng) -> Picture:
    """A small sensor in little light."""
    grain = rng.normal(0.0, rng.uniform(3.0, 14.0), size=picture.shape).astype(np.float32)
    return _pixels(np.clip(picture + grain, 0, 255))


def compressed(picture: Picture, rng: Rng) -> Picture:
    """JPEG at a quality of 25 to 60."""
    coded = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(25, 60))])[1]
    decoded = cv2.imdecode(coded, cv2.IMREAD_COLOR)
    return picture if decoded is None else _pixels(decoded)


EFFECTS: tuple[Callable[[Picture, Rng], Picture], ...] = (drops, dirt, glare, smear, noise, compressed)


def _discs(picture: Picture, rng: Rng, most: int) -> NDArray[np.float32]:
    height, width = picture.shape[:2]
    mask = np.zeros((height, width), np.float32)
    for _ in range(int(rng.integers(2, most))):
        centre = (int(rng.uniform(0, width)), int(rng.uniform(0, height)))
        cv2.circle(mask, centre, int(rng.uniform(4, 0.09 * width)), 1.0, -1)
    return cv2.GaussianBlur(mask, (0, 0), 0.012 * width).astype(np.float32)


def _blend(picture: Picture, other: NDArray[np.generic], share: NDArray[np.float32]) -> Picture:
    weight = share[..., None]
    return _pixels(picture * (1.0 - weight) + other.astype(np.float32) * weight)


def _pixels(values: NDArray[np.generic]) -> Picture:
    return values.astype(np.uint8, copy=False)

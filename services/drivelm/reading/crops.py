"""Cutting what a box shows out of a picture, the same way in training and on the road."""

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.uint8]

CROP_PX = 48
MARGIN = 0.10
"""Share of the box's width and height added on each side: boxes are never exact."""


class Region(NamedTuple):
    """A rectangle in a picture, pixels."""

    x0_px: float
    y0_px: float
    x1_px: float
    y1_px: float

    @property
    def width_px(self) -> float:
        """Width; negative for an inside-out region."""
        return self.x1_px - self.x0_px

    @property
    def height_px(self) -> float:
        """Height; negative for an inside-out region."""
        return self.y1_px - self.y0_px


def crop(picture: Picture, region: Region, size_px: int = CROP_PX) -> Picture | None:
    """The region with its margin, stretched to ``size_px`` x ``size_px`` x 3 (RGB in, RGB out).

    Pixels beyond the picture repeat its edge. None when the region is empty, absurd, or has no part in the picture.
    """
    height, width = picture.shape[:2]
    if not all(map(math.isfinite, region)) or not _overlaps(region, width, height):
        return None
    if not all(2.0 <= side <= 4.0 * max(height, width) for side in (region.width_px, region.height_px)):
        return None
    grown = _grown(region)
    scale_x, scale_y = size_px / grown.width_px, size_px / grown.height_px
    # Averaging first keeps large crops from aliasing: the warp below samples single pixels.
    shrink = int(min(1 / scale_x, 1 / scale_y))
    if shrink >= 2:
        inside = _cut(picture, grown)
        small = cv2.resize(inside, None, fx=1 / shrink, fy=1 / shrink, interpolation=cv2.INTER_AREA)
        return np.asarray(cv2.resize(small, (size_px, size_px), interpolation=cv2.INTER_LINEAR), np.uint8)
    warp = np.array(
        [
            [scale_x, 0, -grown.x0_px * scale_x - 0.5 + 0.5 * scale_x],
            [0, scale_y, -grown.y0_px * scale_y - 0.5 + 0.5 * scale_y],
        ]
    )
    warped = cv2.warpAffine(picture, warp, (size_px, size_px), flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(warped, np.uint8)


def _grown(region: Region) -> Region:
    dx, dy = MARGIN * region.width_px, MARGIN * region.height_px
    return Region(region.x0_px - dx, region.y0_px - dy, region.x1_px + dx, region.y1_px + dy)


def _overlaps(region: Region, width: int, height: int) -> bool:
    return region.x1_px > 0 and region.y1_px > 0 and region.x0_px < width and region.y0_px < height


def _cut(picture: Picture, region: Region) -> Picture:
    height, width = picture.shape[:2]
    x0, x1 = (int(np.clip(round(x), 0, width - 1)) for x in (region.x0_px, region.x1_px))
    y0, y1 = (int(np.clip(round(y), 0, height - 1)) for y in (region.y0_px, region.y1_px))
    return picture[y0 : max(y1, y0 + 1), x0 : max(x1, x0 + 1)]

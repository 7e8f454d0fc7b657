"""What a language model is shown of a thing: its box with some margin, in its own proportions, large enough to read."""

import cv2
import numpy as np

from services.drivelm.reading.crops import Picture, Region, crop

VIEW_PX = 224
"""Longer side of the view."""


def view(picture: Picture, region: Region, size_px: int = VIEW_PX) -> Picture | None:
    """The region of a picture (uint8 H x W x 3 RGB), its longer side `size_px` long. None where `crop` gives none."""
    square = crop(picture, region, size_px)
    if square is None:
        return None
    scale = size_px / max(region.width_px, region.height_px)
    width, height = (max(1, round(side * scale)) for side in (region.width_px, region.height_px))
    return np.asarray(cv2.resize(square, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def enlarged(image: Picture, size_px: int = VIEW_PX) -> Picture:
    """A small picture (a crop of the sign reader's) at the size of a view."""
    return np.asarray(cv2.resize(image, (size_px, size_px), interpolation=cv2.INTER_LINEAR), np.uint8)

"""The look of a sign that tells of a country whatever the sign says: a yellow or orange diamond, as warnings are in America.

A European priority road sign is a diamond too: its edge is white, and only the inside is yellow.
"""

import cv2
import numpy as np

from services.drivelm.reading.crops import CROP_PX, MARGIN, Picture

CODE = "diamond:yellow"
LEAST_PX, FRAMES = 14.0, 3
"""The lower side of a box in which the look can be told, and in so many pictures."""
YELLOW = (8, 110, 70), (40, 255, 255)
"""Hue (of 180), saturation and value, from and to: orange to yellowish green."""
LEAST_INSIDE, MOST_OUTSIDE = 0.7, 0.15
"""Share of the ring that is yellow, and of the corners that may be. Of 11,870 crops of German signs (GTSRB) one passes, and no sign of
a priority road does."""
_SIDE = ((np.arange(CROP_PX) + 0.5) / CROP_PX * 2.0 - 1.0) * (1.0 + 2.0 * MARGIN)
_AWAY = np.abs(_SIDE)[None, :] + np.abs(_SIDE)[:, None]
_RING = (_AWAY >= 0.55) & (_AWAY <= 0.88)
_CORNERS = (_AWAY >= 1.3) & (np.maximum(np.abs(_SIDE)[None, :], np.abs(_SIDE)[:, None]) < 1.0)


def is_yellow_diamond(image: Picture) -> bool:
    """Whether a crop (RGB, as `crops.crop` cuts it) shows a diamond that is yellow up to its edge; what is of another size shows none."""
    if image.shape[:2] != _RING.shape:
        return False
    yellow = cv2.inRange(cv2.cvtColor(image, cv2.COLOR_RGB2HSV), *map(np.array, YELLOW)) > 0
    return bool(yellow[_RING].mean() >= LEAST_INSIDE and yellow[_CORNERS].mean() <= MOST_OUTSIDE)

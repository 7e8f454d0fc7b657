"""Pictures of a camera that works: something is to be seen in each, and no two are the same to the byte."""

import itertools

import cv2
import numpy as np

from proto.sensors import CameraFrame
from services.player.street import numbered

_NUMBERS = itertools.count()
_GREY = np.full((360, 640, 3), 90, np.uint8)
_GREY[180:] = 60
_JPEG = cv2.imencode(".jpg", _GREY)[1].tobytes()


def taken() -> CameraFrame:
    """One more picture, of a sky and a road."""
    return CameraFrame(jpeg=numbered(_JPEG, next(_NUMBERS)), width_px=640, height_px=360)


def plain(level: int) -> CameraFrame:
    """A picture of one brightness (0: black)."""
    picture = np.full((360, 640, 3), level, np.uint8)
    return CameraFrame(
        jpeg=numbered(cv2.imencode(".jpg", picture)[1].tobytes(), next(_NUMBERS)), width_px=640, height_px=360
    )

"""Logged pictures, out of what wraps them."""

import cv2
import numpy as np

from domain.pictures import may_be_unpacked
from drivemcp.pictures import Image


def jpeg_of(data: bytes) -> bytes:
    """The JPEG inside a logged picture, in whatever envelope: from start to end marker; empty bytes without a JPEG."""
    start, end = data.find(b"\xff\xd8\xff"), data.rfind(b"\xff\xd9")
    return data[start : end + 2] if 0 <= start < end else b""


def unpacked(jpeg: bytes) -> Image | None:
    """The pixels (height, width, 3; blue first) of a JPEG; None for other bytes and for a picture that is too large."""
    bgr = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR) if may_be_unpacked(jpeg) else None
    return None if bgr is None else np.asarray(bgr, np.uint8)

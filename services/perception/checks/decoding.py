"""Opens what sensors send: JPEG pictures and LiDAR sweeps, each refused with a reason where it is malformed."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from domain.pictures import size_px
from proto.sensors import CameraFrame, LidarSweep
from services.perception.detect.detector import Picture
from services.perception.range.camera import Floats

LARGEST_JPEG = 16_000_000
SMALLEST_SIDE_PX, LARGEST_SIDE_PX = 16, 8192
MOST_OBLONG = 16
"""No camera's picture is so many times wider than high, or higher than wide; brought to a given width it could fill all memory."""
FURTHEST_RETURN_M = 500.0
_ROW = 16


class Malformed(ValueError):
    """A picture or sweep that cannot be read."""


def open_picture(frame: CameraFrame) -> Picture:
    """The picture as RGB (H, W, 3). Raises Malformed."""
    if not 0 < len(frame.jpeg) <= LARGEST_JPEG:
        raise Malformed(f"a picture of {len(frame.jpeg)} bytes")
    short, long = sorted((frame.width_px, frame.height_px))
    if short < SMALLEST_SIDE_PX or long > LARGEST_SIDE_PX or long > MOST_OBLONG * short:
        raise Malformed(f"a picture said to be {frame.width_px} x {frame.height_px}")
    if (said := size_px(frame.jpeg)) != (frame.width_px, frame.height_px):  # before anything is unpacked
        raise Malformed(f"the picture is {_by(said)}, not {frame.width_px} x {frame.height_px}")
    try:
        bgr = cv2.imdecode(np.frombuffer(frame.jpeg, dtype=np.uint8), cv2.IMREAD_COLOR)
    except cv2.error as error:
        raise Malformed(f"the picture cannot be decoded: {error.err}") from None
    if bgr is None:
        raise Malformed("the picture cannot be decoded")
    if bgr.shape[:2] != (frame.height_px, frame.width_px):
        raise Malformed(f"the picture is {bgr.shape[1]} x {bgr.shape[0]}, not {frame.width_px} x {frame.height_px}")
    return cv2.cvtColor(bgr, cv2.COLOR_BGR2RGB).astype(np.uint8, copy=False)


def _by(size: tuple[int, int] | None) -> str:
    return f"{size[0]} x {size[1]}" if size else "none that can be decoded"


def open_sweep(sweep: LidarSweep) -> Floats:
    """The returns (N, 3) in the ego frame, those that are no numbers or absurdly far left out. Raises Malformed."""
    if sweep.count < 0 or len(sweep.points) != sweep.count * _ROW:
        raise Malformed(f"a sweep of {len(sweep.points)} bytes for {sweep.count} returns")
    rows: NDArray[np.float32] = np.frombuffer(sweep.points, dtype="<f4").reshape(-1, 4)[:, :3]
    good = np.isfinite(rows).all(axis=1) & (np.abs(rows) < FURTHEST_RETURN_M).all(axis=1)
    points: Floats = rows[good].astype(np.float64)
    return points

"""Recordings as pictures with their times. Pure but for reading the files."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from drivemcp.errors import UserError

PICTURES = (".jpg", ".jpeg", ".png", ".bmp", ".webp")
MAX_WIDTH_PX = 960


class Picture(NamedTuple):
    """One picture of a recording: RGB-ordered as OpenCV gives it (BGR uint8 [h, w, 3]), and its time from the start."""

    bgr: np.ndarray[Any, np.dtype[np.uint8]]
    at_s: float


class Recording(NamedTuple):
    """A recording that can be opened: how many pictures, how long, and the pictures one after the other."""

    path: Path
    total: int
    duration_s: float
    pictures: Iterator[Picture]


def open_recording(source: str, *, picture_period_s: float, max_rate_hz: float) -> Recording:
    """Open a video or a folder of pictures (in the order of their names). Raises UserError on what is neither."""
    path = Path(source)
    if path.is_dir():
        return _folder(path, picture_period_s)
    if not path.is_file():
        raise UserError(f"no such recording: {source}")
    return _video(path, max_rate_hz)


def _folder(path: Path, period_s: float) -> Recording:
    files = sorted(file for file in path.iterdir() if file.suffix.lower() in PICTURES)
    if not files:
        raise UserError(f"{path} holds no pictures ({', '.join(PICTURES)})")

    def pictures() -> Iterator[Picture]:
        for number, file in enumerate(files):
            bgr = cv2.imread(str(file), cv2.IMREAD_COLOR)
            if bgr is None:
                raise UserError(f"{file} does not decode as a picture")
            yield Picture(shrink(bgr), number * period_s)

    return Recording(path, len(files), len(files) * period_s, pictures())


def _video(path: Path, max_rate_hz: float) -> Recording:
    capture = cv2.VideoCapture(str(path))
    if not capture.isOpened():
        raise UserError(f"{path} does not open as a video")
    rate_hz = capture.get(cv2.CAP_PROP_FPS) or 25.0
    frames = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
    stride = max(1, round(rate_hz / max_rate_hz))

    def pictures() -> Iterator[Picture]:
        number = 0
        while capture.grab():
            if number % stride == 0:
                read, bgr = capture.retrieve()
                if read:
                    yield Picture(shrink(bgr), number / rate_hz)
            number += 1
        capture.release()

    return Recording(path, frames // stride, frames / rate_hz, pictures())


def shrink(bgr: np.ndarray[Any, Any]) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """At most 960 px wide, uint8."""
    height, width = bgr.shape[:2]
    if width > MAX_WIDTH_PX:
        size = (MAX_WIDTH_PX, round(height * MAX_WIDTH_PX / width))
        bgr = cv2.resize(bgr, size, interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(bgr, dtype=np.uint8)

"""Videos and folders of pictures."""

from collections.abc import Iterator
from pathlib import Path

import cv2

from drivemcp.errors import UserError
from services.player.recording import Options, Picture, Recording, camera_messages, read_picture, shrink

PICTURES = (".jpg", ".jpeg", ".png", ".bmp", ".webp")


def open_folder(path: Path, options: Options) -> Recording:
    """Pictures in the order of their names. Raises UserError where there are none."""
    files = sorted(file for file in path.iterdir() if file.suffix.lower() in PICTURES)
    if not files:
        raise UserError(f"{path} holds no pictures ({', '.join(PICTURES)}), no frame.json and no log")
    period_s = options.picture_period_s
    pictures = (Picture(shrink(read_picture(file)), number * period_s) for number, file in enumerate(files))
    return Recording(path.name, len(files), len(files) * period_s, camera_messages(pictures, options))


def open_video(path: Path, options: Options) -> Recording:
    """A video at its own pace, thinned to the highest rate. Raises UserError where it does not open."""
    capture = cv2.VideoCapture(str(path))
    if not capture.isOpened():
        raise UserError(f"{path} does not open as a video")
    rate_hz = capture.get(cv2.CAP_PROP_FPS) or 25.0
    frames = max(0, int(capture.get(cv2.CAP_PROP_FRAME_COUNT)))
    stride = max(1, round(rate_hz / options.max_rate_hz))
    pictures = _every(capture, stride, rate_hz)
    return Recording(path.name, frames // stride, frames / rate_hz, camera_messages(pictures, options))


def _every(capture: cv2.VideoCapture, stride: int, rate_hz: float) -> Iterator[Picture]:
    number = 0
    while capture.grab():
        if number % stride == 0:
            read, bgr = capture.retrieve()
            if read:
                yield Picture(shrink(bgr), number / rate_hz)
        number += 1
    capture.release()

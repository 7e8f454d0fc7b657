"""Videos, folders of pictures, and cameras of this machine."""

import re
import sys
import time
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


_NAMES = re.compile(r"^(?:webcam:|/dev/video)(\d{1,3})$")


def webcam_number(source: str) -> int | None:
    """The number in `webcam:0` or `/dev/video0`; None for what is no webcam."""
    match = _NAMES.match(source)
    return int(match[1]) if match else None


def open_webcam(number: int, options: Options) -> Recording:
    """Pictures as they come. Raises UserError where there is no such camera."""
    capture = _capture(number)
    pictures = live_pictures(capture, options.max_rate_hz)
    return Recording(f"webcam:{number}", 0, 0.0, camera_messages(pictures, options))


def check_webcam(number: int) -> None:
    """That it opens now. Raises UserError."""
    _capture(number).release()


def live_pictures(capture: cv2.VideoCapture, max_rate_hz: float) -> Iterator[Picture]:
    """At most so many a second, stamped by the monotonic clock as they are taken. Raises UserError when no more come."""
    start_s, last_s = time.monotonic(), -1.0
    try:
        while capture.grab():
            at_s = time.monotonic() - start_s
            if at_s - last_s < 0.9 / max_rate_hz:
                continue
            read, bgr = capture.retrieve()
            if read:
                last_s = at_s
                yield Picture(shrink(bgr), at_s)
    finally:
        capture.release()
    raise UserError("the webcam gives no more pictures: was it unplugged, or is it in use elsewhere?")


def _capture(number: int) -> cv2.VideoCapture:
    device = Path(f"/dev/video{number}")
    if sys.platform == "linux" and not device.exists():
        there = ", ".join(sorted(str(path) for path in Path("/dev").glob("video[0-9]*"))) or "none"
        raise UserError(f"no webcam {number}: there is no {device} (cameras here: {there})")
    capture = cv2.VideoCapture(number)
    if not capture.isOpened():
        raise UserError(f"the webcam {number} does not open: is it in use, or not permitted to you?")
    return capture

"""A recording as messages: what is to be published, and when."""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import msgspec
import numpy as np

from domain.cameras import assumed_calibration
from drivemcp.errors import UserError
from proto import topics
from proto.sensors import CameraFrame
from proto.topics import Topic

Image = np.ndarray[Any, np.dtype[np.uint8]]
FRONT = "front"
MAX_WIDTH_PX = 960
JPEG_QUALITY = 90
DEEP_BITS = (10, 12, 14, 16)
"""Of cameras whose pictures are kept in 16 bits; the least that holds the brightest point of their pictures is taken."""
SAMPLES = 8
CALIBRATION_PERIOD = 10
"""A calibration goes with every tenth picture."""


class TimedMessage(NamedTuple):
    """One message, and its time in seconds from the recording's start."""

    at_s: float
    topic: Topic[Any]
    message: msgspec.Struct
    id: str | None = None


class Picture(NamedTuple):
    """One picture as OpenCV gives it (BGR uint8 [h, w, 3]), and its time from the start."""

    bgr: Image
    at_s: float


class Recording(NamedTuple):
    """A recording that can be played. `pictures`: how many, 0 where it has no end; `ego`: it says how the ego moves."""

    name: str
    pictures: int
    duration_s: float
    messages: Iterator[TimedMessage]
    ego: bool = False
    brings: str = "pictures"


class Options(NamedTuple):
    """How pictures without times and cameras without calibration are taken."""

    picture_period_s: float = 0.0
    """Between the pictures of a folder; 0: by the times in their names, else half a second."""
    max_rate_hz: float = 10.0
    hold_s: float = 3.0
    """How long a single frame is shown."""
    fov_deg: float = 0.0
    """0: not given."""
    camera_height_m: float = 1.4


def camera_messages(pictures: Iterable[Picture], options: Options) -> Iterator[TimedMessage]:
    """Pictures of an uncalibrated camera, each as a message, with the calibration assumed of it."""
    for number, picture in enumerate(pictures):
        height, width = picture.bgr.shape[:2]
        if number % CALIBRATION_PERIOD == 0:
            assumed = assumed_calibration(width, height, options.fov_deg, options.camera_height_m)
            yield TimedMessage(picture.at_s, topics.CALIBRATION, assumed, FRONT)
        yield TimedMessage(picture.at_s, topics.CAMERA, frame_of(picture.bgr, number), FRONT)


def frame_of(bgr: Image, number: int) -> CameraFrame:
    """A picture as a message. Raises UserError where it cannot be encoded."""
    height, width = bgr.shape[:2]
    encoded, jpeg = cv2.imencode(".jpg", bgr, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    if not encoded:
        raise UserError(f"picture {number} cannot be encoded")
    return CameraFrame(jpeg=jpeg.tobytes(), width_px=width, height_px=height, frame=number)


def read_picture(path: Path, bits: int = 0) -> Image:
    """A picture file as BGR. `bits`: how many a deep picture uses, where others of its camera show it. Raises UserError."""
    return _of_eight_bits(_read(path), path, bits)


def bits_in(paths: Sequence[Path]) -> int:
    """How many bits deep pictures of one camera use, by some of them; 0: they are of eight bits, or cannot be read."""
    used = 0
    for place in sorted({len(paths) * part // SAMPLES for part in range(SAMPLES)}):
        try:
            picture = _read(paths[place])
        except UserError:
            continue
        if picture.dtype != np.uint16:
            return 0
        used = max(used, _bits(picture))
    return used


def _read(path: Path) -> np.ndarray[Any, Any]:
    bgr = cv2.imread(str(path), cv2.IMREAD_COLOR | cv2.IMREAD_ANYDEPTH)
    if bgr is None:
        raise UserError(f"{path} does not decode as a picture")
    return bgr


def _of_eight_bits(bgr: np.ndarray[Any, Any], path: Path, bits: int) -> Image:
    if bgr.dtype == np.uint8:
        return np.asarray(bgr, np.uint8)
    if bgr.dtype != np.uint16:
        raise UserError(f"{path} holds {bgr.dtype} numbers and no picture of 8 to 16 bits: convert it to .png")
    return (np.asarray(bgr, np.uint16) >> (max(bits, _bits(bgr)) - 8)).astype(np.uint8)


def _bits(bgr: np.ndarray[Any, Any]) -> int:
    return next(bits for bits in DEEP_BITS if int(bgr.max()) < 1 << bits)


def shrink(bgr: np.ndarray[Any, Any]) -> Image:
    """At most 960 px wide, uint8."""
    height, width = bgr.shape[:2]
    if width > MAX_WIDTH_PX:
        size = (MAX_WIDTH_PX, round(height * MAX_WIDTH_PX / width))
        bgr = cv2.resize(bgr, size, interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(bgr, dtype=np.uint8)

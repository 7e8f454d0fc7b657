"""Logged pictures with what was seen in them."""

from typing import Any

import cv2
import numpy as np

from domain.pictures import may_be_unpacked
from proto.perception import Boxes

Image = np.ndarray[Any, np.dtype[np.uint8]]
FONT = cv2.FONT_HERSHEY_SIMPLEX
_COLOURS = {
    "vehicle": (80, 200, 255), "pedestrian": (80, 120, 255), "sign": (255, 160, 80), "panel": (255, 200, 120),
    "light": (120, 255, 120),
}  # fmt: skip
_LABEL_SCALE, _LABEL_PX = 0.38, 11


def jpeg_of(data: bytes) -> bytes:
    """The JPEG inside a logged picture, whatever wraps it: from its start to its end marker; empty where there is none."""
    start, end = data.find(b"\xff\xd8\xff"), data.rfind(b"\xff\xd9")
    return data[start : end + 2] if 0 <= start < end else b""


def unpacked(jpeg: bytes) -> Image | None:
    """The pixels (height, width, 3; blue first) of a JPEG; None where it is none, or too large."""
    bgr = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR) if may_be_unpacked(jpeg) else None
    return None if bgr is None else np.asarray(bgr, np.uint8)


def packed(picture: Image, *, widest_px: int, quality: int) -> bytes:
    """The picture as a JPEG of at most that width; quality 1 to 100."""
    height, width = picture.shape[:2]
    if width > widest_px:
        size = (widest_px, round(height * widest_px / width))
        picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
    done, jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return jpeg.tobytes() if done else b""


def draw_boxes(picture: Image, boxes: Boxes | None) -> None:
    """Draws each box with class, track and range. A label that would cover another is left out, the nearest box's stays."""
    taken: list[tuple[int, int, int, int]] = []
    for box in sorted(boxes.boxes if boxes else (), key=lambda each: each.y0_px - each.y1_px):
        colour = _COLOURS.get(box.kind, (255, 255, 255))
        corner = (int(box.x0_px), int(box.y0_px))
        cv2.rectangle(picture, corner, (int(box.x1_px), int(box.y1_px)), colour, 1, cv2.LINE_AA)
        label = f"{box.kind} {box.track_id or ''}" + (f" {box.range_m:.0f} m" if box.range_m is not None else "")
        place = (corner[0], max(10, corner[1] - 3))
        wide = cv2.getTextSize(label, FONT, _LABEL_SCALE, 1)[0][0]
        area = (place[0], place[1] - _LABEL_PX, place[0] + wide, place[1])
        if any(_overlap(area, other) for other in taken):
            continue
        taken.append(area)
        cv2.putText(picture, label, place, FONT, _LABEL_SCALE, colour, 1, cv2.LINE_AA)


def _overlap(one: tuple[int, int, int, int], other: tuple[int, int, int, int]) -> bool:
    return one[0] < other[2] and other[0] < one[2] and one[1] < other[3] and other[1] < one[3]

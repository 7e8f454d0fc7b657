"""Pictures with what was seen in them. Needs OpenCV, which the base installation has not."""

from typing import Any

import cv2
import numpy as np

from proto.perception import Boxes

Image = np.ndarray[Any, np.dtype[np.uint8]]
FONT = cv2.FONT_HERSHEY_SIMPLEX
_COLOURS = {
    "vehicle": (80, 200, 255), "pedestrian": (80, 120, 255), "sign": (255, 160, 80), "panel": (255, 200, 120),
    "light": (120, 255, 120),
}  # fmt: skip
_LABEL_SCALE, _LABEL_PX = 0.38, 11


def packed(picture: Image, *, widest_px: int, quality: int) -> bytes:
    """The picture as a JPEG of at most that width; quality 1 to 100."""
    height, width = picture.shape[:2]
    if width > widest_px:
        size = (widest_px, round(height * widest_px / width))
        picture = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
    done, jpeg = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return jpeg.tobytes() if done else b""


def packed_within(picture: Image, most_bytes: int) -> bytes:
    """The picture as a JPEG of at most so many bytes, as large and good as fits; empty where not even a small one does."""
    for longest_px, quality in ((960, 80), (960, 60), (640, 60), (640, 40), (320, 40), (160, 20), (64, 10)):
        share = min(1.0, longest_px / max(picture.shape[:2]))
        size = max(1, round(picture.shape[1] * share)), max(1, round(picture.shape[0] * share))
        smaller = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
        jpeg = packed(smaller, widest_px=longest_px, quality=quality)
        if 0 < len(jpeg) <= most_bytes:
            return jpeg
    return b""


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

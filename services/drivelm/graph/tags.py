"""DriveLM's names of objects in text: `<c1,CAM_FRONT,x,y>`, a number, a camera and the middle of the box in pixels."""

import re
from typing import NamedTuple

NEAR_PX = 16.0
"""Two tags mean one object where their axes differ by less than this together (DriveLM's challenge evaluation)."""
_NUMBER = r"\s*(-?[0-9]{1,6}(?:\.[0-9]{1,9})?)\s*"
TAG = re.compile(rf"<\s*c[0-9]{{1,6}}\s*,\s*([A-Za-z_]{{1,40}})\s*,{_NUMBER},{_NUMBER}>")
ANY_TAG = r"<\s*c[0-9]{1,6}\s*,[^<>]{1,80}>"


class Point(NamedTuple):
    """Where a tag points."""

    camera: str
    x_px: float
    y_px: float


def points(text: str) -> list[Point]:
    """The tags of a text, in the order said."""
    return [Point(camera.upper(), float(x), float(y)) for camera, x, y in TAG.findall(text)]


def apart_px(one: Point, other: Point) -> float:
    """Distance along both axes together; infinite between cameras."""
    if one.camera != other.camera:
        return float("inf")
    return abs(one.x_px - other.x_px) + abs(one.y_px - other.y_px)

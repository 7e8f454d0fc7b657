"""Coordinate match: the objects an answer points at (`<c1,CAM_FRONT,x,y>`) against those of the reference, as F1.

As in DriveLM's public evaluation: each point of the answer, in the order said, takes the nearest reference point that
is left; it is a hit where |dx| + |dy| is under 16 px. Stricter in one thing: the camera must be the same.
"""

import re
from collections.abc import Sequence
from typing import NamedTuple

NEAR_PX = 16.0
"""Sum of the two axes' distances, in pixels of the picture the reference was made on (DriveLM, challenge evaluation)."""
_NUMBER = r"\s*(-?\d{1,6}(?:\.\d{1,9})?)\s*"
_TAG = re.compile(rf"<\s*c\d{{1,6}}\s*,\s*([A-Za-z_]{{1,40}})\s*,{_NUMBER},{_NUMBER}>")
_LIKE_A_TAG = re.compile(r"<\s*c\s*\d")


class Point(NamedTuple):
    """Where an answer points."""

    camera: str
    x_px: float
    y_px: float


def points(text: str) -> list[Point]:
    """The tags of an answer, in the order said."""
    return [Point(camera.upper(), float(x), float(y)) for camera, x, y in _TAG.findall(text)]


def has_broken_tag(text: str) -> bool:
    """Whether something begins like a tag and is none."""
    return len(_LIKE_A_TAG.findall(text)) > len(points(text))


def f1(said: Sequence[Point], wanted: Sequence[Point]) -> float:
    """Two times the hits over all points of both sides; 0 where there is no hit."""
    left, hits = list(wanted), 0
    for point in said:
        nearest = min(
            (one for one in left if one.camera == point.camera), key=lambda one: _apart(point, one), default=None
        )
        if nearest is not None and _apart(point, nearest) < NEAR_PX:
            left.remove(nearest)
            hits += 1
    return 2 * hits / (len(said) + len(wanted)) if hits else 0.0


def _apart(one: Point, other: Point) -> float:
    return abs(one.x_px - other.x_px) + abs(one.y_px - other.y_px)

"""Coordinate match: the objects an answer points at (`<c1,CAM_FRONT,x,y>`) against those of the reference, as F1.

As in DriveLM's public evaluation: each point of the answer, in the order said, takes the nearest reference point that
is left; it is a hit where |dx| + |dy| is under 16 px. Stricter in one thing: the camera must be the same.
"""

import re
from collections.abc import Sequence

from services.drivelm.graph.tags import NEAR_PX, Point, apart_px, points

_LIKE_A_TAG = re.compile(r"<\s*c\s*\d")


def has_broken_tag(text: str) -> bool:
    """Whether something begins like a tag and is not a tag."""
    return len(_LIKE_A_TAG.findall(text)) > len(points(text))


def f1(said: Sequence[Point], wanted: Sequence[Point]) -> float:
    """Two times the hits over all points of both sides; 0 where there is no hit."""
    left, hits = list(wanted), 0
    for point in said:
        nearest = min(left, key=lambda one: apart_px(point, one), default=None)
        if nearest is not None and apart_px(point, nearest) < NEAR_PX:
            left.remove(nearest)
            hits += 1
    return 2 * hits / (len(said) + len(wanted)) if hits else 0.0

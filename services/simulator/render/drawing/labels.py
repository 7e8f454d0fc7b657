"""What is in the picture and where: exact visible boxes, full extents, distances; for training and for truth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proto.perception import ObjectClass

Box = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Label:
    """One object of which at least one pixel is visible.

    ``box_px`` (left, top, right, bottom; pixel edges) encloses the visible pixels; ``full_box_px`` the whole object as
    if nothing stood before it, not cut at the picture's rim. ``visible_fraction``: visible pixels by those of the
    object alone, times the share of the full box inside the picture. ``distance_m``: camera to the object's middle.
    ``disc_px``: true height in pixels of a sign's or panel's face, unoccluded (0 for others). ``part``: a face's index
    on its post, from the top. ``code``: sign code, panel code or light state; ``detail``: the actor's kind.
    """

    id: int
    kind: ObjectClass
    box_px: Box
    full_box_px: Box
    visible_fraction: float
    distance_m: float
    visible_px: int
    disc_px: float = 0.0
    mesh_family: int = 0
    code: str = ""
    country: str = ""
    detail: str = ""
    part: int = 0


def visible_boxes(ids: NDArray[np.uint32]) -> dict[int, tuple[Box, int]]:
    """Box and pixel count of each non-zero id in an (H, W) picture of ids."""
    rows, columns = np.nonzero(ids)
    values = ids[rows, columns]
    order = np.argsort(values, kind="stable")
    rows, columns, values = rows[order], columns[order], values[order]
    names, starts, counts = np.unique(values, return_index=True, return_counts=True)
    if not len(names):
        return {}
    left, right = np.minimum.reduceat(columns, starts), np.maximum.reduceat(columns, starts) + 1
    top, bottom = np.minimum.reduceat(rows, starts), np.maximum.reduceat(rows, starts) + 1
    return {
        int(name): ((float(left[k]), float(top[k]), float(right[k]), float(bottom[k])), int(counts[k]))
        for k, name in enumerate(names)
    }


def inside_share(box: Box, width: int, height: int) -> float:
    """Which share of a box's area lies inside the picture."""
    area = (box[2] - box[0]) * (box[3] - box[1])
    wide = min(box[2], width) - max(box[0], 0.0)
    high = min(box[3], height) - max(box[1], 0.0)
    return max(wide, 0.0) * max(high, 0.0) / area if area > 0 else 0.0

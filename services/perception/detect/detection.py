"""A detection in a picture, overlaps between detections, and non-maximum suppression within each class."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proto.perception import ObjectClass

FloatArray = NDArray[np.float32]


@dataclass(frozen=True, slots=True, kw_only=True)
class Detection:
    """A box in pixels of the picture it was found in, its class, and a score in 0..1."""

    x0_px: float
    y0_px: float
    x1_px: float
    y1_px: float
    kind: ObjectClass
    score: float

    @property
    def width_px(self) -> float:
        """Width of the box."""
        return self.x1_px - self.x0_px

    @property
    def height_px(self) -> float:
        """Height of the box."""
        return self.y1_px - self.y0_px

    @property
    def box_px(self) -> tuple[float, float, float, float]:
        """Its edges: left, top, right, bottom."""
        return self.x0_px, self.y0_px, self.x1_px, self.y1_px

    @property
    def centre_px(self) -> tuple[float, float]:
        """Middle of the box."""
        return (self.x0_px + self.x1_px) / 2, (self.y0_px + self.y1_px) / 2


def overlaps(ours: FloatArray, theirs: FloatArray) -> FloatArray:
    """Intersection over union (N, M) of boxes (N, 4) and (M, 4), each x0, y0, x1, y1."""
    low = np.maximum(ours[:, None, :2], theirs[None, :, :2])
    high = np.minimum(ours[:, None, 2:], theirs[None, :, 2:])
    both = np.clip(high - low, 0.0, None).prod(axis=2)
    area = (ours[:, 2:] - ours[:, :2]).prod(axis=1)[:, None] + (theirs[:, 2:] - theirs[:, :2]).prod(axis=1)[None, :]
    union: FloatArray = (both / np.maximum(area - both, 1e-6)).astype(np.float32)
    return union


def suppress(boxes: FloatArray, scores: FloatArray, classes: NDArray[np.int64], limit: float) -> list[int]:
    """Indices of the boxes kept, best first: of two of one class that overlap more than `limit` the better one stays."""
    order = np.argsort(-scores, kind="stable")
    overlap = overlaps(boxes, boxes)
    kept: list[int] = []
    for index in order.tolist():
        rivals = [other for other in kept if classes[other] == classes[index]]
        if not rivals or overlap[index, rivals].max() <= limit:
            kept.append(index)
    return kept


def detections(
    boxes: FloatArray,
    scores: FloatArray,
    kinds: Sequence[ObjectClass],
    size_px: tuple[int, int],
) -> list[Detection]:
    """Boxes (N, 4) cut at the picture's edges (width, height) as detections; those that vanish there are left out."""
    width, height = size_px
    limits = np.array([width, height, width, height], dtype=np.float32)
    found = []
    for box, score, kind in zip(np.clip(boxes, 0.0, limits).tolist(), scores.tolist(), kinds, strict=True):
        x0, y0, x1, y1 = box
        if x1 - x0 >= 1.0 and y1 - y0 >= 1.0:
            found.append(Detection(x0_px=x0, y0_px=y0, x1_px=x1, y1_px=y1, kind=kind, score=score))
    return found

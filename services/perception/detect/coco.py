"""COCO-style detectors given as a file: in photographs they find more people than our own detector, and fewer signs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from proto.perception import ObjectClass
from services.perception.detect.detection import Detection, FloatArray, detections, suppress
from services.perception.detect.detector import DetectorOptions, Picture

COCO: dict[int, ObjectClass] = {
    0: "pedestrian",
    1: "vehicle",  # bicycle: the bus knows no cyclist box; a rider counts with what is ridden
    2: "vehicle",
    3: "vehicle",
    5: "vehicle",
    7: "vehicle",
    9: "light",
    11: "sign",
}
"""COCO's index of each class we use."""
COCO_NAMES: dict[int, frozenset[str]] = {
    0: frozenset({"person"}),
    1: frozenset({"bicycle"}),
    2: frozenset({"car"}),
    3: frozenset({"motorcycle", "motorbike"}),
    5: frozenset({"bus"}),
    7: frozenset({"truck"}),
    9: frozenset({"traffic light"}),
    11: frozenset({"stop sign"}),
}
"""What files that name their classes call these."""
COCO_CLASSES = 80
STRIDES_PX = (8, 16, 32)
_PAD = 114
_KINDS = sorted(set(COCO.values()))


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """How a kind of model wants its picture and says its boxes.

    `rows` turns the first output into (N, 4 + k) rows; `boxes` rows into corners (N, 4) in the model's picture, given its
    side; `scores` rows into class scores (N, 80).
    """

    name: str
    rgb: bool
    full_scale: float
    """What 255 becomes."""
    rows: Callable[[FloatArray], FloatArray]
    boxes: Callable[[FloatArray, int], FloatArray]
    scores: Callable[[FloatArray], FloatArray]


class CocoDetector:
    """Input (1, 3, S, S) float32, letterboxed with grey; output as the layout says."""

    def __init__(self, session: Any, options: DetectorOptions, *, name: str, layout: Layout, side_px: int) -> None:
        self.name = name
        self._session = session
        self._input = session.get_inputs()[0].name
        self._options = options
        self.layout = layout
        self._side = side_px
        self._columns = np.array(sorted(COCO))
        self._floors = np.array([options.floor(COCO[index]) for index in sorted(COCO)], dtype=np.float32)

    def detect(self, rgb: Picture, *, closer: bool = False) -> list[Detection]:
        """See `Detector`. It never looks closer: its pictures have one size, and a second would cost as much as the first."""
        canvas, scale = self._fit(rgb)
        rows = self.layout.rows(self._session.run(None, {self._input: canvas})[0])
        scores = self.layout.scores(rows)[:, self._columns]
        best = scores.argmax(axis=1)
        top = scores[np.arange(len(best)), best]
        boxes = self.layout.boxes(rows, self._side) / scale
        keep = np.flatnonzero((top >= self._floors[best]) & np.isfinite(boxes).all(axis=1))
        kinds = [COCO[int(self._columns[index])] for index in best[keep]]
        codes = np.array([_KINDS.index(kind) for kind in kinds], dtype=np.int64)
        chosen = suppress(boxes[keep], top[keep], codes, self._options.overlap_limit)
        size = (rgb.shape[1], rgb.shape[0])
        return detections(boxes[keep][chosen], top[keep][chosen], [kinds[index] for index in chosen], size)

    def _fit(self, rgb: Picture) -> tuple[FloatArray, float]:
        scale = min(self._side / rgb.shape[0], self._side / rgb.shape[1])
        size = (max(1, round(rgb.shape[1] * scale)), max(1, round(rgb.shape[0] * scale)))
        canvas = np.full((self._side, self._side, 3), _PAD, dtype=np.uint8)
        canvas[: size[1], : size[0]] = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA)
        ordered = canvas if self.layout.rgb else canvas[:, :, ::-1]
        planes = np.ascontiguousarray(ordered.transpose(2, 0, 1)[None], dtype=np.float32)
        return planes * np.float32(self.layout.full_scale / 255.0), scale


def cells(side_px: int) -> int:
    """How many places a picture of this side has at strides 8, 16 and 32."""
    return sum((side_px // stride) ** 2 for stride in STRIDES_PX)


def _first(output: FloatArray) -> FloatArray:
    first: FloatArray = output[0]
    return first


def _first_turned(output: FloatArray) -> FloatArray:
    return np.ascontiguousarray(output[0].T)


def _corners(rows: FloatArray, side_px: int) -> FloatArray:
    half = rows[:, 2:4] / 2
    return np.concatenate([rows[:, :2] - half, rows[:, :2] + half], axis=1)


def _corners_by_cell(rows: FloatArray, side_px: int) -> FloatArray:
    """Offsets in cells and logarithms of sizes, both in strides."""
    places, strides = _grid(side_px)
    centre = (rows[:, :2] + places) * strides[:, None]
    half = np.exp(np.minimum(rows[:, 2:4], 20.0)) * strides[:, None] / 2
    return np.concatenate([centre - half, centre + half], axis=1).astype(np.float32)


def _by_objectness(rows: FloatArray) -> FloatArray:
    return rows[:, 4:5] * rows[:, 5:]


def _plain(rows: FloatArray) -> FloatArray:
    return rows[:, 4:]


YOLOX = Layout(name="YOLOX", rgb=False, full_scale=255.0, rows=_first, boxes=_corners_by_cell, scores=_by_objectness)
YOLOX_DECODED = Layout(
    name="YOLOX, decoded", rgb=False, full_scale=255.0, rows=_first, boxes=_corners, scores=_by_objectness
)
YOLO_V6 = Layout(name="YOLOv6", rgb=True, full_scale=1.0, rows=_first, boxes=_corners, scores=_by_objectness)
YOLO_V5 = Layout(name="YOLOv5", rgb=True, full_scale=1.0, rows=_first, boxes=_corners, scores=_by_objectness)
YOLO_V8 = Layout(name="YOLOv8", rgb=True, full_scale=1.0, rows=_first_turned, boxes=_corners, scores=_plain)

LAYOUTS = {"yolox": YOLOX, "yolox-decoded": YOLOX_DECODED, "yolov5": YOLO_V5, "yolov6": YOLO_V6, "yolov8": YOLO_V8}
"""By the names of the setting `perception.detector_layout`."""


def _grid(side_px: int) -> tuple[FloatArray, FloatArray]:
    places, strides = [], []
    for stride in STRIDES_PX:
        count = side_px // stride
        v, u = np.mgrid[:count, :count]
        places.append(np.stack([u.ravel(), v.ravel()], axis=1))
        strides.append(np.full(count * count, stride))
    return np.concatenate(places).astype(np.float32), np.concatenate(strides).astype(np.float32)

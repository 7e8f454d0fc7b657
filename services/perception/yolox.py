"""A COCO-style YOLOX detector given as a file: for photographs, on which our own detector finds nothing."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np

from proto.perception import ObjectClass
from services.perception.detection import Detection, FloatArray, detections, suppress
from services.perception.detector import DetectorOptions, Picture

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
STRIDES_PX = (8, 16, 32)
_PAD = 114


class YoloxDetector:
    """Input (1, 3, S, S) float32 BGR 0..255, letterboxed with grey; output (1, N, 85) undecoded, strides 8, 16, 32."""

    def __init__(self, session: Any, options: DetectorOptions, *, name: str) -> None:
        self.name = name
        self._session = session
        self._input = session.get_inputs()[0].name
        self._side = int(session.get_inputs()[0].shape[2])
        self._options = options
        self._cells, self._strides = _grid(self._side)
        self._columns = np.array(sorted(COCO))
        self._floors = np.array([options.floor(COCO[index]) for index in sorted(COCO)], dtype=np.float32)

    def detect(self, rgb: Picture) -> list[Detection]:
        """See `Detector`."""
        canvas, scale = self._fit(rgb)
        raw = self._session.run(None, {self._input: canvas})[0][0]
        scores = raw[:, 4:5] * raw[:, 5 + self._columns]
        best = scores.argmax(axis=1)
        top = scores[np.arange(len(best)), best]
        keep = np.flatnonzero(top >= self._floors[best])
        boxes = self._decode(raw[keep], keep) / scale
        kinds = [COCO[int(self._columns[index])] for index in best[keep]]
        codes = np.array([sorted(set(COCO.values())).index(kind) for kind in kinds], dtype=np.int64)
        chosen = suppress(boxes, top[keep], codes, self._options.overlap_limit)
        size = (rgb.shape[1], rgb.shape[0])
        return detections(boxes[chosen], top[keep][chosen], [kinds[index] for index in chosen], size)

    def _fit(self, rgb: Picture) -> tuple[FloatArray, float]:
        scale = min(self._side / rgb.shape[0], self._side / rgb.shape[1])
        size = (round(rgb.shape[1] * scale), round(rgb.shape[0] * scale))
        canvas = np.full((self._side, self._side, 3), _PAD, dtype=np.uint8)
        canvas[: size[1], : size[0]] = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA)
        return np.ascontiguousarray(canvas[:, :, ::-1].transpose(2, 0, 1)[None], dtype=np.float32), scale

    def _decode(self, raw: FloatArray, rows: Any) -> FloatArray:
        stride = self._strides[rows, None]
        centre = (raw[:, :2] + self._cells[rows]) * stride
        half = np.exp(raw[:, 2:4]) * stride / 2
        return np.concatenate([centre - half, centre + half], axis=1).astype(np.float32)


def _grid(side: int) -> tuple[FloatArray, FloatArray]:
    cells, strides = [], []
    for stride in STRIDES_PX:
        count = side // stride
        v, u = np.mgrid[:count, :count]
        cells.append(np.stack([u.ravel(), v.ravel()], axis=1))
        strides.append(np.full(count * count, stride))
    return np.concatenate(cells).astype(np.float32), np.concatenate(strides).astype(np.float32)

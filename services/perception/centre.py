"""Our own detector: a heat map of object centres with the distances to the four sides, at a stride of four pixels."""

from __future__ import annotations

from typing import Any, get_args

import cv2
import numpy as np

from proto.perception import ObjectClass
from services.perception.detection import Detection, FloatArray, detections, suppress
from services.perception.detector import DetectorError, DetectorOptions, Picture

CLASSES: tuple[ObjectClass, ...] = get_args(ObjectClass)
STRIDE_PX = 4
"""The same number stands in `evaluation/training/detector_net.py`, held by a test."""
AS_IT_IS = (1.0, 0.0)
"""Slope and offset of a class whose scores nobody calibrated."""
_MOST = 100


class CentreDetector:
    """The exported net: input uint8 (1, H, W, 3) RGB, outputs `heat` at peaks (1, K, H/4, W/4) and `sides_px`.

    Its card may hold `calibration`: slope and offset that make a class's scores probabilities. Floors are of the raw heat.
    """

    def __init__(self, session: Any, card: dict[str, Any], options: DetectorOptions, *, name: str) -> None:
        self.name = name
        self._session = session
        self._input = session.get_inputs()[0].name
        _, self._height, self._width, _ = session.get_inputs()[0].shape
        self._options = options
        self._classes: tuple[ObjectClass, ...] = tuple(card.get("classes", CLASSES))
        if not set(self._classes) <= set(CLASSES):
            raise DetectorError(f"the detector's card names unknown classes: {self._classes}")
        written = card.get("floors", {})
        floors = [(options.floors or {}).get(kind, written.get(kind, options.score_floor)) for kind in self._classes]
        self._floors = np.array(floors, dtype=np.float32)[:, None, None]
        curves = [card.get("calibration", {}).get(kind, AS_IT_IS) for kind in self._classes]
        self._curves = np.array(curves, dtype=np.float32).reshape(-1, 2)

    def detect(self, rgb: Picture) -> list[Detection]:
        """See `Detector`."""
        canvas, scale = self._fit(rgb)
        heat, spread = self._session.run(["heat", "sides_px"], {self._input: canvas})
        kinds, rows, columns = np.nonzero(heat[0] >= self._floors)
        scores = heat[0][kinds, rows, columns]
        if len(scores) > _MOST:
            best = np.argsort(-scores)[:_MOST]
            kinds, rows, columns, scores = kinds[best], rows[best], columns[best], scores[best]
        sides = spread[0][:, rows, columns]
        centres = np.stack([columns, rows]).astype(np.float32) * STRIDE_PX + STRIDE_PX / 2
        boxes = np.concatenate([centres - sides[:2], centres + sides[2:]]).T / scale
        kept = suppress(boxes.astype(np.float32), scores, kinds, self._options.overlap_limit)
        names = [self._classes[kinds[index]] for index in kept]
        sure = _probabilities(scores[kept], self._curves[kinds[kept]])
        return detections(boxes[kept].astype(np.float32), sure, names, (rgb.shape[1], rgb.shape[0]))

    def _fit(self, rgb: Picture) -> tuple[Picture, float]:
        """The picture in the upper left corner of the net's canvas, scaled down or up to fit, and the scale."""
        scale = min(self._width / rgb.shape[1], self._height / rgb.shape[0])
        if scale != 1.0:
            size = (round(rgb.shape[1] * scale), round(rgb.shape[0] * scale))
            scaled = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
            rgb = scaled.astype(np.uint8, copy=False)
        canvas = np.zeros((1, self._height, self._width, 3), dtype=np.uint8)
        canvas[0, : rgb.shape[0], : rgb.shape[1]] = rgb
        return canvas, scale


def _probabilities(scores: FloatArray, curves: FloatArray) -> FloatArray:
    """Scores (N) as probabilities, by slope and offset (N, 2) of their log-odds."""
    safe = np.clip(scores, 1e-4, 1 - 1e-4)
    told: FloatArray = (1.0 / (1.0 + np.exp(-(curves[:, 0] * np.log(safe / (1 - safe)) + curves[:, 1])))).astype(
        np.float32
    )
    return told

"""Our own detector: a heat map of object centres with the distances to the four sides, at a stride of four pixels."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import lru_cache, partial
from typing import Any, TypeVar, get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from proto.perception import ObjectClass
from services.perception.detect.detection import Detection, FloatArray, detections, suppress
from services.perception.detect.detector import DetectorError, DetectorOptions, Picture
from services.perception.detect.second_look import ASKS_FROM, SecondLook

CLASSES: tuple[ObjectClass, ...] = get_args(ObjectClass)
STRIDE_PX = 4
"""The same number stands in `training/detector/net.py`, held by a test."""
AS_IT_IS = (1.0, 0.0)
"""Slope and offset of a class whose scores are not calibrated."""
CANVAS_PX = (384, 640)
"""Height and width of what a net for pictures of any size is given where it looks once; of a picture of another form, as many pixels."""
BESIDE_PX = (288, 480)
"""The same where it looks closer too: what is far is in the closer look, what is near is large enough."""
SIDES_PX = 32
"""The sides of what such a net is given are multiples of this."""
_MOST = 100
STRIP_MIDDLE = 196 / 360
"""The middle of what is looked at closer, as a share of the picture's height. The horizon of a level camera is in the strip, and that of
one that looks up a little, as many do."""
STRIP_OF_WIDTH, STRIP_OF_HEIGHT = 0.225, 0.375
"""Its height as a share of the picture's width, and of its height; the larger one."""
CLOSER_PX = (288, 1280)
"""Height and width of the strip then; of a strip of another form, as many pixels."""
MOST_ENLARGED = 2.0
"""Our pictures' strip is enlarged so much, and no strip more: a small picture holds no more to see."""
CUT_PX, CUT_SHARE = 3.0, 0.08
"""What comes so near to the strip's edge there may go on beyond it: the whole picture shows it better. Above and below, where the strip
cuts what the picture does not, also as a share of the height: detectors draw edges inwards."""


_Found = tuple[FloatArray, FloatArray, NDArray[np.int64]]
Looked = TypeVar("Looked")


class CentreDetector:
    """The exported net: input uint8 (1, H, W, 3) RGB, outputs `heat` at peaks (1, K, H/4, W/4) and `sides_px`.

    Its card may hold `calibration`: slope and offset that make a class's scores probabilities. Floors are of the raw heat.
    A net for pictures of any size, multiples of 32, can look closer; one for a single size does not. With two threads and
    more the closer look is taken beside the other, which is faster than both of them one after the other on all threads.
    What may be of a class with a second look is judged by it: floor and calibration of the class are of its scores then.
    """

    def __init__(
        self,
        session: Any,
        card: dict[str, Any],
        options: DetectorOptions,
        *,
        name: str,
        second: Mapping[ObjectClass, SecondLook] | None = None,
    ) -> None:
        self.name = name
        self._session = session
        self._input = session.get_inputs()[0].name
        _, height, width, _ = session.get_inputs()[0].shape
        self._any_size = not isinstance(height, int)
        self._beside = ThreadPoolExecutor(1, "closer-look") if self._any_size and options.threads > 1 else None
        self._size: tuple[int, int] = CANVAS_PX if self._any_size else (height, width)
        self._options = options
        self._classes: tuple[ObjectClass, ...] = tuple(card.get("classes", CLASSES))
        if not set(self._classes) <= set(CLASSES):
            raise DetectorError(f"the detector's card names unknown classes: {self._classes}")
        written = card.get("floors", {})
        floors = [(options.floors or {}).get(kind, written.get(kind, options.score_floor)) for kind in self._classes]
        self._told_from = np.array(floors, dtype=np.float32)
        self._second = {self._classes.index(kind): look for kind, look in (second or {}).items()}
        asked = [
            ASKS_FROM[kind] if index in self._second else floor
            for index, (kind, floor) in enumerate(zip(self._classes, floors, strict=True))
        ]
        self._floors = np.array(asked, dtype=np.float32)[:, None, None]
        curves = [card.get("calibration", {}).get(kind, AS_IT_IS) for kind in self._classes]
        self._curves = np.array(curves, dtype=np.float32).reshape(-1, 2)

    def detect(self, rgb: Picture, *, closer: bool = False) -> list[Detection]:
        """See `Detector`."""
        if closer and self._any_size and min(rgb.shape[:2]) >= STRIDE_PX:  # what is smaller may have no strip
            both = self._side_by_side([partial(self._whole, rgb, BESIDE_PX), partial(self._closer, rgb)])
            boxes, scores, kinds = (np.concatenate(parts) for parts in zip(*both, strict=True))
        else:
            boxes, scores, kinds = self._whole(rgb, self._size)
        boxes, scores, kinds = self._kept(boxes, scores, kinds)
        if self._second:
            boxes, scores, kinds = self._looked_again(rgb, (boxes, scores, kinds))
        names = [self._classes[kind] for kind in kinds]
        return detections(boxes, _probabilities(scores, self._curves[kinds]), names, (rgb.shape[1], rgb.shape[0]))

    def _kept(self, boxes: FloatArray, scores: FloatArray, kinds: NDArray[np.int64]) -> _Found:
        """Best first, each thing once."""
        kept = suppress(boxes, scores, kinds, self._options.overlap_limit)
        return boxes[kept], scores[kept], kinds[kept]

    def _looked_again(self, rgb: Picture, found: _Found) -> _Found:
        """The same with the classes judged anew that have a second look; boxes that are the same thing's then are one."""
        boxes, scores, kinds = found
        asked = {kind: mine for kind in self._second if len(mine := np.flatnonzero(kinds == kind))}
        looks = [partial(self._second[kind].look, rgb, boxes[mine], scores[mine]) for kind, mine in asked.items()]
        for mine, better in zip(asked.values(), self._side_by_side(looks), strict=True):
            boxes[mine], scores[mine] = better
        told = scores >= self._told_from[kinds]
        return self._kept(boxes[told], scores[told], kinds[told])

    def _side_by_side(self, looks: Sequence[Callable[[], Looked]]) -> list[Looked]:
        """What each look gives; the first one is taken on this thread, the others on the second where there are two."""
        if self._beside is None:
            return [look() for look in looks]
        others = [self._beside.submit(look) for look in looks[1:]]
        return [look() for look in looks[:1]] + [other.result() for other in others]

    def _whole(self, rgb: Picture, size_px: tuple[int, int]) -> _Found:
        canvas, scale = whole(rgb, formed(rgb.shape[:2], size_px) if self._any_size else size_px)
        boxes, scores, kinds = self._found(canvas)
        return boxes / scale, scores, kinds

    def _found(self, canvas: Picture) -> _Found:
        """Boxes in pixels of the canvas, raw scores and classes, not yet suppressed."""
        heat, spread = self._session.run(["heat", "sides_px"], {self._input: canvas})
        kinds, rows, columns = np.nonzero(heat[0] >= self._floors)
        scores = heat[0][kinds, rows, columns]
        if len(scores) > _MOST:
            best = np.argsort(-scores)[:_MOST]
            kinds, rows, columns, scores = kinds[best], rows[best], columns[best], scores[best]
        sides = spread[0][:, rows, columns]
        centres = np.stack([columns, rows]).astype(np.float32) * STRIDE_PX + STRIDE_PX / 2
        boxes = np.concatenate([centres - sides[:2], centres + sides[2:]]).T
        return boxes.astype(np.float32), scores, kinds

    def _closer(self, rgb: Picture) -> _Found:
        """What the enlarged strip shows, in pixels of the whole picture; nothing that its edge may have cut."""
        canvas, (top, bottom), scale = strip(rgb)
        boxes, scores, kinds = self._found(canvas)
        rows, columns = scale * (bottom - top), scale * rgb.shape[1]
        near = np.full((len(boxes), 2), CUT_PX, np.float32)
        near[:, 1] = np.maximum(CUT_PX, CUT_SHARE * (boxes[:, 3] - boxes[:, 1]))
        uncut = ((boxes[:, :2] >= near) & (boxes[:, 2:] <= (columns, rows) - near)).all(axis=1)
        return boxes[uncut] / np.float32(scale) + np.array([0, top] * 2, np.float32), scores[uncut], kinds[uncut]


def whole(
    rgb: Picture, size_px: tuple[int, int] = CANVAS_PX, *, enlarging: int = cv2.INTER_LINEAR
) -> tuple[Picture, float]:
    """The picture (H, W, 3) in the upper left corner of a net's canvas (1, *size_px, 3), scaled down or up to fit, and the scale."""
    height, width = size_px
    scale = min(width / rgb.shape[1], height / rgb.shape[0])
    if scale != 1.0:
        size = (max(1, round(rgb.shape[1] * scale)), max(1, round(rgb.shape[0] * scale)))
        scaled = cv2.resize(rgb, size, interpolation=cv2.INTER_AREA if scale < 1 else enlarging)
        rgb = scaled.astype(np.uint8, copy=False)
    canvas = np.zeros((1, height, width, 3), dtype=np.uint8)
    canvas[0, : rgb.shape[0], : rgb.shape[1]] = rgb
    return canvas, scale


@lru_cache(64)
def formed(picture_px: tuple[int, int], size_px: tuple[int, int], most: float = math.inf) -> tuple[int, int]:
    """Height and width of the canvas, of no more pixels than one of `size_px`, on which a picture of this height and width is largest,
    enlarged `most` at most; sides in multiples of 32 px."""
    height, width = picture_px

    def scale(canvas: tuple[int, int]) -> float:
        return min(canvas[0] / height, canvas[1] / width, most)

    area = size_px[0] * size_px[1] // SIDES_PX**2
    forms = [(SIDES_PX * rows, SIDES_PX * (area // rows)) for rows in range(1, area + 1)]
    best = max(scale(form) for form in forms)
    smallest = [max(SIDES_PX, SIDES_PX * math.ceil(best * side / SIDES_PX - 1e-6)) for side in picture_px]
    return smallest[0], smallest[1]


def strip_rows(height_px: int, width_px: int) -> tuple[int, int]:
    """Upper and lower row of what is looked at closer in a picture of this size; as much of it as the picture has."""
    rows = min(height_px, max(1, round(STRIP_OF_WIDTH * width_px), round(STRIP_OF_HEIGHT * height_px)))
    top = min(max(0, round(STRIP_MIDDLE * height_px - rows / 2)), height_px - rows)
    return top, top + rows


def strip(rgb: Picture) -> tuple[Picture, tuple[int, int], float]:
    """The picture's strip about the horizon, enlarged (1, H, W, 3), its upper and lower row in the picture, and the scale."""
    top, bottom = strip_rows(*rgb.shape[:2])
    size = formed((bottom - top, rgb.shape[1]), CLOSER_PX, MOST_ENLARGED)
    canvas, scale = whole(rgb[top:bottom], size, enlarging=cv2.INTER_CUBIC)
    return canvas, (top, bottom), scale


def _probabilities(scores: FloatArray, curves: FloatArray) -> FloatArray:
    """Scores (N) as probabilities, by slope and offset (N, 2) of their log-odds."""
    safe = np.clip(scores, 1e-4, 1 - 1e-4)
    told: FloatArray = (1.0 / (1.0 + np.exp(-(curves[:, 0] * np.log(safe / (1 - safe)) + curves[:, 1])))).astype(
        np.float32
    )
    return told

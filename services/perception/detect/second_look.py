"""A second network for a class looks at each box that may be of it, enlarged and with its surroundings: better score and edges."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from proto.perception import ObjectClass
from services.perception.detect.detection import FloatArray
from services.perception.detect.detector import Picture

SIDE_PX = 64
"""The pictures that the network is given; the same number stands in `training/second_look/net.py`, held by a test."""
AROUND = 2.2
"""Their side as a multiple of the box's longer one: what hides a thing tells where the rest of it is."""
LEAST_PX = 4.0
ASKS_FROM: Mapping[ObjectClass, float] = {"sign": 0.12, "pedestrian": 0.15, "light": 0.08}
"""The detector's raw score from which a box of a class is looked at. Of people with 0.15, one in two hundred is one. Of photographed
signs of 24 px and more, 96 of 100 have a box with 0.12, and 83 one with the score from which the detector alone would tell them."""
MOST = 24
"""Boxes of a class looked at in one picture; hardly any has more. The rest, the least sure of all, are told by the detector's own score."""
NOTHING_WEIGHED = (1.0, 0.0, 0.0)


def windows(boxes: FloatArray) -> FloatArray:
    """Middle and side (N, 3), in pixels, of the square around each box (N, 4) that is looked at."""
    middle = (boxes[:, :2] + boxes[:, 2:]) / 2
    side = AROUND * np.maximum((boxes[:, 2:] - boxes[:, :2]).max(axis=1), LEAST_PX)
    return np.concatenate([middle, side[:, None]], axis=1).astype(np.float32)


def shapes(boxes: FloatArray) -> FloatArray:
    """Width and height (N, 2) of each box (N, 4) as shares of its square's side."""
    return ((boxes[:, 2:] - boxes[:, :2]) / windows(boxes)[:, 2:]).astype(np.float32)


def cut(rgb: Picture, seen: FloatArray, side_px: int = SIDE_PX) -> NDArray[np.uint8]:
    """Squares (N, 3) of middle and side as pictures (N, side, side, 3); beyond the edge its last pixels go on."""
    out = np.empty((len(seen), side_px, side_px, 3), np.uint8)
    for picture, (x, y, side) in zip(out, seen.tolist(), strict=True):
        scale = side / side_px
        move = np.array([[scale, 0.0, x - side / 2 + scale / 2 - 0.5], [0.0, scale, y - side / 2 + scale / 2 - 0.5]])
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        picture[:] = cv2.warpAffine(rgb, move, (side_px, side_px), flags=flags, borderMode=cv2.BORDER_REPLICATE)
    return out


def boxes_in(seen: FloatArray, sides: FloatArray) -> FloatArray:
    """Boxes (N, 4) in pixels of the picture, of edges (N, 4) told as shares of each square: left, top, right, bottom of its middle."""
    middle, side = np.tile(seen[:, :2], 2), seen[:, 2:]
    return (middle + sides * side).astype(np.float32)


class SecondLook:
    """The network: pictures uint8 (N, 64, 64, 3) and `sizes` (N, 2) of the boxes in, log-odds of the class (N) and edges (N, 4) out.

    `weights`: what its log-odds, the detector's own and a constant count for in the log-odds told.
    """

    def __init__(self, session: Any, weights: tuple[float, float, float]) -> None:
        self._session = session
        self._weights = weights

    def told(self, rgb: Picture, boxes: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Log-odds (N) that each box (N, 4) is of the class, and better edges (N, 4), px: the mean of the box's and the network's, since
        each errs in its own way."""
        seen = windows(boxes)
        odds, sides = self._session.run(None, {"pictures": cut(rgb, seen), "sizes": shapes(boxes)})
        mean: FloatArray = ((boxes + boxes_in(seen, sides)) / 2).astype(np.float32)
        return odds, mean

    def look(self, rgb: Picture, boxes: FloatArray, scores: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Better boxes of those (N, 4) with raw scores (N), best first, and better scores. Beyond `MOST` they stay as they are."""
        boxes, scores = boxes.copy(), scores.copy()
        odds, boxes[:MOST] = self.told(rgb, boxes[:MOST])
        own = np.clip(scores[:MOST], 1e-4, 1 - 1e-4)
        new, old, offset = self._weights
        scores[:MOST] = 1.0 / (1.0 + np.exp(-(new * odds + old * np.log(own / (1 - own)) + offset)))
        return boxes, scores

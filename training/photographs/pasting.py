"""Photographed signs cut out by their shape and put into other photographs, for a detector that has too few of them."""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from services.drivelm.reading.crops import Picture, Region
from training.photographs.gtsrb import NAMES, RealSign
from training.sign_pictures.degrade import Chance

SMALLEST_PX, LARGEST_PX = 14.0, 90.0
_DIAMOND, _DOWN, _OCTAGON, _ROUND, _UP = "diamond", "down", "octagon", "round", "up"
_CORNERS = {
    _DIAMOND: ((0.5, 0.0), (1.0, 0.5), (0.5, 1.0), (0.0, 0.5)),
    _DOWN: ((0.0, 0.0), (1.0, 0.0), (0.5, 1.0)),
    _OCTAGON: ((0.29, 0.0), (0.71, 0.0), (1.0, 0.29), (1.0, 0.71), (0.71, 1.0), (0.29, 1.0), (0.0, 0.71), (0.0, 0.29)),
    _UP: ((0.5, 0.0), (1.0, 1.0), (0.0, 1.0)),
}
_SHAPES = {"priority_road": _DIAMOND, "yield": _DOWN, "stop": _OCTAGON} | dict.fromkeys(
    (
        "priority_intersection", "warning_sign", "single_curve_left", "single_curve_right", "double_curve_left", "rough_road",
        "slippery_road", "narrows_right", "workers_in_road", "traffic_light", "pedestrian_warning", "children_warning",
        "cyclists_warning", "icy_road", "animals_warning",
    ),
    _UP,
)  # fmt: skip


def pasted(
    picture: Picture, signs: Sequence[RealSign], taken: Sequence[Region], chance: Chance, count: int
) -> tuple[Picture, list[Region]]:
    """The picture with up to `count` of the signs where nothing in `taken` stands, and where they are, px."""
    out, put = picture.copy(), list(taken)
    for _ in range(count):
        sign = signs[int(chance.integers(len(signs)))]
        height = float(np.exp(chance.uniform(np.log(SMALLEST_PX), np.log(LARGEST_PX))))
        if height > 1.4 * sign.region.height_px:  # no larger than it was photographed, but for a little
            height = sign.region.height_px
        place = _place(picture, height, height * sign.region.width_px / sign.region.height_px, chance)
        if place is not None and not any(_touch(place, other) for other in put):
            _put(out, sign, place, chance)
            put.append(place)
    return out, put[len(taken) :]


def _place(picture: Picture, height: float, width: float, chance: Chance) -> Region | None:
    """Somewhere in the upper four fifths, on whole pixels."""
    rows, columns = picture.shape[:2]
    high, wide = max(4, round(height)), max(4, round(width))
    if high + 4 > 0.75 * rows or wide + 4 > columns:
        return None
    x, y = int(chance.integers(2, columns - wide - 1)), int(chance.integers(2, int(0.8 * rows) - high + 1))
    return Region(x, y, x + wide, y + high)


def _touch(one: Region, other: Region) -> bool:
    return (
        one.x0_px < other.x1_px + 3
        and other.x0_px < one.x1_px + 3
        and one.y0_px < other.y1_px + 3
        and other.y0_px < one.y1_px + 3
    )


def _put(out: Picture, sign: RealSign, place: Region, chance: Chance) -> None:
    """Lay the sign over the picture, its edge soft, its light between its own and that of what it covers."""
    x0, y0, x1, y1 = (int(edge) for edge in place)
    left, top, right, bottom = (max(0, round(edge)) for edge in sign.region)
    face = sign.picture()[top : max(bottom, top + 2), left : max(right, left + 2)]
    between = cv2.INTER_AREA if face.shape[0] > y1 - y0 else cv2.INTER_LINEAR
    shrunk = np.asarray(cv2.resize(face, (x1 - x0, y1 - y0), interpolation=between), np.float32)
    ground = out[y0:y1, x0:x1].astype(np.float32)
    share = _mask(_SHAPES.get(NAMES[sign.number], _ROUND), x1 - x0, y1 - y0)
    bright = float(ground.mean() + 20) / float(shrunk.mean() + 20)
    lit = shrunk * bright ** float(chance.uniform(0.2, 0.7))
    out[y0:y1, x0:x1] = np.clip(ground * (1 - share) + lit * share, 0, 255).astype(np.uint8)


def _mask(shape: str, width: int, height: int) -> NDArray[np.float32]:
    """Shares (height, width, 1) of a face of this shape that fills its box."""
    mask = np.zeros((height, width), np.uint8)
    if shape == _ROUND:
        cv2.ellipse(mask, ((width / 2, height / 2), (width, height), 0.0), (255,), -1, cv2.LINE_AA)
    else:
        corners = np.array(_CORNERS[shape]) * [width, height] * 16
        cv2.fillPoly(mask, [np.round(corners).astype(np.int32)], (255,), cv2.LINE_AA, 4)
    return np.asarray(cv2.GaussianBlur(mask, (0, 0), 0.6)[..., None] / 255, np.float32)

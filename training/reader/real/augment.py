"""What else a camera might have seen of a photographed sign: farther off, askew, in other light, through a sloppier box; and
what a sign is no longer once it is mirrored or turned."""

from collections.abc import Iterator, Mapping

import cv2
import numpy as np

from services.drivelm.reading.crops import Picture, Region, crop
from services.drivelm.vocabulary.classes import OTHER
from training.photographs.gtsrb import NAMES
from training.reader.rendered import Sample
from training.sign_pictures.degrade import Chance, any_conditions, camera, jittered

SMALLEST_PX = 9.0
_PAD = 0.35
"""Share of the box kept around it before it is changed: a crop's margin and as much again."""


def seen(picture: Picture, region: Region, label: str, chance: Chance, hard: float = 0.35) -> Iterator[Sample]:
    """One sample of a sign, or none: in two of five as it was photographed but for the box."""
    patch, box = _around(picture, region)
    if chance.random() < 0.6:
        patch, box = _farther(patch, box, chance)
        patch = _askew(patch, box, chance)
        now = any_conditions(chance, hard)._replace(night=False, rain=0)
        patch = camera(patch.astype(np.float32), patch.shape[0], 1.0, now, chance)
        if chance.random() < 0.1:
            patch = _glare(patch, chance)
    amount = float(chance.choice([0.02, 0.05, 0.08]))
    if (cut := crop(patch, jittered(box, chance, amount))) is not None:
        yield Sample(cut, label, box.height_px)


def _around(picture: Picture, region: Region) -> tuple[Picture, Region]:
    height, width = picture.shape[:2]
    dx, dy = _PAD * region.width_px + 2, _PAD * region.height_px + 2
    x0, y0 = max(0, round(region.x0_px - dx)), max(0, round(region.y0_px - dy))
    x1, y1 = min(width, round(region.x1_px + dx)), min(height, round(region.y1_px + dy))
    moved = Region(region.x0_px - x0, region.y0_px - y0, region.x1_px - x0, region.y1_px - y0)
    return np.ascontiguousarray(picture[y0:y1, x0:x1]), moved


def _farther(patch: Picture, box: Region, chance: Chance) -> tuple[Picture, Region]:
    """Up to several times farther off; two in five stay as near as they are."""
    height = box.height_px
    if height < 2 * SMALLEST_PX or (height < 120 and chance.random() < 0.4):
        return patch, box
    wanted = float(np.exp(chance.uniform(np.log(SMALLEST_PX * 1.4), np.log(min(height, 100.0)))))
    scale = wanted / height
    size = (max(6, round(patch.shape[1] * scale)), max(6, round(patch.shape[0] * scale)))
    sx, sy = size[0] / patch.shape[1], size[1] / patch.shape[0]
    small = np.asarray(cv2.resize(patch, size, interpolation=cv2.INTER_AREA), np.uint8)
    return small, Region(box.x0_px * sx, box.y0_px * sy, box.x1_px * sx, box.y1_px * sy)


def _askew(patch: Picture, box: Region, chance: Chance) -> Picture:
    """Turned by a few degrees and narrowed about the box's middle, as a sign seen from aside."""
    middle = ((box.x0_px + box.x1_px) / 2, (box.y0_px + box.y1_px) / 2)
    warp = cv2.getRotationMatrix2D(middle, float(chance.normal(0, 3.5)), 1.0)
    narrow = float(chance.uniform(0.86, 1.04))
    warp[0] = warp[0] * narrow + np.array([0.0, 0.0, (1 - narrow) * middle[0]])
    size = (patch.shape[1], patch.shape[0])
    return np.asarray(
        cv2.warpAffine(patch, warp, size, flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.uint8
    )


def _glare(patch: Picture, chance: Chance) -> Picture:
    """A bright spot with a soft edge, or haze over all."""
    height, width = patch.shape[:2]
    y, x = np.mgrid[:height, :width].astype(np.float32)
    cx, cy, reach = chance.uniform(0, width), chance.uniform(0, height), chance.uniform(0.15, 0.6) * max(height, width)
    glow = float(chance.uniform(40, 130)) * np.exp(-((x - cx) ** 2 + (y - cy) ** 2) / reach**2)
    return np.asarray(np.clip(patch + glow[..., None], 0, 255), np.uint8)


_MIRRORED: Mapping[str, str] = {
    "right_obstacle": "keep_left", "left_obstacle": "keep_right", "yield": "yield", "priority_road": "priority_road",
    "do_not_enter": "no_entry", "no_entry_vehicles": "no_vehicles", "straight": "ahead_only", "warning_sign": "danger",
    "priority_intersection": "priority_here", "children_warning": "children", "pedestrian_warning": "crossing",
    "workers_in_road": "roadworks", "slippery_road": "slippery", "roundabout": "roundabout",
    **dict.fromkeys(
        ("animals_warning", "cyclists_warning", "double_curve_left", "icy_road", "left", "right", "narrows_right",
         "no_entry_heavy", "no_overtaking_heavy", "rough_road", "single_curve_left", "single_curve_right", "straight_left",
         "straight_right", "traffic_light", "speed_limit_20", "speed_limit_30", "speed_limit_50", "speed_limit_60",
         "speed_limit_70", "speed_limit_100", "speed_limit_120"), OTHER),
}  # fmt: skip
"""What a sign is in a mirror; what is not listed (80 reads much the same, lettering, slanted bars) is not mirrored."""
_TURNED = frozenset(
    {"animals_warning", "children_warning", "cyclists_warning", "left_obstacle", "right_obstacle", "pedestrian_warning",
     "priority_intersection", "rough_road", "slippery_road", "straight", "straight_left", "straight_right", "traffic_light",
     "warning_sign", "workers_in_road", "yield", "no_overtaking", "stop", "left", "right"}
)  # fmt: skip
"""What is no sign of ours upside down."""


def flipped(picture: Picture, region: Region, number: int, chance: Chance) -> Iterator[Sample]:
    """The sign in a mirror, or upside down as something unknown; nothing where either looks too much like what it was."""
    name, (height, width) = NAMES[number], picture.shape[:2]
    if name in _TURNED and chance.random() < 0.35:
        turned = Region(width - region.x1_px, height - region.y1_px, width - region.x0_px, height - region.y0_px)
        yield from seen(np.ascontiguousarray(picture[::-1, ::-1]), turned, OTHER, chance)
    elif name in _MIRRORED:
        mirrored = Region(width - region.x1_px, region.y0_px, width - region.x0_px, region.y1_px)
        yield from seen(np.ascontiguousarray(picture[:, ::-1]), mirrored, _MIRRORED[name], chance)

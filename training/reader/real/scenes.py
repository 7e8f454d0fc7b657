"""Crops out of photographed road scenes: labelled signs, what our detector takes for signs and our reader for none, bare
background, and drawn unknown signs before it."""

from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

import numpy as np

from drivemcp.paths import data
from services.drivelm.reading.crops import Picture, Region, crop
from services.drivelm.reading.reader import Reader
from services.drivelm.vocabulary.classes import OTHER
from services.perception.detect.loading import load_detector
from training.photographs.gtsdb import Scene, scenes
from training.photographs.gtsrb import CLASSES
from training.reader.real.augment import SMALLEST_PX, seen
from training.reader.rendered import Sample, touch
from training.sign_pictures.backgrounds import BACKGROUND_PX
from training.sign_pictures.degrade import Chance, any_conditions, seen_crop, view
from training.sign_pictures.unknown import unknown_face

SIGN_VARIANTS, GROUNDS, UNKNOWN = 4, 8, 12
"""Of each scene: variants of each labelled sign, bare boxes, drawn unknown signs."""
LOOKS_LIKE_A_SIGN = 0.3
"""An unlabelled box is `other` where our reader gives less than this to all that it knows; else it is left out."""


def scene_samples(folder: Path, chance: Chance, held_out: bool, unseen: Collection[int] = ()) -> Iterator[Sample]:
    """Samples of the scenes that training has, or of those that it leaves out (labelled signs and background alone); no
    labelled sign of a number in `unseen`."""
    reader, detector = Reader.load(data("models/reader.onnx")), load_detector(data("models/detector.onnx"))
    for scene in scenes(folder):
        if scene.held_out != held_out:
            continue
        picture = scene.picture()
        for sign in (each for each in scene.signs if each.number not in unseen):
            if held_out and (cut := crop(picture, sign.region)) is not None:
                yield Sample(cut, CLASSES[sign.number], sign.region.height_px)
            for _ in range(0 if held_out else SIGN_VARIANTS):
                yield from seen(picture, sign.region, CLASSES[sign.number], chance)
        found = [Region(*each.box_px) for each in detector.detect(picture) if each.kind in ("sign", "panel")]
        boxes = [box for box in found if box.height_px >= SMALLEST_PX] + [
            _any_box(picture, chance) for _ in range(GROUNDS)
        ]
        yield from _nothing(picture, _apart(boxes, scene), reader, chance)
        if not held_out:
            yield from _unknown(picture, chance)


def _any_box(picture: Picture, chance: Chance) -> Region:
    height, width = picture.shape[:2]
    size = float(np.exp(chance.uniform(np.log(10), np.log(90))))
    x, y = float(chance.uniform(0, width - size)), float(chance.uniform(0, 0.8 * height - size))
    return Region(x, y, x + size, y + size * float(chance.uniform(0.6, 1.6)))


def _apart(boxes: Sequence[Region], scene: Scene) -> list[Region]:
    """The boxes that touch no labelled sign."""
    return [box for box in boxes if not any(touch(box, sign.region) for sign in scene.signs)]


def _nothing(picture: Picture, boxes: Sequence[Region], reader: Reader, chance: Chance) -> Iterator[Sample]:
    cut = [(box, crop(picture, box)) for box in boxes]
    shown = [(box, each) for box, each in cut if each is not None]
    if not shown:
        return
    told = reader.probabilities(np.stack([each for _, each in shown]))[:, reader.classes.index(OTHER)]
    for (box, each), share in zip(shown, told, strict=True):
        if 1 - share < LOOKS_LIKE_A_SIGN:
            yield Sample(each, OTHER, 0.0)
            yield from seen(picture, box, OTHER, chance)


def _unknown(picture: Picture, chance: Chance) -> Iterator[Sample]:
    """Drawn signs that say nothing known, before a window of the scene."""
    height, width = picture.shape[:2]
    for _ in range(UNKNOWN):
        x, y = int(chance.integers(0, width - BACKGROUND_PX)), int(chance.integers(0, height - BACKGROUND_PX))
        ground = picture[y : y + BACKGROUND_PX, x : x + BACKGROUND_PX]
        size = float(np.exp(chance.uniform(np.log(10), np.log(75))))
        taken = view(unknown_face(chance), ground, size, any_conditions(chance, 0.6), chance, False)
        yield Sample(seen_crop(taken, chance), OTHER, 0.0)

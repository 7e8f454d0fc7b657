"""Labelled crops out of rendered pictures, for training beside the drawn ones, and for scoring.

``python -m training reader.rendered --out FILE --frames N --split train`` (needs the extra ``simulator``);
``--lights``: an avenue of nothing but traffic lights, one crop of each (see ``reader_avenue_lights``).
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from services.drivelm.reading import plates
from services.drivelm.reading.crops import Picture, Region, crop
from services.drivelm.vocabulary.classes import OTHER, READER_CLASSES
from training.labelling import Label
from training.sign_pictures.avenue import Frame, class_of, drive
from training.sign_pictures.avenue_lights import drive_lights
from training.sign_pictures.degrade import jittered

Chance = np.random.Generator
_VISIBLE, _MIN_PX = 0.8, 9.0
_VARIANTS = 3


class Sample(NamedTuple):
    """A crop, its class, and the sign's true height in pixels."""

    crop: Picture
    label: str
    size_px: float


def samples_of(frame: Frame, chance: Chance, variants: int = _VARIANTS) -> Iterator[Sample]:
    """Crops of everything readable, of where plates are or would be, of vehicles and of bare background."""
    for label in frame.labels:
        name = class_of(label)
        region = Region(*label.full_box_px)
        if label.visible_fraction < _VISIBLE or region.height_px < _MIN_PX:
            continue
        if name is None:
            if label.kind in ("vehicle", "pedestrian"):
                yield from _cut(frame.picture, region, OTHER, 0.0, chance, 1)
            continue
        yield from _cut(frame.picture, region, name, region.height_px, chance, variants)
        if label.kind == "sign" and not name.startswith("plate:") and region.height_px > 14:
            yield from _below(frame, label, region, chance)
    yield from _background(frame, chance)


def _cut(picture: Picture, region: Region, name: str, size_px: float, chance: Chance, count: int) -> Iterator[Sample]:
    for _ in range(count):
        if (cut := crop(picture, jittered(region, chance, 0.06))) is not None:
            yield Sample(cut, name, size_px)


def _below(frame: Frame, label: Label, region: Region, chance: Chance) -> Iterator[Sample]:
    """Where a plate would hang: nothing there is as important to learn as a plate."""
    hung = next((other for other in frame.labels if other.id == label.id and other.part == label.part + 1), None)
    name = class_of(hung) if hung is not None and hung.kind == "sign" else None
    place = plates.split(region, boards=label.country == "USA")[1]
    if hung is None:
        yield from _cut(frame.picture, place, OTHER, 0.0, chance, 1)
    elif name is not None and name.startswith("plate:"):
        yield from _cut(frame.picture, place, name, hung.full_box_px[3] - hung.full_box_px[1], chance, 1)


def _background(frame: Frame, chance: Chance) -> Iterator[Sample]:
    height, width = frame.picture.shape[:2]
    for _ in range(2):
        size, x, y = chance.uniform(10, 60), chance.uniform(0, width), chance.uniform(0, height * 0.7)
        region = Region(float(x), float(y), float(x + size), float(y + size * chance.uniform(0.6, 1.6)))
        if not any(touch(region, Region(*label.full_box_px)) for label in frame.labels if class_of(label)):
            yield from _cut(frame.picture, region, OTHER, 0.0, chance, 1)


def touch(a: Region, b: Region) -> bool:
    """Whether two regions share a part."""
    return a.x0_px < b.x1_px and b.x0_px < a.x1_px and a.y0_px < b.y1_px and b.y0_px < a.y1_px


def collect(
    split: str, seed: int, frames: int, lights: bool = False
) -> tuple[NDArray[np.uint8], NDArray[np.int64], NDArray[np.float32]]:
    """Crops, class indexes and sizes out of ``frames`` rendered pictures; of ``lights`` alone, each once in a picture."""
    chance = np.random.default_rng([seed, 51])
    driven, variants = (drive_lights, 1) if lights else (drive, _VARIANTS)
    return stacked([sample for frame in driven(split, seed, frames) for sample in samples_of(frame, chance, variants)])


def stacked(samples: Sequence[Sample]) -> tuple[NDArray[np.uint8], NDArray[np.int64], NDArray[np.float32]]:
    """Crops (N x 48 x 48 x 3), class indexes, and sizes in pixels, 0 for `other`."""
    index = {label: number for number, label in enumerate(READER_CLASSES)}
    return (
        np.stack([sample.crop for sample in samples]),
        np.array([index[sample.label] for sample in samples], np.int64),
        np.array([0.0 if sample.label == OTHER else sample.size_px for sample in samples], np.float32),
    )


def main() -> int:
    """Write crops, labels and sizes to one file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--frames", type=int, default=1500)
    parser.add_argument("--split", choices=("train", "test"), default="train")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--lights", action="store_true", help="traffic lights alone")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    crops, labels, sizes = collect(options.split, options.seed, options.frames, options.lights)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    np.savez(options.out, crops=crops, labels=labels, sizes=sizes)
    return 0


if __name__ == "__main__":
    sys.exit(main())

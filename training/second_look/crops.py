"""What a second look learns from: what the detector takes for its class in training pictures, rightly or not, cut out with room."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from proto.perception import ObjectClass
from services.perception.detect.detection import FloatArray, overlaps
from services.perception.detect.detector import Detector, Picture
from services.perception.detect.second_look import ASKS_FROM, SIDE_PX, cut, shapes, windows
from services.simulator.scene.scene import FRONT
from training.dataset.shards import CLASSES, counted, inside, shard_frames
from training.detector.targets import TRAIN_HEIGHT_PX
from training.lens import through_lens

CROP_PX = 88
ROOM = CROP_PX / SIDE_PX
"""Crops are kept so much larger than they are looked at: each time they are met they are moved and scaled."""
THERE, ABSENT, KNOWN = 0.4, 0.3, 0.25
"""IoU from which a box is of a thing of the class, below which it is of none, and from which it teaches where the edges are."""
IGNORED_SHARE = 0.3
DRAWN, DRAWN_SPREAD = 2, 0.13
"""Boxes drawn anew about each thing, beside the detector's own, and how far off their edges are, in their sizes."""
SCALES, SHIFT = (0.85, 1.18), 0.07
LEARNS_FROM = 0.05
"""The detector's raw score from which a box of a photograph teaches: most of what it takes for the class there is not of it."""
REAL_SHARE = 0.3
"""Of each batch's things and of its others so many are from photographs, so that a photograph speaks neither for nor against one."""


@dataclass(frozen=True, slots=True, eq=False)
class Crops:
    """`pictures` (N, 88, 88, 3); `boxes` (N, 4) asked about and `things` (N, 4) of the class that are there (zeros: none), px;
    `kinds` (N): 1 of the class, 0 not, -1 neither surely; `real` (N): from a photograph."""

    pictures: NDArray[np.uint8]
    boxes: FloatArray
    things: FloatArray
    kinds: NDArray[np.int64]
    real: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.kinds)


def joined(parts: Sequence[Crops]) -> Crops:
    """All of them."""
    return Crops(*(np.concatenate([getattr(part, name) for part in parts]) for name in Crops.__slots__))


class Batch(NamedTuple):
    """`pictures` (N, 88, 88, 3); `looks` (N, 3): shift right and down and scale by which to look at them; `sizes` (N, 2) of the
    boxes asked about, in shares of the side looked at; `kinds` (N) as above; `known` (N): whether the edges count;
    `sides` (N, 4): the thing's edges from the look's middle, in shares of its side."""

    pictures: NDArray[np.uint8]
    looks: FloatArray
    sizes: FloatArray
    kinds: FloatArray
    known: NDArray[np.bool_]
    sides: FloatArray


def collected(
    paths: Sequence[Path], detector: Detector, kind: ObjectClass, seed: int, *, but: Collection[bytes] = ()
) -> Crops:
    """All that some shards give of a class, each rendered picture also through a dirty lens. The detector tells raw scores.

    Pictures with a mark in `but` are left out: what chooses does not teach.
    """
    rng = np.random.default_rng([seed, 88])
    parts = []
    for path in paths:
        for picture, rows, note in shard_frames(path):
            if mark(rows, note) in but:
                continue
            real = "set" in note
            least = LEARNS_FROM if real else ASKS_FROM[kind]
            wanted = rows[rows[:, 0] == CLASSES.index(kind)]
            for seen in (picture,) if real else (picture, through_lens(picture, rng, share=1.0)):
                found = detector.detect(seen, closer=note["camera"] == FRONT.id)
                asked = [each.box_px for each in found if each.kind == kind and each.score >= least]
                boxes = np.concatenate([np.array(asked, np.float32).reshape(-1, 4), drawn(wanted, rng)])
                parts.append(cropped(seen, boxes, wanted, real=real))
    return joined(parts)


def mark(rows: FloatArray, note: Mapping[str, str | float]) -> bytes:
    """What tells a picture of a shard from every other: its labels and its note."""
    return rows.tobytes() + repr(sorted(note.items())).encode()


def drawn(rows: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Boxes (M, 4) about each thing that counts, off as a detector's might be."""
    boxes = np.repeat(_counted(rows)[0], DRAWN, axis=0)
    sizes = np.tile(boxes[:, 2:] - boxes[:, :2], 2)
    moved = boxes + sizes * rng.normal(0, DRAWN_SPREAD, boxes.shape).astype(np.float32)
    kept: FloatArray = moved[((moved[:, 2:] - moved[:, :2]) >= 3.0).all(axis=1)]
    return kept


def cropped(picture: Picture, boxes: FloatArray, rows: FloatArray, *, real: bool = False) -> Crops:
    """What each box (N, 4) shows, and what is there by the picture's labels of the class, rows as `Frames` has them."""
    things, ignored = _counted(rows)
    overlap = overlaps(boxes, things)
    best = overlap.max(axis=1, initial=0.0)
    theirs = np.zeros_like(boxes)
    if len(things):
        theirs[best >= KNOWN] = things[overlap.argmax(axis=1)][best >= KNOWN]
    kinds = np.where(best >= THERE, 1, np.where(best < ABSENT, 0, -1))
    kinds[(best < THERE) & (inside(boxes, ignored).max(axis=1, initial=0.0) >= IGNORED_SHARE)] = -1
    room = windows(boxes) * np.array([1.0, 1.0, ROOM], np.float32)
    return Crops(cut(picture, room, CROP_PX), boxes, theirs, kinds, np.full(len(boxes), real))


def _counted(rows: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Boxes of what is to be found, and of what counts neither way."""
    wanted = counted(rows, TRAIN_HEIGHT_PX)
    return rows[wanted, 1:5], rows[~wanted, 1:5]


def batches(crops: Crops, count: int, seed: int) -> Iterator[Batch]:
    """Endless batches, the same for the same seed; half of each shows things of the class."""
    rng = np.random.default_rng([seed, 89])
    things = crops.kinds == 1
    others = (crops.kinds == 0) | ((crops.kinds < 0) & (crops.things[:, 2] > 0))
    while True:
        halves = [_some(crops, things, count // 2, rng), _some(crops, others, count - count // 2, rng)]
        yield _met(crops, np.concatenate(halves), rng)


def _some(crops: Crops, which: NDArray[np.bool_], count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Indices (count) of some of them; `REAL_SHARE` of them from photographs where both worlds have some."""
    real, drawn_ones = np.flatnonzero(which & crops.real), np.flatnonzero(which & ~crops.real)
    if not len(real) or not len(drawn_ones):
        return rng.choice(np.flatnonzero(which), count)
    some = round(REAL_SHARE * count)
    return np.concatenate([rng.choice(real, some), rng.choice(drawn_ones, count - some)])


def _met(crops: Crops, some: NDArray[np.int64], rng: np.random.Generator) -> Batch:
    """Moved and scaled, as if the box had been another one of the same shape; what is there is judged anew."""
    asked, things = crops.boxes[some], crops.things[some]
    squares = windows(asked)
    scale = np.exp(rng.uniform(math.log(SCALES[0]), math.log(SCALES[1]), (len(some), 1)))
    shift = rng.uniform(-SHIFT, SHIFT, (len(some), 2))
    middle, side = squares[:, :2] + shift * squares[:, 2:], squares[:, 2:] * scale
    half = (asked[:, 2:] - asked[:, :2]) / 2 * scale
    overlap = overlaps(np.concatenate([middle - half, middle + half], axis=1), things).diagonal()
    kinds = crops.kinds[some].copy()
    kinds[(kinds == 1) & (overlap < THERE)] = -1
    return Batch(
        pictures=crops.pictures[some],
        looks=np.concatenate([shift, scale], axis=1).astype(np.float32),
        sizes=shapes(asked),
        kinds=kinds.astype(np.float32),
        known=(things[:, 2] > 0) & (overlap >= KNOWN),
        sides=((things - np.tile(middle, 2)) / side).astype(np.float32),
    )

"""Batches for the detector: scaled and shifted crops with changed light, made on a thread beside the training."""

from __future__ import annotations

import queue
import threading
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from services.perception.detect.centre_point import BESIDE_PX, CLOSER_PX
from training.dataset.shards import CLASSES, WINDOW, Frames, counted
from training.detector.targets import Targets, encode
from training.lens import through_lens


class Crops(NamedTuple):
    """The pictures of a batch: height and width in px, how many there are, and how much they may be enlarged."""

    height: int
    width: int
    pictures: int
    scales: tuple[float, float]


SCALES = (0.7, 1.5)
CROPS = (
    Crops(288, 448, 12, SCALES),
    Crops(*BESIDE_PX, 11, (0.7, 0.85)),
    Crops(384, 640, 6, SCALES),
    Crops(*CLOSER_PX, 4, (2.0, 2.4)),
    Crops(*CLOSER_PX, 4, (2.0, 2.4)),
)
"""One is drawn for each batch. The second is the whole picture as it is seen beside a closer look. The last two are what the closer
look shows, in which people are found or missed. A part of a picture that is as large already (`WINDOW`) is not drawn for these two."""
SOUGHT = {"vehicle": 0.2, "pedestrian": 0.25, "sign": 0.25, "panel": 0.05, "light": 0.25}
"""Shares of the classes among the crops that are drawn for one object's sake; the others come as the pictures do."""
SOUGHT_SHARE = 0.6
FITS, LEAST_SCALE = 0.8, 0.3
"""A sought object takes at most this share of a crop's sides, and is made smaller for it down to this scale: a light that fills the
picture was hardly ever seen whole."""
FIXED_FACES = (CLASSES.index("sign"), CLASSES.index("panel"))


@dataclass(frozen=True, slots=True, eq=False)
class Batch:
    """Pictures (N, 3, H, W) uint8 and their stacked targets."""

    pictures: NDArray[np.uint8]
    targets: Targets


def batches(frames: Frames, seed: int, ahead: int = 4) -> Iterator[Batch]:
    """Endless batches, the same for the same seed. The thread that makes them ends with the program."""
    ready: queue.Queue[Batch] = queue.Queue(ahead)

    def fill() -> None:
        rng = np.random.default_rng(seed)
        every = _pool(frames, range(len(frames)))
        plain = _pool(frames, [i for i, note in enumerate(frames.notes) if not note.get(WINDOW)] or range(len(frames)))
        while True:
            crops = CROPS[int(rng.integers(len(CROPS)))]
            ready.put(_batch(frames, plain if (crops.height, crops.width) == CLOSER_PX else every, crops, rng))

    threading.Thread(target=fill, name="batches", daemon=True).start()
    while True:
        yield ready.get()


class _Pool(NamedTuple):
    """Indices of frames to draw from: all, and of each class those with an object of it that counts, all where none has."""

    all: NDArray[np.int64]
    showing: tuple[NDArray[np.int64], ...]


def _pool(frames: Frames, among: Sequence[int]) -> _Pool:
    every = np.array(among, dtype=np.int64)
    kinds = [{int(kind) for kind in objects[counted(objects), 0]} for objects in (frames.objects[i] for i in every)]
    showing = (every[[kind in those for those in kinds]] for kind in range(len(CLASSES)))
    return _Pool(every, tuple(those if len(those) else every for those in showing))


def _batch(frames: Frames, pool: _Pool, crops: Crops, rng: np.random.Generator) -> Batch:
    height, width, count, scales = crops
    pictures, targets = [], []
    for _ in range(count):
        kind = int(rng.choice(len(CLASSES), p=[SOUGHT[each] for each in CLASSES]))
        sought = kind if rng.uniform() < SOUGHT_SHARE else None
        index = int(rng.choice(pool.all if sought is None else pool.showing[kind]))
        picture, objects = augmented(
            frames.pictures[index], frames.objects[index], (height, width), rng, sought, scales
        )
        pictures.append(picture)
        targets.append(encode(objects, height, width))
    stacked = Targets(*(np.stack([getattr(t, name) for t in targets]) for name in ("heat", "mask", "sides", "weight")))
    return Batch(np.stack(pictures).transpose(0, 3, 1, 2), stacked)


def augmented(
    picture: NDArray[np.uint8],
    objects: NDArray[np.float32],
    shape: tuple[int, int],
    rng: np.random.Generator,
    sought: int | None = None,
    scales: tuple[float, float] = SCALES,
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """A crop of `shape` (height, width) around some object, mostly of the sought class if one is, scaled, relit; objects follow.

    Mirrored only where no sign's or panel's face is in the picture: there are no mirrored signs.
    """
    scale = float(np.exp(rng.uniform(*np.log(scales))))
    anywhere = rng.uniform(size=2)
    box = _box(_candidates(objects, sought), rng)
    if box is not None and sought is not None and scales[0] < 1.0:
        scale = min(scale, max(LEAST_SCALE, FITS * min(shape[0] / (box[3] - box[1]), shape[1] / (box[2] - box[0]))))
    left, top = _corner(picture, box, shape, scale, anywhere, rng)
    move = np.array([[scale, 0.0, -left * scale], [0.0, scale, -top * scale]])
    between = cv2.INTER_CUBIC if scale > 1 else cv2.INTER_LINEAR
    crop = cv2.warpAffine(picture, move, (shape[1], shape[0]), flags=between).astype(np.uint8, copy=False)
    moved = _moved(objects, scale, left, top, shape)
    if rng.uniform() < 0.5 and not np.isin(moved[:, 0], FIXED_FACES).any():
        crop = crop[:, ::-1]
        moved[:, [1, 3]] = shape[1] - moved[:, [3, 1]]
    return through_lens(_relit(crop, rng), rng), moved


def _candidates(objects: NDArray[np.float32], sought: int | None) -> NDArray[np.float32]:
    fitting = objects[counted(objects) & (objects[:, 0] == sought)] if sought is not None else objects
    return fitting if len(fitting) else objects


def _box(objects: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.float32] | None:
    """The box of one of them, mostly."""
    return objects[int(rng.integers(len(objects))), 1:5] if len(objects) and rng.uniform() < 0.7 else None


def _corner(
    picture: NDArray[np.uint8],
    box: NDArray[np.float32] | None,
    shape: tuple[int, int],
    scale: float,
    anywhere: NDArray[np.float64],
    rng: np.random.Generator,
) -> tuple[float, float]:
    """Left and top of the crop: around a box, or anywhere in the picture by two shares of what is left of it."""
    high, wide = shape[0] / scale, shape[1] / scale
    room = np.maximum([picture.shape[1] - wide, picture.shape[0] - high], 0.0)
    left, top = anywhere * room
    if box is not None:
        left = (box[0] + box[2]) / 2 - rng.uniform(0.1, 0.9) * wide
        top = (box[1] + box[3]) / 2 - rng.uniform(0.1, 0.9) * high
    return float(np.clip(left, 0.0, room[0])), float(np.clip(top, 0.0, room[1]))


def _moved(
    objects: NDArray[np.float32], scale: float, left: float, top: float, shape: tuple[int, int]
) -> NDArray[np.float32]:
    moved = objects.copy()
    moved[:, [1, 3]] = (objects[:, [1, 3]] - left) * scale
    moved[:, [2, 4]] = (objects[:, [2, 4]] - top) * scale
    whole = np.maximum((moved[:, 3] - moved[:, 1]) * (moved[:, 4] - moved[:, 2]), 1e-3)
    moved[:, 1:5] = np.clip(moved[:, 1:5], 0.0, np.array([shape[1], shape[0]] * 2, dtype=np.float32))
    inside = (moved[:, 3] - moved[:, 1]) * (moved[:, 4] - moved[:, 2])
    moved[:, 5] *= inside / whole
    return moved[inside > 1.0]


def _relit(crop: NDArray[np.uint8], rng: np.random.Generator) -> NDArray[np.uint8]:
    """Gain, offset and a tint by a table per channel."""
    levels = np.arange(256, dtype=np.float32)[:, None]
    gain = np.exp(rng.normal(0, 0.2)) * np.exp(rng.normal(0, 0.06, size=3))
    curve = 255.0 * (levels / 255.0) ** np.exp(rng.normal(0, 0.15))
    table = np.clip(curve * gain + rng.normal(0, 8), 0, 255).astype(np.uint8)
    relit: NDArray[np.uint8] = cv2.LUT(np.ascontiguousarray(crop), table[None]).astype(np.uint8, copy=False)
    return relit

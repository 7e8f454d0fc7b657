"""Photographed road scenes as shards for the detector: labelled signs, and what a teacher says of vehicles, people and lights.

``python -m training photographs.shards FOLDER --teacher yolox_nano.onnx --out DIR`` writes ``DIR/train-9*.npz`` beside rendered
shards (`training.dataset.shards`) of the scenes that training has. Each scene is shown whole at the width of our cameras, and
in windows as large as the closer look shows it. What the teacher is not sure of, and what looks like a sign and is not labelled,
is ignored: neither to be found nor a mistake.
"""

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from drivemcp.paths import data
from proto.perception import ObjectClass
from services.drivelm.reading.crops import Picture
from services.perception.detect.centre_point import CLOSER_PX
from services.perception.detect.detection import Detection, FloatArray, overlaps, suppress
from services.perception.detect.detector import Detector, DetectorOptions
from services.perception.detect.loading import load_detector
from training.dataset.shards import CLASSES, Shot, coded, write_shard
from training.detector.scores import inside
from training.photographs.gtsdb import Scene, scenes
from training.sign_pictures.degrade import Chance

WHOLE_PX = 640
WINDOW_PX = (640, 384)
"""Width of a whole scene; width and height of a window of it."""
WINDOWS, PER_SHARD, FIRST = 3, 30, 900_000
SEES = 0.15
"""From which score what the teacher sees is ignored at least."""
SURE: Mapping[ObjectClass, float] = {"vehicle": 0.45, "pedestrian": 0.65, "light": 0.55}
"""From which score it is to be found: the teacher takes chevron boards and posts for people up to 0.6."""
_FAR_M = 50.0
"""The distance of things in photographs is not known."""


def rows_of(scene: Scene, picture: Picture, teacher: Detector, ours: Detector) -> NDArray[np.float32]:
    """Rows (M, 8) as `training.dataset.shards.Frames` has them; those to be ignored with a visible share of 0."""
    labelled = np.array([sign.region for sign in scene.signs], np.float32).reshape(-1, 4)
    rows = [_row("sign", box, 1.0) for box in labelled]
    for each in taught(picture, teacher):
        if each.kind in SURE:
            rows.append(_row(each.kind, np.array(each.box_px, np.float32), float(each.score >= SURE[each.kind])))
    for each in ours.detect(picture, closer=True):
        box = np.array([each.box_px], np.float32)
        if each.kind in ("sign", "panel") and not (overlaps(box, labelled) > 0.2).any():
            rows += [_row(kind, box[0], 0.0) for kind in ("sign", "panel")]
    return np.array(rows, np.float32).reshape(-1, 8)


def _row(kind: ObjectClass, box: FloatArray, visible: float) -> list[float]:
    return [float(CLASSES.index(kind)), *(float(edge) for edge in box), visible, _FAR_M, float(box[3] - box[1])]


def taught(picture: Picture, teacher: Detector) -> list[Detection]:
    """What the teacher finds in the picture and in six parts of it, which show it far things; each thing once."""
    height, width = picture.shape[:2]
    found = list(teacher.detect(picture))
    for top in (0, height // 2 - height // 10):
        for left in (0, width // 4, width // 2):
            part = np.ascontiguousarray(picture[top : top + height // 2 + height // 10, left : left + width // 2])
            found += [_moved(each, left, top) for each in teacher.detect(part) if not _cut(each, part)]
    boxes = np.array([each.box_px for each in found], np.float32).reshape(-1, 4)
    scores = np.array([each.score for each in found], np.float32)
    kept = suppress(boxes, scores, np.array([CLASSES.index(each.kind) for each in found], np.int64), 0.45)
    return [found[index] for index in kept]


def _moved(each: Detection, left: float, top: float) -> Detection:
    return Detection(
        x0_px=each.x0_px + left,
        y0_px=each.y0_px + top,
        x1_px=each.x1_px + left,
        y1_px=each.y1_px + top,
        kind=each.kind,
        score=each.score,
    )


def _cut(each: Detection, part: Picture) -> bool:
    """Whether the part's edge may cut it."""
    height, width = part.shape[:2]
    return each.x0_px < 4 or each.y0_px < 4 or each.x1_px > width - 4 or each.y1_px > height - 4


def shots_of(scene: Scene, teacher: Detector, ours: Detector, chance: Chance) -> Iterator[Shot]:
    """The scene whole, and windows of it, mostly about a labelled sign."""
    picture = scene.picture()
    rows = rows_of(scene, picture, teacher, ours)
    yield _shown(picture, rows, WHOLE_PX / picture.shape[1], scene, chance)
    scale = CLOSER_PX[1] / picture.shape[1]
    wide, high = (round(side / scale) for side in WINDOW_PX)
    for number in range(WINDOWS):
        left, top = (int(chance.integers(0, side + 1)) for side in (picture.shape[1] - wide, picture.shape[0] - high))
        if number < len(scene.signs):
            box = scene.signs[number].region
            left = int(np.clip(box.x0_px - chance.uniform(0.1, 0.8) * wide, 0, picture.shape[1] - wide))
            top = int(np.clip(box.y0_px - chance.uniform(0.1, 0.8) * high, 0, picture.shape[0] - high))
        window = np.ascontiguousarray(picture[top : top + high, left : left + wide])
        yield _shown(window, _within(rows, left, top, wide, high), scale, scene, chance)


def _within(rows: NDArray[np.float32], left: int, top: int, wide: int, high: int) -> NDArray[np.float32]:
    window = np.array([[left, top, left + wide, top + high]], np.float32)
    share = inside(rows[:, 1:5], window)[:, 0] if len(rows) else np.zeros(0, np.float32)
    moved = rows[share > 0.02].copy()
    moved[:, 1:5] = np.clip(moved[:, 1:5] - [left, top, left, top], 0, [wide, high, wide, high])
    moved[:, 5] *= share[share > 0.02]
    return moved


def _shown(picture: Picture, rows: NDArray[np.float32], scale: float, scene: Scene, chance: Chance) -> Shot:
    size = (round(picture.shape[1] * scale), round(picture.shape[0] * scale))
    scaled = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
    moved = rows.copy()
    moved[:, 1:5] *= scale
    moved[:, 7] *= scale
    return Shot(coded(scaled, int(chance.integers(75, 96))), moved, {"camera": "front", "seed": scene.number})


def write(folder: Path, out: Path, teacher: Detector, seed: int) -> int:
    """Shards of all scenes that training has; how many pictures they hold."""
    ours, chance = load_detector(data("models/detector.onnx")), np.random.default_rng([seed, 91])
    shots: list[Shot] = []
    parts: list[Sequence[Shot]] = []
    for scene in scenes(folder):
        if not scene.held_out:
            shots += shots_of(scene, teacher, ours, chance)
    for start in range(0, len(shots), PER_SHARD * (1 + WINDOWS)):
        parts.append(shots[start : start + PER_SHARD * (1 + WINDOWS)])
        write_shard(out / f"train-{FIRST + len(parts):06d}.npz", list(parts[-1]))
    return len(shots)


def main() -> int:
    """Write the shards."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--teacher", type=Path, required=True, help="a COCO-style detector")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    cv2.setNumThreads(1)
    options.out.mkdir(parents=True, exist_ok=True)
    teacher = load_detector(options.teacher, DetectorOptions(score_floor=SEES))
    sys.stderr.write(f"{write(options.folder, options.out, teacher, options.seed)} pictures\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

"""Photographs as shards for the detector: labelled signs and lights, and what a teacher says of vehicles, people and lights.

``python -m training photographs.shards FOLDER --teacher yolox_nano.onnx --out DIR`` writes ``DIR/train-9*.npz`` beside rendered
shards (`training.dataset.shards`) of the photographs that training has, and with ``--held-out`` ``DIR/test-9*.npz`` of those that
it leaves out. Each scene is shown whole at the width of our cameras, and in windows as large as the closer look shows it, some
with photographed signs pasted in. What the teacher is not sure of, and what looks like a sign and is not labelled, is ignored:
neither to be found nor a mistake.
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
from services.drivelm.reading.crops import Picture, Region
from services.perception.detect.centre_point import CLOSER_PX
from services.perception.detect.detection import Detection, FloatArray, overlaps, suppress
from services.perception.detect.detector import Detector, DetectorOptions
from services.perception.detect.loading import load_detector
from training.dataset.shards import CLASSES, WINDOW, Shot, coded, inside, write_shard
from training.photographs.gtsrb import ZIP, RealSign, signs
from training.photographs.labelled import Photograph, photographs
from training.photographs.pasting import pasted
from training.photographs.sets import SETS, present
from training.sign_pictures.degrade import Chance

WHOLE_PX = 640
WINDOW_PX = (640, 384)
"""Width of a whole scene; width and height of a window of it."""
WINDOWS, PASTED, MOST_PASTED, PER_SHARD, FIRST = 3, 2, 4, 120, 900_000
"""Of each scene: windows, windows with pasted signs, and how many signs those have at most; pictures in a file, and its number."""
SEES = 0.15
"""From which score what the teacher sees is ignored at least."""
SURE: Mapping[ObjectClass, float] = {"vehicle": 0.45, "pedestrian": 0.65, "light": 0.55}
"""From which score it is to be found: the teacher takes chevron boards and posts for people up to 0.6."""
DOUBTED, BEACON = 0.12, 0.2
"""Stripes from which a person of the teacher's is doubted, and from which it is a beacon at a road works: a mistake to find."""
_FAR_M = 50.0
"""The distance of things in photographs is not known."""
Rows = NDArray[np.float32]


def rows_of(photograph: Photograph, teacher: Detector, ours: Detector) -> Rows:
    """Rows (M, 8) as `training.dataset.shards.Frames` has them; those to be ignored with a visible share of 0."""
    picture = photograph.picture
    rows = [_row(kind, np.array(box), 1.0) for kind, boxes in photograph.boxes.items() for box in boxes]
    for kind in ("sign", "panel"):
        if "sign" not in photograph.whole:  # whatever is not labelled may be one
            rows.append(_row(kind, np.array([0, 0, picture.shape[1], picture.shape[0]]), 0.0))
    for each in taught(picture, teacher):
        known = each.kind in photograph.whole or _on(each, photograph.boxes.get(each.kind, ()))
        striped = stripes(picture, each) if each.kind == "pedestrian" else 0.0
        if each.kind in SURE and not known and striped < BEACON:
            sure = each.score >= SURE[each.kind] and striped < DOUBTED
            rows.append(_row(each.kind, np.array(each.box_px), float(sure)))
    for each in ours.detect(picture, closer=True):
        if each.kind in ("sign", "panel") and not _on(each, photograph.boxes.get("sign", ())):
            rows += [_row(kind, np.array(each.box_px), 0.0) for kind in ("sign", "panel")]
    return np.array(rows, np.float32).reshape(-1, 8)


def stripes(picture: Picture, each: Detection) -> float:
    """How much the middle of the box is of red and of white that take turns from top to bottom, 0 to 1: the smaller share."""
    x0, y0, x1, y1 = (max(0, round(edge)) for edge in each.box_px)
    fifth = (x1 - x0) // 5
    inner = picture[y0:y1, x0 + fifth : max(x1 - fifth, x0 + fifth + 1)].astype(np.float32)
    if not inner.size:
        return 0.0
    red, green, blue = np.moveaxis(inner, 2, 0)
    light = inner.mean(axis=2)
    reds = (red - np.maximum(green, blue)) / (red + 1) > 0.25
    white = (abs(red - blue) < 0.2 * (red + 1)) & (abs(red - green) < 0.15 * (red + 1)) & (light >= np.median(light))
    turns = np.abs(np.diff((reds.mean(axis=1) > 0.35).astype(int))).sum()
    return float(min(reds.mean(), white.mean())) if turns >= 2 else 0.0


def is_upside_down(picture: Picture, teacher: Detector) -> bool:
    """Whether the teacher sees clearly more vehicles and people in the picture turned over."""
    told = [
        sum(each.score for each in teacher.detect(way) if each.kind in ("vehicle", "pedestrian"))
        for way in (picture, np.ascontiguousarray(picture[::-1]))
    ]
    return told[1] > told[0] + 0.3


def _on(each: Detection, labelled: Sequence[Region]) -> bool:
    boxes = np.array(labelled, np.float32).reshape(-1, 4)
    return bool((overlaps(np.array([each.box_px], np.float32), boxes) > 0.2).any())


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


def shots_of(
    photograph: Photograph, rows: Rows, crops: Sequence[RealSign], windows: int, chance: Chance
) -> Iterator[Shot]:
    """The picture whole, and of a large one windows, mostly about a labelled sign, some with pasted ones."""
    picture, signed = photograph.picture, photograph.boxes.get("sign", ())
    note: dict[str, str | float] = {"camera": "front", "set": photograph.set}
    yield _shown(picture, rows, min(1.0, WHOLE_PX / max(picture.shape[:2])), note, chance)
    scale = CLOSER_PX[1] / picture.shape[1]
    wide, high = (round(side / scale) for side in WINDOW_PX)
    if picture.shape[0] < high or picture.shape[1] < 2 * WHOLE_PX:
        return
    note[WINDOW] = 1.0
    for number in range(windows):
        left, top = (int(chance.integers(0, side + 1)) for side in (picture.shape[1] - wide, picture.shape[0] - high))
        if number < min(len(signed), WINDOWS):
            box = signed[number]
            left = int(np.clip(box.x0_px - chance.uniform(0.1, 0.8) * wide, 0, picture.shape[1] - wide))
            top = int(np.clip(box.y0_px - chance.uniform(0.1, 0.8) * high, 0, picture.shape[0] - high))
        window = np.ascontiguousarray(picture[top : top + high, left : left + wide])
        shown = _within(rows, left, top, wide, high)
        if crops and number >= WINDOWS:
            window, shown = _with_pasted(window, shown, crops, chance)
            note = note | {"set": f"{photograph.set},gtsrb"}
        yield _shown(window, shown, scale, note, chance)


def _with_pasted(window: Picture, rows: Rows, crops: Sequence[RealSign], chance: Chance) -> tuple[Picture, Rows]:
    """Signs pasted where no thing of the window stands; small ignored ones and what fills the window count as no thing."""
    taken = [Region(*row[1:5]) for row in rows if row[3] - row[1] < 0.9 * window.shape[1]]
    out, put = pasted(window, crops, taken, chance, int(chance.integers(1, MOST_PASTED + 1)))
    more = np.array([_row("sign", np.array(box), 1.0) for box in put], np.float32).reshape(-1, 8)
    return out, np.concatenate([rows, more])


def _within(rows: Rows, left: int, top: int, wide: int, high: int) -> Rows:
    window = np.array([[left, top, left + wide, top + high]], np.float32)
    share = inside(rows[:, 1:5], window)[:, 0] if len(rows) else np.zeros(0, np.float32)
    moved = rows[share > 0.02].copy()
    moved[:, 1:5] = np.clip(moved[:, 1:5] - [left, top, left, top], 0, [wide, high, wide, high])
    moved[:, 5] *= share[share > 0.02]
    return moved


def _shown(picture: Picture, rows: Rows, scale: float, note: Mapping[str, str | float], chance: Chance) -> Shot:
    size = (round(picture.shape[1] * scale), round(picture.shape[0] * scale))
    scaled = np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
    moved = rows.copy()
    moved[:, 1:5] *= scale
    moved[:, 7] *= scale
    return Shot(coded(scaled, int(chance.integers(75, 96))), moved, dict(note))


def write(
    folder: Path, out: Path, teacher: Detector, seed: int, *, held_out: bool = False, without: Sequence[str] = ()
) -> int:
    """Shards of all photographs that training has, or of those that it leaves out; how many pictures they hold."""
    ours, chance = load_detector(data("models/detector.onnx")), np.random.default_rng([seed, 91, int(held_out)])
    has_crops = not held_out and "gtsrb" in {each.name for each in present(folder, without)}
    crops = [each for each in signs(folder)[ZIP] if not each.held_out] if has_crops else []
    shots: list[Shot] = []
    for photograph in photographs(folder, held_out=held_out, without=without):
        if is_upside_down(photograph.picture, teacher):
            continue
        rows = rows_of(photograph, teacher, ours)
        shots += shots_of(photograph, rows, crops, 0 if held_out else WINDOWS + PASTED, chance)
    split = "test" if held_out else "train"
    for number, start in enumerate(range(0, len(shots), PER_SHARD)):
        write_shard(out / f"{split}-{FIRST + number:06d}.npz", shots[start : start + PER_SHARD])
    return len(shots)


def main() -> int:
    """Write the shards."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--teacher", type=Path, required=True, help="a COCO-style detector")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--held-out", action="store_true", help="the photographs that training leaves out")
    parser.add_argument("--without", nargs="*", default=(), choices=[each.name for each in SETS], metavar="SET")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    options.out.mkdir(parents=True, exist_ok=True)
    teacher = load_detector(options.teacher, DetectorOptions(score_floor=SEES))
    written = write(
        options.folder, options.out, teacher, options.seed, held_out=options.held_out, without=options.without
    )
    sys.stderr.write(f"{written} pictures\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())

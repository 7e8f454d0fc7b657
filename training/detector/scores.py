"""Average precision of a detector on labelled frames, and the score floors that suit it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from proto.perception import ObjectClass
from services.perception.detect.detection import Detection, overlaps
from services.perception.detect.detector import Detector
from services.simulator.scene.scene import FRONT
from training.dataset.shards import CLASSES, Frames, counted, inside

OVERLAP = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Tally:
    """Of one class: scores of the detections that count, whether each is right, and how many objects there are."""

    scores: NDArray[np.float64]
    right: NDArray[np.bool_]
    objects: int


def average_precision(tally: Tally) -> float:
    """Area under the precision-recall curve, precision made non-increasing (all-point form)."""
    if not tally.objects:
        return float("nan")
    order = np.argsort(-tally.scores, kind="stable")
    right = np.cumsum(tally.right[order])
    recall = np.concatenate([[0.0], right / tally.objects])
    precision = np.concatenate([right / np.arange(1, len(right) + 1), [0.0]])
    envelope = np.maximum.accumulate(precision[::-1])[::-1][:-1] if len(right) else np.zeros(0)
    return float((np.diff(recall) * envelope).sum())


def best_floor(tally: Tally) -> float:
    """The score above which the harmonic mean of precision and recall is largest, 0.15 to 0.6."""
    order = np.argsort(-tally.scores, kind="stable")
    right = np.cumsum(tally.right[order])
    if not len(right) or not right[-1]:
        return 0.3
    precision, recall = right / np.arange(1, len(right) + 1), right / tally.objects
    mean = 2.0 * precision * recall / np.maximum(precision + recall, 1e-9)
    return float(np.clip(tally.scores[order][mean.argmax()], 0.15, 0.6))


def run(detector: Detector, frames: Frames) -> list[list[Detection]]:
    """Detections in every frame; those of the front camera are looked at closer, as in the car."""
    return [
        detector.detect(picture, closer=note["camera"] == FRONT.id)
        for picture, note in zip(frames.pictures, frames.notes, strict=True)
    ]


def tally(found: Sequence[Sequence[Detection]], frames: Frames, kind: ObjectClass, overlap: float = OVERLAP) -> Tally:
    """Matches by IoU of at least `overlap`, best score first, each object once. Detections on ignored objects do not count at all."""
    scores: list[float] = []
    right: list[bool] = []
    objects = 0
    for detections, rows in zip(found, frames.objects, strict=True):
        mine = rows[rows[:, 0] == CLASSES.index(kind)]
        wanted = counted(mine)
        objects += int(wanted.sum())
        for score, verdict in _judge([each for each in detections if each.kind == kind], mine[:, 1:5], wanted, overlap):
            scores.append(score)
            right.append(verdict)
    return Tally(np.array(scores, dtype=np.float64), np.array(right, dtype=bool), objects)


def _judge(
    detections: Sequence[Detection], boxes: NDArray[np.float32], wanted: NDArray[np.bool_], least: float
) -> list[tuple[float, bool]]:
    taken: set[int] = set()
    verdicts = []
    for each in sorted(detections, key=lambda detection: -detection.score):
        box = np.array([each.box_px], dtype=np.float32)
        overlap = overlaps(box, boxes)[0] if len(boxes) else np.zeros(0, np.float32)
        free = [k for k in np.flatnonzero(wanted & (overlap >= least)).tolist() if k not in taken]
        if free:
            taken.add(max(free, key=lambda k: float(overlap[k])))
            verdicts.append((each.score, True))
        elif not _on_ignored(box[0], boxes[~wanted], overlap[~wanted]):
            verdicts.append((each.score, False))
    return verdicts


def _on_ignored(box: NDArray[np.float32], ignored: NDArray[np.float32], overlap: NDArray[np.float32]) -> bool:
    """Whether it overlaps an ignored object by half, or lies mostly inside one."""
    return bool((overlap >= OVERLAP).any() or (inside(box[None], ignored) >= 0.7).any())

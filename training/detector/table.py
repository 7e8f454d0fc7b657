"""Measures a detector on held-out frames by weather, distance and size: the tables of docs/results/measured/perception.md.

`python -m training detector.table --cache DIR [--model FILE]` needs the split "test" of the dataset.
Objects under 12 px high or less than half visible are ignored; IoU 0.5. Of photographs (`photographs.shards --held-out`) no
weather and no distance is known.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from drivemcp.paths import data
from proto.perception import ObjectClass
from services.perception.detect.detection import Detection, FloatArray, overlaps
from services.perception.detect.detector import DetectorOptions
from services.perception.detect.loading import load_detector
from training.dataset.shards import CLASSES, Frames, counted, load_frames
from training.detector.probabilities import calibrated
from training.detector.scores import OVERLAP, average_precision, run, tally

Note = dict[str, str | float]
NEAR_M = 40.0
LOWEST_SCORE = 0.02


def _clear(note: Note) -> bool:
    return (
        "night" in note and not note["night"] and not float(note["rain_mm_h"]) and float(note["visibility_m"]) > 1500.0
    )


GROUPS: tuple[tuple[str, Callable[[Note], bool]], ...] = (
    ("all", lambda note: True),
    ("clear", _clear),
    ("low sun", lambda note: _clear(note) and float(note.get("sun_deg", 90.0)) < 12.0),
    ("rain", lambda note: float(note.get("rain_mm_h", 0.0)) > 0.0),
    ("fog", lambda note: float(note.get("visibility_m", math.inf)) < 250.0),
    ("night", lambda note: bool(note.get("night"))),
    ("front camera", lambda note: note["camera"] == "front"),
    ("long camera", lambda note: note["camera"] != "front"),
)


def picked(frames: Frames, wanted: Callable[[Note], bool]) -> list[int]:
    """Indices of the frames whose note is wanted."""
    return [index for index, note in enumerate(frames.notes) if wanted(note)]


def precision_row(found: list[list[Detection]], frames: Frames, indices: list[int]) -> dict[str, tuple[float, int]]:
    """AP50 and the number of objects of each class, on some frames."""
    part = frames.picked(indices)
    of_part = [found[i] for i in indices]
    tallies = {kind: tally(of_part, part, kind) for kind in CLASSES}
    return {kind: (average_precision(each), each.objects) for kind, each in tallies.items()}


def recall_near(
    found: list[list[Detection]], frames: Frames, indices: list[int], kind: ObjectClass, floor: float
) -> tuple[float, int]:
    """Share of the objects nearer than `NEAR_M` that have a box at or above the floor, and their number."""
    hits = [hit for index in indices for hit in _hits(found[index], frames.objects[index], kind, floor)]
    return (sum(hits) / len(hits) if hits else float("nan")), len(hits)


def _hits(found: list[Detection], rows: FloatArray, kind: ObjectClass, floor: float) -> list[bool]:
    wanted = rows[counted(rows) & (rows[:, 0] == CLASSES.index(kind)) & (rows[:, 6] < NEAR_M)][:, 1:5]
    boxes = [d.box_px for d in found if d.kind == kind and d.score >= floor]
    if not boxes:
        return [False] * len(wanted)
    best = overlaps(wanted, np.array(boxes, np.float32)).max(axis=1, initial=0.0)
    return [bool(each) for each in best >= OVERLAP]


def probable_floors(card: dict[str, Any]) -> dict[str, float]:
    """The card's floors, which are of raw scores, as the probabilities that the detector tells."""
    return {
        kind: round(float(calibrated(np.array([floor]), card["calibration"][kind])[0]), 3)
        for kind, floor in card["floors"].items()
    }


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(prog="python -m training detector.table", description=__doc__)
    parser.add_argument("--cache", type=Path, required=True, help="folder of shards with the split test")
    parser.add_argument("--model", type=Path, default=data("models/detector.onnx"))
    flags = parser.parse_args()
    frames = load_frames(flags.cache, "test")
    floors = probable_floors(json.loads(flags.model.with_suffix(".json").read_text(encoding="utf-8")))
    lowest = dict.fromkeys(CLASSES, LOWEST_SCORE)
    found = run(load_detector(flags.model, DetectorOptions(score_floor=LOWEST_SCORE, floors=lowest)), frames)
    out = sys.stdout
    out.write(f"AP50 (objects)  | frames | {' | '.join(CLASSES)}\n")
    groups = [(name, indices) for name, wanted in GROUPS if (indices := picked(frames, wanted))]
    for name, indices in groups:
        row = precision_row(found, frames, indices)
        cells = " | ".join(f"{row[kind][0]:.2f} ({row[kind][1]})" for kind in CLASSES)
        out.write(f"| {name} | {len(indices)} | {cells} |\n")
    out.write(f"recall nearer than {NEAR_M:.0f} m at the floors {floors}\n")
    for name, indices in groups:
        near = [recall_near(found, frames, indices, kind, floors[kind]) for kind in ("vehicle", "pedestrian")]
        out.write(f"| {name} | {' | '.join(f'{share:.3f} ({count})' for share, count in near)} |\n")


if __name__ == "__main__":
    main()

"""How well whole approaches are read: drawn signs that grow frame by frame, fused as on the road.

Target: of limit signs whose disc reaches 20 px, 95 % believed right before they are passed, at most 0.2 % ever believed wrong.
``python -m training reader.tracks`` prints the table for ``models/reader.onnx`` on letterings and backgrounds
that training never saw; drawn degradations, not camera pictures.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from drivemcp.paths import data
from services.drivelm.reading.crops import Region
from services.drivelm.reading.reader import Reader
from services.drivelm.reading.sign_tracks import SignTrack
from services.drivelm.vocabulary.classes import BOARD_VALUES, LED_VALUES, LIMIT_VALUES
from training.reader.samples import Source
from training.sign_pictures.degrade import Chance, any_conditions, seen_crop

FOCAL_TELE_PX, FRAMES_PER_S = 1443.0, 5.0
_SEEN_FROM_M, _LEAVES_AT_M = 75.0, 16.0


class Approach(NamedTuple):
    """One sign driven past: what it was, how large it got, and what was believed first and last."""

    label: str
    largest_px: float
    beliefs: tuple[str, ...]


def approach(label: str, source: Source, reader: Reader, chance: Chance, hard: float) -> Approach:
    """Drive past one sign at 8 to 36 m/s in constant weather, with a fresh box, noise and rain in each frame."""
    face, now, speed_mps = source.face(label, chance), any_conditions(chance, hard), float(chance.uniform(8, 36))
    size_m, kind = (1.2, "panel") if label.startswith("led:") else (0.6, "sign")
    distance_m = _SEEN_FROM_M * size_m / 0.6 - float(chance.uniform(0, 8))
    track = SignTrack.opened(("tele", 1), kind, Region(0, 0, 1, 1), 0)
    beliefs, size_px = [], 0.0
    while distance_m > _LEAVES_AT_M:
        size_px = FOCAL_TELE_PX * size_m / distance_m
        crop = seen_crop(source.view_of(label, size_px, now, chance, face), chance)
        reading = reader.read(crop[None], (kind,))[0]
        track = track.read(reading.ranked, Region(0, 0, size_px, size_px), 0)
        best = track.belief()
        if track.believed(best):
            beliefs.append(best.reading)
        distance_m -= speed_mps / FRAMES_PER_S
    return Approach(label, size_px, tuple(beliefs))


def track_table(reader: Reader, source: Source, count: int, seed: int) -> dict[str, Any]:
    """Shares over ``count`` approaches of limit signs, and of gantry panels, in fine and in mixed weather."""
    table: dict[str, Any] = {"approaches_each": count, "frames_per_s": FRAMES_PER_S}
    groups = {
        "limit": [f"limit:{v}" for v in LIMIT_VALUES],
        "limit_board": [f"limit_board:{v}" for v in BOARD_VALUES],
        "led": [f"led:{v}" for v in LED_VALUES],
    }
    everything: list[Approach] = []
    for group, labels in groups.items():
        for weather, hard in (("fine", 0.0), ("mixed", 1.0)):
            chance = np.random.default_rng([seed, 9, len(group), int(hard)])
            driven = [approach(labels[i % len(labels)], source, reader, chance, hard) for i in range(count)]
            legible = [one for one in driven if one.largest_px >= 20]
            table[f"{group}, {weather}"] = _row(legible)
            everything += legible
    return table | {"together": {"approaches": len(everything), **_row(everything)}}


def _row(driven: list[Approach]) -> dict[str, float]:
    last_right = [bool(one.beliefs) and one.beliefs[-1] == one.label for one in driven]
    ever_wrong = [any(belief != one.label for belief in one.beliefs) for one in driven]
    higher = [any(_value(belief) > _value(one.label) for belief in one.beliefs) for one in driven]
    shares = {"believed_right": last_right, "ever_believed_wrong": ever_wrong, "ever_believed_higher": higher}
    return {name: round(float(np.mean(flags)), 4) for name, flags in shares.items()}


def _value(reading: str) -> int:
    tail = reading.rpartition(":")[2]
    return int(tail) if tail.isdigit() else 0


def main() -> int:
    """Print the table as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", type=Path, default=None)
    parser.add_argument("--count", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--fonts", type=Path, nargs="*", default=[Path("/usr/share/fonts")])
    parser.add_argument("--write", action="store_true", help="keep the table in the model's card too")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    path = options.model or data("models/reader.onnx")
    source = Source("test", options.seed, tuple(options.fonts), each=10)
    measured = track_table(Reader.load(path), source, options.count, options.seed)
    json.dump(measured, sys.stdout, indent=1)
    if options.write:
        keep(path.with_suffix(".json"), measured, "tracks")
    return 0


def keep(card_file: Path, measured: dict[str, Any], *names: str) -> None:
    """Put what was measured into a model's card, in place of what stood there under these names, each within the one before."""
    card = place = json.loads(card_file.read_text(encoding="utf-8"))
    for name in names[:-1]:
        place = place.setdefault(name, {})
    place[names[-1]] = measured
    card_file.write_text(json.dumps(card, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())

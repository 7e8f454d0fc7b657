"""How signs are believed on rendered drives: tele pictures, exact boxes made sloppy, the whole front end.

``python -m training reader.drives`` drives a rendered avenue of the split ``test`` and prints a table as JSON.
It measures reading and fusion alone; finding the signs is the detector's part and has its own scores.
Target: of limit signs whose unoccluded disc reaches 20 px, 95 % believed right before they are passed, at most 1 %
believed wrong.
"""

import argparse
import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np

from drivemcp.paths import data
from proto.perception import Box
from proto.scene import Fact
from proto.sensors import Calibration
from services.drivelm.backends.backend import EmbeddedBackend
from services.drivelm.front_end import FrontEnd, Sighting
from services.drivelm.reading.crops import Region
from services.drivelm.reading.facts import public_code
from services.drivelm.reading.reader import Reader
from services.drivelm.vocabulary.classes import LIGHTS, LIMIT_VALUES, PANELS, SIGNS
from services.simulator.scene.scene import FRONT, TELE, CameraSpec
from training.labelling import Label, LabellingRenderer
from training.reader.tracks import keep
from training.sign_pictures.avenue import SPACING_M, Avenue, Frame, any_atmosphere, avenue, class_of, frame_at
from training.sign_pictures.degrade import jittered

_NS = 1_000_000_000
RATES_HZ = {"tele": 5.0, "front": 10.0}
_LIMITS = tuple(f"limit:{value}" for value in LIMIT_VALUES)
_ONE_STYLE = tuple(label for label in SIGNS if not label.startswith(("limit_board", "school", "info:interstate")))
"""Boards of the United States among the rings of all others would tell of a country that posts neither."""


class Passed(NamedTuple):
    """One sign of the drive: what it was, its largest unoccluded height, and all that was believed of it."""

    label: str
    largest_px: float
    beliefs: tuple[str, ...]
    plate: str
    scopes: tuple[str, ...]


def drive(
    reader: Reader, posts: int, seed: int, limits_only: bool, camera: CameraSpec = TELE
) -> tuple[list[Passed], float]:
    """Drive past ``posts`` signs in changing weather at 8 to 36 m/s; also the mean time of one picture in ms."""
    chance = np.random.default_rng([seed, 61])
    world = avenue(posts, "test", seed + 500, _LIMITS if limits_only else (), _ONE_STYLE)
    renderer, end = LabellingRenderer(world.static), FrontEnd(EmbeddedBackend(reader), home="")
    log, spent_s, pictures = _Log(), 0.0, 0
    for stamp_ns, frame, speed_mps in _frames(renderer, world, camera, chance):
        boxes = log.boxes(frame, chance)
        sighting = Sighting(
            camera=camera.id,
            stamp_ns=stamp_ns,
            boxes=boxes,
            open_picture=lambda frame=frame: frame.picture,  # type: ignore[misc]
            calibration=_calibration(camera),
        )
        started = time.perf_counter()
        facts = [*end.see(sighting), *end.settle(stamp_ns, speed_mps)]
        spent_s, pictures = spent_s + time.perf_counter() - started, pictures + 1
        log.note(facts)
    renderer.close()
    return log.passed(), 1e3 * spent_s / max(1, pictures)


def _frames(
    renderer: LabellingRenderer, world: Avenue, camera: CameraSpec, chance: np.random.Generator
) -> Iterator[tuple[int, Frame, float]]:
    x_m, stamp_ns, speed_mps, sky = 0.0, _NS, 20.0, any_atmosphere(chance, "test")
    next_change_m = 0.0
    while x_m < world.length_m:
        if x_m >= next_change_m:
            sky, speed_mps = any_atmosphere(chance, "test"), float(chance.uniform(8, 36))
            next_change_m += 4 * SPACING_M
        yield stamp_ns, frame_at(renderer, world.static, x_m, camera, sky, chance), speed_mps
        x_m += speed_mps / RATES_HZ[camera.id]
        stamp_ns += round(_NS / RATES_HZ[camera.id])


class _Log:
    """Keeps what was true and what was believed, by track."""

    def __init__(self) -> None:
        self._ids: dict[tuple[int, int], int] = {}
        self._labels: dict[int, str] = {}
        self._largest: dict[int, float] = {}
        self._beliefs: dict[int, list[str]] = {}
        self._scopes: dict[int, list[str]] = {}
        self._plates: dict[int, str] = {}

    def boxes(self, frame: Frame, chance: np.random.Generator) -> tuple[Box, ...]:
        """Boxes of what is mostly visible, off by a few percent, with a track id for each face."""
        found = []
        for label in frame.labels:
            name = class_of(label)
            if name is None or label.visible_fraction < 0.6 or label.kind == "vehicle":
                continue
            track = self._track(label, name, frame.labels)
            if label.visible_fraction > 0.95:
                self._largest[track] = max(self._largest.get(track, 0.0), label.disc_px or region_height(label))
            region = jittered(Region(*label.full_box_px), chance, 0.05)
            found.append(Box(x0_px=region.x0_px, y0_px=region.y0_px, x1_px=region.x1_px, y1_px=region.y1_px,
                             kind=label.kind, score=0.9, track_id=track))  # fmt: skip
        return tuple(found)

    def _track(self, label: Label, name: str, labels: tuple[Label, ...]) -> int:
        track = self._ids.setdefault((label.id, label.part), len(self._ids) + 1)
        self._labels[track] = name
        hung = next((other for other in labels if other.id == label.id and other.part == label.part + 1), None)
        if label.kind == "sign" and hung is not None:
            self._plates[track] = class_of(hung) or ""
        return track

    def note(self, facts: list[Fact]) -> None:
        """Remember what was believed."""
        for fact in facts:
            if fact.believed and fact.track_id:
                self._beliefs.setdefault(fact.track_id, []).append(fact.reading)
                self._scopes.setdefault(fact.track_id, []).append(fact.scope)

    def passed(self) -> list[Passed]:
        """Everything that was seen."""
        return [
            Passed(name, self._largest.get(track, 0.0), tuple(self._beliefs.get(track, ())), self._plates.get(track, ""),
                   tuple(self._scopes.get(track, ())))
            for track, name in self._labels.items()
        ]  # fmt: skip


def region_height(label: Label) -> float:
    """Height of the whole object in pixels."""
    return label.full_box_px[3] - label.full_box_px[1]


def _calibration(camera: CameraSpec) -> Calibration:
    focal = camera.focal_px
    return Calibration(fx_px=focal, fy_px=focal, cx_px=camera.width_px / 2, cy_px=camera.height_px / 2,
                       width_px=camera.width_px, height_px=camera.height_px)  # fmt: skip


def table(signs: list[Passed]) -> dict[str, Any]:
    """Shares believed right at the last, ever believed wrong, ever believed higher; and of scopes by plate."""
    rows: dict[str, Any] = {}
    for group, labels in (("limit", _LIMITS), ("signs", SIGNS), ("led", PANELS), ("light", LIGHTS)):
        part = [one for one in signs if one.largest_px >= 20 and one.label in labels]
        rows[group] = _row(part)
    wet = [
        one for one in signs if one.plate.startswith("plate:when_wet") and one.label in _LIMITS and one.largest_px >= 20
    ]
    bare = [one for one in signs if not one.plate and one.label in _LIMITS and one.beliefs]
    rows["limits with a when-wet plate"] = {
        "count": len(wet),
        "scope_right": _share([s.scopes[-1:] == ("when_wet",) for s in wet]),
    }
    rows["limits without a plate"] = {"count": len(bare), "scope_wrong": _share(["when_wet" in s.scopes for s in bare])}
    return rows


def _row(part: list[Passed]) -> dict[str, Any]:
    public = [public_code(one.label) for one in part]
    pairs = list(zip(part, public, strict=True))
    return {
        "count": len(part),
        "believed_right": _share([one.beliefs[-1:] == (name,) for one, name in pairs]),
        "ever_believed_wrong": _share([any(said != name for said in one.beliefs) for one, name in pairs]),
        "mistakes": [
            f"{name} as {'/'.join(sorted(set(one.beliefs)))}"
            for one, name in pairs
            if any(b != name for b in one.beliefs)
        ],
    }


def _share(flags: list[bool]) -> float | None:
    return round(float(np.mean(flags)), 4) if flags else None


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--model", type=Path, default=None)
    parser.add_argument("--posts", type=int, default=150)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--camera", choices=sorted(RATES_HZ), default="tele")
    parser.add_argument("--all-signs", action="store_true")
    parser.add_argument("--write", action="store_true", help="keep the table in the model's card too")
    options = parser.parse_args()
    cv2.setNumThreads(1)
    path = options.model or data("models/reader.onnx")
    reader = Reader.load(path)
    signs, picture_ms = drive(
        reader, options.posts, options.seed, not options.all_signs, {FRONT.id: FRONT, TELE.id: TELE}[options.camera]
    )
    measured = {
        **table(signs),
        "posts": options.posts,
        "seed": options.seed,
        "reading_ms_per_picture": round(picture_ms, 2),
    }
    json.dump(measured, sys.stdout, indent=1)
    if options.write:
        name = f"{options.camera}, {'all signs' if options.all_signs else 'limits'}, seed {options.seed}"
        keep(path.with_suffix(".json"), measured, "drives", name)
    return 0


if __name__ == "__main__":
    sys.exit(main())

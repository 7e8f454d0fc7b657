"""Perception over a kept drive: the detector once for each picture, all that follows as often as one likes."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field

from proto.perception import Tracks
from proto.truth import Truth
from services.perception.detect.detection import Detection
from services.perception.detect.detector import Detector, Picture
from services.perception.pipeline import FRONT, Perception, Seen
from services.simulator.sensors import measurements
from services.simulator.session import CAMERAS
from studies.tracking.recording import Look, Step

Found = Sequence[Sequence[Detection]]
"""What the detector found in each picture of a drive, in the order of the pictures."""


@dataclass(frozen=True, slots=True, eq=False)
class Glance:
    """A picture of any camera: what there was to be seen, what perception made of it, and how long that took it."""

    stamp_ns: int
    look: Look
    truth: Truth
    seen: Seen
    spent_s: float


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A picture of the front camera: what was tracked then, and what was so."""

    stamp_ns: int
    look: Look
    truth: Truth
    tracks: Tracks


@dataclass(slots=True)
class _Known:
    """Says of each picture in turn what was found in it before."""

    answers: Iterator[Sequence[Detection]]
    name: str = "kept"

    def detect(self, rgb: Picture, *, closer: bool = False) -> list[Detection]:
        return list(next(self.answers))


@dataclass(slots=True)
class Noting:
    """A detector that keeps what it finds in each picture."""

    detector: Detector
    found: list[list[Detection]] = field(default_factory=list)
    name: str = "noting"

    def detect(self, rgb: Picture, *, closer: bool = False) -> list[Detection]:
        """As the detector does."""
        self.found.append(self.detector.detect(rgb, closer=closer))
        return list(self.found[-1])


def glances(steps: Iterable[Step], detector: Detector) -> Iterator[Glance]:
    """Boxes, ranges, tracks and leads, as the perception service would have them."""
    perception = Perception(detector)
    for name, camera in CAMERAS.items():
        perception.calibrate(name, measurements.calibration(camera))
    for step in steps:
        yield from _take_in(perception, step)


def views(glances: Iterable[Glance]) -> list[View]:
    """Those of the front camera, which has the tracks."""
    return [
        View(each.stamp_ns, each.look, each.truth, each.seen.tracks)
        for each in glances
        if each.look.camera == FRONT and each.seen.tracks is not None
    ]


def see(steps: Iterable[Step], found: Found) -> list[View]:
    """What perception makes of boxes that were found before."""
    return views(glances(steps, _Known(iter(found))))


def _take_in(perception: Perception, step: Step) -> Iterator[Glance]:
    perception.ego(step.stamp_ns, step.ego)
    if step.sweep is not None:
        perception.sweep(step.stamp_ns, step.sweep)
    if step.map is not None:
        perception.map(step.stamp_ns, step.map)
    for look in step.looks:
        started_s = time.thread_time()
        seen = perception.see(look.camera, step.stamp_ns, look.frame)
        yield Glance(step.stamp_ns, look, step.truth, seen, time.thread_time() - started_s)

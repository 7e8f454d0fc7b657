"""Perception over a kept drive: the detector once for each picture, all that follows as often as one likes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from evaluation.tracking.recording import Look, Step
from proto.perception import Tracks
from proto.truth import Truth
from services.perception.detection import Detection
from services.perception.detector import Detector, Picture
from services.perception.pictures import open_picture
from services.perception.pipeline import FRONT, Perception
from services.simulator import sensors
from services.simulator.session import CAMERAS

Found = Sequence[Sequence[Detection]]
"""What the detector found in each picture of a drive, in the order of the pictures."""


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

    def detect(self, rgb: Picture) -> list[Detection]:
        return list(next(self.answers))


def detect(steps: Iterable[Step], detector: Detector) -> list[list[Detection]]:
    """What a detector finds in each picture."""
    return [detector.detect(open_picture(look.frame)) for step in steps for look in step.looks]


def see(steps: Iterable[Step], found: Found) -> list[View]:
    """Ranges, tracks and leads from these boxes, as the perception service would have them."""
    perception = Perception(_Known(iter(found)))
    for name, camera in CAMERAS.items():
        perception.calibrate(name, sensors.calibration(camera))
    return [view for step in steps for view in _take_in(perception, step)]


def _take_in(perception: Perception, step: Step) -> Iterator[View]:
    perception.ego(step.stamp_ns, step.ego)
    if step.sweep is not None:
        perception.sweep(step.stamp_ns, step.sweep)
    if step.map is not None:
        perception.map(step.stamp_ns, step.map)
    for look in step.looks:
        seen = perception.see(look.camera, step.stamp_ns, look.frame)
        if look.camera == FRONT and seen.tracks is not None:
            yield View(step.stamp_ns, look, step.truth, seen.tracks)

"""The frame as the stack gets it, through perception, against the labels. Nothing between player and pipeline is bypassed."""

from pathlib import Path

import msgspec
import numpy as np

from drivemcp.errors import UserError
from proto import topics
from proto.perception import Box, Boxes, Tracks
from proto.sensors import Calibration, CameraFrame, LidarSweep
from services.perception.detect.detection import overlaps
from services.perception.detect.detector import DetectorOptions
from services.perception.detect.loading import load_detector
from services.perception.pipeline import Perception
from services.perception.range.camera import Camera
from services.player.recording import Options
from services.player.street import open_street
from studies.ranging.labels import Label

SAME_OVERLAP = 0.5
START_NS = 1_000_000_000
HOLD_S = 1.0


class Ranged(msgspec.Struct, frozen=True, kw_only=True):
    """A detected object that a label belongs to. Depths in m along the camera's axis."""

    category: str
    score: float
    source: str
    depth_m: float
    near_m: float
    centre_m: float
    track_m: float | None
    """The middle of the tracked body."""

    @property
    def error(self) -> float:
        """Of the measured surface, as a share of the label's near surface."""
        return self.depth_m / self.near_m - 1.0

    @property
    def track_error(self) -> float | None:
        """Of the track's middle, as a share of the label's centre."""
        return None if self.track_m is None else self.track_m / self.centre_m - 1.0


def measure(file: Path, labels: list[Label], model: Path, floor: float) -> list[Ranged]:
    """Show the frame for a second, then compare the last picture's boxes and tracks with the labels."""
    boxes, tracks, camera = _seen(file, model, floor)
    pairs = _matched(boxes.boxes, labels)
    return [_ranged(box, label, tracks, camera) for box, label in pairs if box.range_m is not None]


def share_within(errors: list[float | None] | list[float], limit: float) -> str:
    """How many of how many; those without a value count as off."""
    good = sum(error is not None and abs(error) <= limit for error in errors)
    return f"{good} of {len(errors)}"


def _seen(file: Path, model: Path, floor: float) -> tuple[Boxes, Tracks, Camera]:
    perception = Perception(load_detector(model, DetectorOptions(score_floor=floor)))
    camera: Camera | None = None
    boxes: Boxes | None = None
    tracks: Tracks | None = None
    for moment in open_street([file], file.parent.name, Options(hold_s=HOLD_S)).messages:
        stamp_ns = START_NS + round(moment.at_s * 1e9)
        if isinstance(moment.message, Calibration):
            perception.calibrate(moment.id or "", moment.message)
            camera = Camera.of(moment.message)
        elif isinstance(moment.message, LidarSweep):
            perception.sweep(stamp_ns, moment.message)
        elif isinstance(moment.message, CameraFrame):
            seen = perception.see(moment.id or "", stamp_ns, moment.message)
            boxes, tracks = seen.boxes, seen.tracks
    if camera is None or boxes is None or tracks is None:
        raise UserError(f"{file}: perception made nothing of it ({topics.BOXES.name}, {topics.TRACKS.name})")
    return boxes, tracks, camera


def _matched(boxes: tuple[Box, ...], labels: list[Label]) -> list[tuple[Box, Label]]:
    """Each box with the label of its kind that it overlaps best, best scores first, each label once."""
    pairs = []
    free = list(labels)
    for box in sorted(boxes, key=lambda box: -box.score):
        rivals = [label for label in free if label.kind == box.kind]
        if not rivals:
            continue
        ours = np.array([[box.x0_px, box.y0_px, box.x1_px, box.y1_px]], np.float32)
        overlap = overlaps(ours, np.array([label.box_px for label in rivals], np.float32))[0]
        if overlap.max() >= SAME_OVERLAP:
            label = rivals[int(overlap.argmax())]
            pairs.append((box, label))
            free.remove(label)
    return pairs


def _ranged(box: Box, label: Label, tracks: Tracks, camera: Camera) -> Ranged:
    """`Box.range_m` is the way to the box's middle: its share along the camera's axis is the depth."""
    ray = camera.ray((box.x0_px + box.x1_px) / 2, (box.y0_px + box.y1_px) / 2)
    track = next((each for each in tracks.tracks if each.track_id == box.track_id), None)
    return Ranged(
        category=label.category,
        score=box.score,
        source=box.range_source,
        depth_m=(box.range_m or 0.0) / float(np.linalg.norm(ray)),
        near_m=label.near_m,
        centre_m=label.centre_m,
        track_m=None if track is None else _depth(camera, track.x_m, track.y_m),
    )


def _depth(camera: Camera, x_m: float, y_m: float) -> float:
    _, depths = camera.project(np.array([[x_m, y_m, float(camera.eye[2])]]))
    return float(depths[0])

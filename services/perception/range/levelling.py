"""The pitch of a camera that never said how it is mounted, from the vehicles it sees.

A vehicle's height tells roughly how far it is, and so where its tyres ought to show; the median difference over many
vehicles is the mount's pitch. Until enough were seen the camera counts as level, with the doubt that goes with that.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from statistics import median

import msgspec

from services.perception.detect.detection import Detection
from services.perception.range.box_range import EDGE_PX, size_range
from services.perception.range.camera import PITCH_SIGMA_RAD, Camera

ENOUGH = 12
MEMORY = 200
STEEPEST_RAD = math.radians(15.0)


class Levelling:
    """One for each camera without a calibration."""

    def __init__(self) -> None:
        self._pitches_rad: deque[float] = deque(maxlen=MEMORY)

    def learn(self, detections: Sequence[Detection], level: Camera) -> None:
        """Take in the vehicles of a picture, `level` being the camera as assumed without a pitch."""
        c = level.calibration
        for detection in detections:
            whole = detection.y0_px > EDGE_PX and detection.x0_px > EDGE_PX and detection.x1_px < c.width_px - EDGE_PX
            found = size_range(detection, level) if detection.kind == "vehicle" and whole else None
            if found is not None and detection.y1_px < c.height_px - EDGE_PX:
                down_rad = math.atan((detection.y1_px - c.cy_px) / c.fy_px)
                self._pitches_rad.append(down_rad - math.atan(c.z_m / found.depth_m))

    def apply(self, level: Camera) -> Camera:
        """The camera with the pitch learned so far. A horizon above the middle of the picture: it looks down."""
        if len(self._pitches_rad) < ENOUGH:
            return level
        pitch = max(-STEEPEST_RAD, min(STEEPEST_RAD, median(self._pitches_rad)))
        calibration = msgspec.structs.replace(level.calibration, pitch_rad=pitch)
        tilted = Camera.of(calibration)
        return Camera(calibration, tilted.axes, tilted.eye, 2.5 * PITCH_SIGMA_RAD)

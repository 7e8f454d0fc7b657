"""Boxes to be doubted: their score counts for less, so that they confirm a track later, if at all.

What is tiny in one camera while another looks closer at the same place makes no track here: size and feet of a dozen
pixels give ranges wrong by half, always to the same side. Nor does the second box of one body. The box itself is
published all the same.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from services.perception.detect.detection import Detection, overlaps
from services.perception.range.box_range import (
    EDGE_PX,
    FURTHEST_M,
    STANDING,
    Range,
    ground_range,
)
from services.perception.range.camera import Camera, Floats
from services.perception.range.sizes import PRIORS

DOUBTED_SHARE = 0.4
"""Of the score that remains."""
SMALL_PX, TINY_PX = 24.0, 18.0
HUGE_SHARE = 0.45
"""Of the picture's height: so large a vehicle's box is a part of what the picture cannot hold, or large in the wider one too."""
CLOSER = 1.5
"""A camera with this many times the focal length sees what is small here well enough to be the judge of it."""
SAME_OVERLAP, SURELY = 0.7, 0.9
"""Intersection over union of two boxes of one body, and the score from which a vehicle is one whatever else it looks like. In 24
recorded drives 34 of the 7,936 boxes of people on foot lie so on the box of such a vehicle, or of a surer one; for 25 of them
there is a vehicle as well. Of other boxes of people 876 do, most of them of motorcyclists."""
TOO_TALL = 1.3
"""Times the tallest of its class: on a road that rises by one in a hundred, a person at 40 m seems 1.4 times as tall."""


def doubted(detection: Detection, found: Range | None, camera: Camera, others: Sequence[Camera]) -> bool:
    """Whether anything speaks against a road user's box (undistorted pixels); `others`: cameras whose pictures are fresh."""
    if found is None or detection.kind not in STANDING or found.source == "lidar":
        return False
    return (
        found.seen_through
        or too_tall(detection, camera)
        or (detection.height_px < SMALL_PX and seen_closer(detection, found, camera, others))
    )


def left_to_another(detection: Detection, found: Range, camera: Camera, others: Sequence[Camera]) -> bool:
    """Whether a box is tiny here, or a vehicle too large for this picture, and for another camera to judge.

    A LiDAR range makes up for a tiny box, not for parts of a lorry that fills the picture: those have returns as well.
    """
    tiny = detection.kind in STANDING and found.source != "lidar" and detection.height_px < TINY_PX
    huge = detection.kind == "vehicle" and detection.height_px > HUGE_SHARE * camera.calibration.height_px
    return (tiny and seen_closer(detection, found, camera, others)) or (
        huge and seen_wider(detection, found, camera, others)
    )


def rides(detection: Detection, others: Sequence[Detection]) -> bool:
    """Whether a person's box is that of a vehicle, surely or rather: the rider of a motorcycle is not on foot as well."""
    if detection.kind != "pedestrian":
        return False
    least = min(detection.score, SURELY)
    vehicles = [each for each in others if each.kind == "vehicle" and each.score > least]
    if not vehicles:
        return False
    own, theirs = np.array([detection.box_px], np.float32), np.array([each.box_px for each in vehicles], np.float32)
    return bool(overlaps(own, theirs).max() >= SAME_OVERLAP)


def too_tall(detection: Detection, camera: Camera) -> bool:
    """Whether it would be a giant where its feet are: a tree far behind rather than a person near by."""
    c = camera.calibration
    if c.assumed or detection.y1_px >= c.height_px - EDGE_PX:
        return False
    ground = ground_range(detection, camera)
    depth_m = ground.depth_m if ground is not None else FURTHEST_M  # feet at the horizon or above it
    return detection.height_px * depth_m / c.fy_px > TOO_TALL * PRIORS[detection.kind].possible_m[1]


def seen_closer(detection: Detection, found: Range, camera: Camera, others: Sequence[Camera]) -> bool:
    """Whether a camera of longer focal length looks there."""
    place = camera.eye + camera.ray(*detection.centre_px) * found.depth_m
    return any(
        other.calibration.fx_px > CLOSER * camera.calibration.fx_px and in_view(other, place[None]) for other in others
    )


def seen_wider(detection: Detection, found: Range, camera: Camera, others: Sequence[Camera]) -> bool:
    """Whether a camera of shorter focal length looks there."""
    place = camera.eye + camera.ray(*detection.centre_px) * found.depth_m
    return any(
        CLOSER * other.calibration.fx_px < camera.calibration.fx_px and in_view(other, place[None]) for other in others
    )


def in_view(camera: Camera, place: Floats) -> bool:
    """Whether a place in the ego frame, shape (1, 3) in metres, lies in the picture."""
    (pixel,), (depth,) = camera.project(place)
    inside = (pixel > 0.0) & (pixel < (camera.calibration.width_px, camera.calibration.height_px))
    return bool(depth > 0.0 and inside.all())

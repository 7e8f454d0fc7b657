"""A camera that was not measured: what is assumed of it, and by how much that may be wrong."""

import math

from proto.sensors import Calibration

ASSUMED_FOV_DEG = 60.0
"""Horizontal field of view of a usual dashcam or phone."""
FOCAL_SPREAD = 0.3
"""One sigma of the focal length as a share of the assumed one: 50 degrees have 1.24 of it, 80 degrees 0.69, 110 degrees 0.4."""


def assumed_calibration(width_px: int, height_px: int, fov_deg: float = 0.0, height_m: float = 1.4) -> Calibration:
    """A level pinhole camera in the middle of the windscreen, said to be a guess; a field of view of 0 was not given."""
    focal_px = width_px / 2 / math.tan(math.radians(fov_deg or ASSUMED_FOV_DEG) / 2)
    return Calibration(
        fx_px=focal_px, fy_px=focal_px, cx_px=width_px / 2, cy_px=height_px / 2, width_px=width_px, height_px=height_px,
        z_m=height_m, assumed=True, focal_spread=0.0 if fov_deg else FOCAL_SPREAD,
    )  # fmt: skip

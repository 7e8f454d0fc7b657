"""From a box to a place: how far ahead and how far to the left a sign stands, from its known size."""

from typing import NamedTuple

from proto.sensors import Calibration
from services.drivelm.reading.crops import Region
from services.drivelm.vocabulary.classes import HEIGHTS_M

_DISC_M = 0.6


class SignPosition(NamedTuple):
    """Where in the ego frame: metres ahead of the ego's centre, metres to the left."""

    distance_m: float
    lateral_m: float


def height_m(reading: str) -> float:
    """The usual height of a face."""
    return HEIGHTS_M.get(reading.partition(":")[0], _DISC_M)


def place(region: Region, reading: str, calibration: Calibration, range_m: float | None = None) -> SignPosition:
    """Where the face is, by its height in the picture, or by a measured range from the camera."""
    distance_m = range_m if range_m is not None else calibration.fy_px * height_m(reading) / max(region.height_px, 1.0)
    sideways = ((region.x0_px + region.x1_px) / 2 - calibration.cx_px) / calibration.fx_px
    lateral_m = calibration.y_m - sideways * distance_m + calibration.yaw_rad * distance_m
    return SignPosition(distance_m + calibration.x_m, lateral_m)


_GAIN = 0.5
_JUMP = 1.5


def smoothed(before: SignPosition | None, travelled_m: float, seen: SignPosition) -> SignPosition:
    """A new sight of a thing, moved halfway from where it should be by now; a jump is taken by at most half itself."""
    if before is None:
        return seen
    due_m = max(1.0, before.distance_m - travelled_m)
    distance_m = min(max(seen.distance_m, due_m / _JUMP), due_m * _JUMP)
    return SignPosition(
        due_m + _GAIN * (distance_m - due_m), before.lateral_m + _GAIN * (seen.lateral_m - before.lateral_m)
    )

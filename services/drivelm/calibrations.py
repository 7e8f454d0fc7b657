"""What is known of each camera, for the pictures that it sends."""

import math

import msgspec

from proto.sensors import Calibration


class Calibrations:
    """The last calibration of each camera that can be worked with, scaled to the size of its pictures."""

    def __init__(self) -> None:
        self._known: dict[str, Calibration] = {}
        self._sizes: dict[str, tuple[int, int]] = {}

    def take(self, camera: str, calibration: Calibration) -> bool:
        """Take a calibration; one with impossible numbers is refused, and the last one stays."""
        if not usable(calibration):
            return False
        self._known[camera] = calibration
        return True

    def sized(self, camera: str, width_px: int, height_px: int) -> None:
        """How large a camera's pictures are."""
        if min(width_px, height_px) > 0:
            self._sizes[camera] = width_px, height_px

    def of(self, camera: str) -> Calibration | None:
        """Of a camera's pictures as they come; None: never told."""
        known = self._known.get(camera)
        if known is None or camera not in self._sizes:
            return known
        return scaled(known, *self._sizes[camera])


def usable(c: Calibration) -> bool:
    """Whether places can be reckoned by it at all."""
    numbers = (c.fx_px, c.fy_px, c.cx_px, c.cy_px, c.x_m, c.y_m, c.z_m, c.pitch_rad, c.yaw_rad)
    return all(map(math.isfinite, numbers)) and min(c.fx_px, c.fy_px, c.width_px, c.height_px) > 0


def scaled(c: Calibration, width_px: int, height_px: int) -> Calibration:
    """The same camera for pictures of another size than the calibrated one."""
    if (width_px, height_px) == (c.width_px, c.height_px):
        return c
    u, v = width_px / c.width_px, height_px / c.height_px
    return msgspec.structs.replace(
        c, fx_px=c.fx_px * u, cx_px=c.cx_px * u, width_px=width_px, fy_px=c.fy_px * v, cy_px=c.cy_px * v, height_px=height_px
    )  # fmt: skip

"""What is known of each camera: its calibration, and its last few pictures by their stamp, until boxes for them arrive."""

import math
from collections import OrderedDict

import cv2
import msgspec
import numpy as np

from domain.pictures import may_be_unpacked
from proto.sensors import Calibration
from services.drivelm.reading.crops import Picture


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


class RecentFrames:
    """Holds pictures as they came (JPEG) and decodes only what is asked for."""

    def __init__(self, keep: int = 12) -> None:
        self._keep = keep
        self._frames: dict[str, OrderedDict[int, bytes]] = {}
        self.missed = 0
        """How often a picture was asked for that was never received or is gone."""

    def add(self, camera: str, stamp_ns: int, jpeg: bytes) -> None:
        """Keep a picture; the oldest of its camera goes. The last one again, to the byte, is no new picture and is left out:
        what was read of it once is no more certain by being read twice."""
        frames = self._frames.setdefault(camera, OrderedDict())
        if frames and frames[next(reversed(frames))] == jpeg:
            return
        frames[stamp_ns] = jpeg
        while len(frames) > self._keep:
            frames.popitem(last=False)

    def picture(self, camera: str, stamp_ns: int) -> Picture | None:
        """The picture of exactly that instant, RGB; `None` if it is not here or is not a picture."""
        frames = self._frames.get(camera)
        jpeg = None if frames is None else frames.get(stamp_ns)
        if jpeg is None:
            self.missed += 1
            return None
        return decoded(jpeg)

    def jpeg(self, camera: str, stamp_ns: int) -> bytes | None:
        """The bytes of the picture of exactly that instant, as they came; `None` where they are not here."""
        frames = self._frames.get(camera)
        return None if frames is None else frames.get(stamp_ns)

    def newest(self, camera: str) -> Picture | None:
        """The newest picture; None before the first one. Safe to call from any thread."""
        frames = self._frames.get(camera)
        kept = list(frames.copy().values()) if frames is not None else []
        return decoded(kept[-1]) if kept else None


def decoded(jpeg: bytes) -> Picture | None:
    """The pixels, RGB; None for what is no picture."""
    picture = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR_RGB) if may_be_unpacked(jpeg) else None
    return None if picture is None else np.asarray(picture, np.uint8)

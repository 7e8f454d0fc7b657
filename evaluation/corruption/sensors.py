"""Cameras that go dark or stand still, and stamps that jitter."""

from functools import cache

import msgspec

from evaluation.corruption.chance import chance
from evaluation.corruption.spec import CorruptionSpec
from evaluation.corruption.windows import Window, window_at
from proto.sensors import CameraFrame
from proto.truth import CorruptionKind


@cache
def black(width_px: int, height_px: int) -> bytes:
    """A black picture as JPEG."""
    import cv2  # only where a camera goes dark: `drivemcp up` must start without it
    import numpy as np

    _, jpeg = cv2.imencode(".jpg", np.zeros((height_px, width_px, 3), np.uint8))
    return jpeg.tobytes()


class Cameras:
    """Corrupts pictures; a camera is known by its id."""

    def __init__(self, spec: CorruptionSpec) -> None:
        self._spec = spec
        self._last: dict[str, CameraFrame] = {}

    def frame(self, frame: CameraFrame, camera: str, since_ns: int) -> tuple[CameraFrame, dict[CorruptionKind, Window]]:
        """The picture as it leaves, and the windows that it falls into, by kind. What is frozen keeps counting its frames."""
        spec = self._spec
        frozen = window_at(spec, "freeze", spec.freeze, camera, since_ns)
        if frozen is None:
            self._last[camera] = frame
        dark = window_at(spec, "blackout", spec.blackout, camera, since_ns)
        if dark is not None:
            jpeg = black(frame.width_px, frame.height_px)
            return msgspec.structs.replace(frame, jpeg=jpeg), {"blackout": dark}
        if frozen is None:
            return frame, {}
        old = self._last.setdefault(camera, frame)
        return msgspec.structs.replace(old, frame=frame.frame), {"freeze": frozen}


class Stamps:
    """Shifts stamps by bounded noise, a different one for each message."""

    def __init__(self, spec: CorruptionSpec) -> None:
        self._spec = spec
        self._last_ns: dict[str, int] = {}

    def shifted(self, source: str, stamp_ns: int, since_ns: int) -> int:
        """The stamp as it is told. Kept in order, no stamp of a source comes before or at its last one."""
        if not self._spec.jitter_ms:
            return stamp_ns
        noise = 2.0 * chance(self._spec.seed, "jitter", source, since_ns) - 1.0
        shifted_ns = stamp_ns + int(noise * self._spec.jitter_ms * 1e6)
        if not self._spec.jitter_keeps_order:
            return shifted_ns
        self._last_ns[source] = max(shifted_ns, self._last_ns.get(source, shifted_ns - 1) + 1)
        return self._last_ns[source]

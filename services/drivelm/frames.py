"""The last few pictures of each camera by their stamp, until boxes for them arrive."""

from collections import OrderedDict

import cv2
import numpy as np

from services.drivelm.reading.crops import Picture


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
        """The picture of that very instant, RGB; None if it is not here or is no picture."""
        frames = self._frames.get(camera)
        jpeg = None if frames is None else frames.get(stamp_ns)
        if jpeg is None:
            self.missed += 1
            return None
        return _decoded(jpeg)

    def newest(self, camera: str) -> Picture | None:
        """The last picture that came; None where there is none. For other threads than the one that adds, too."""
        frames = self._frames.get(camera)
        kept = list(frames.copy().values()) if frames is not None else []
        return _decoded(kept[-1]) if kept else None


def _decoded(jpeg: bytes) -> Picture | None:
    decoded = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR_RGB) if jpeg else None
    return None if decoded is None else np.asarray(decoded, np.uint8)

"""Pictures that tell nothing of now: blank ones, and the last one again while the car moves."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2

from services.perception.checks.decoding import Malformed
from services.perception.detect.detector import Picture

LEAST_CONTRAST = 2.0
"""Standard deviation in grey levels. Of 2,531 pictures of rendered drives, nights and rain among them, the plainest has 6.4; an
empty road by night in fog of 10 m has 5.3, a black or white picture 0."""
MOVES_MPS = 1.0
"""From this speed of ours on no two pictures are the same to the byte. In rendered drives none were of 63,000, nor while standing."""
EVERY_PX = 8


@dataclass(slots=True)
class DeadPictures:
    """What each camera showed last."""

    _last: dict[str, bytes] = field(default_factory=dict)
    _frozen: set[str] = field(default_factory=set)
    """Cameras caught repeating themselves. Braking to a stop does not thaw them, another picture does."""

    def check(self, camera_id: str, jpeg: bytes, picture: Picture, speed_mps: float | None) -> None:
        """Raises Malformed for a picture (RGB, of these bytes) that tells nothing; an unknown speed proves no standstill of the picture."""
        again = self._last.get(camera_id) == jpeg
        self._last[camera_id] = jpeg
        if not again:
            self._frozen.discard(camera_id)
        elif speed_mps is not None and abs(speed_mps) > MOVES_MPS:
            self._frozen.add(camera_id)
        if camera_id in self._frozen:
            raise Malformed(f"the camera {camera_id!r} is frozen: the same picture again, and we move")
        if contrast(picture) < LEAST_CONTRAST:
            raise Malformed(f"the camera {camera_id!r} shows nothing: its picture is of one brightness")


def contrast(picture: Picture) -> float:
    """Standard deviation of a picture (H, W, 3) in grey levels, of every eighth pixel each way."""
    grey = cv2.cvtColor(picture[::EVERY_PX, ::EVERY_PX], cv2.COLOR_RGB2GRAY)
    return float(grey.std())

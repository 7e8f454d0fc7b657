"""Whether a picture tells of now: blank and repeated pictures do not, nor does a stamp that all other sources contradict."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
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


STRAY_NS = 1_000_000_000
"""A picture further than this from every other source's time strays. The tracker takes as much for a new drive."""


@dataclass(frozen=True, slots=True)
class _Straying:
    """A camera's pictures that stray in a row: the stamps of the first and of the last."""

    since_ns: int
    last_ns: int


@dataclass(slots=True)
class Stamps:
    """The time of each camera, by its pictures."""

    _told_ns: dict[str, int] = field(default_factory=dict)
    _believed_ns: dict[str, int] = field(default_factory=dict)
    _others_ns: dict[str, tuple[int, ...]] = field(default_factory=dict)
    _straying: dict[str, _Straying] = field(default_factory=dict)

    def believed(self, camera_id: str, stamp_ns: int, beside_ns: Iterable[int], *, leads: bool) -> bool:
        """Whether to use this picture; `beside_ns`: the latest stamps of what is no camera.

        The camera that `leads` is believed as long as its own pictures follow each other, and after a jump once they
        have done so for a second. Any other must agree with another source, unless nothing else came since its last
        picture.
        """
        others = (*beside_ns, *(told_ns for name, told_ns in self._told_ns.items() if name != camera_id))
        by_itself = leads or self._others_ns.get(camera_id) == others
        own = [self._believed_ns.get(camera_id, stamp_ns)] if by_itself else []
        self._told_ns[camera_id], self._others_ns[camera_id] = stamp_ns, others
        if not others or _near(stamp_ns, [*others, *own]):
            self._straying.pop(camera_id, None)
        elif not self._insists(camera_id, stamp_ns, by_itself=by_itself):
            return False
        self._believed_ns[camera_id] = stamp_ns
        return True

    def _insists(self, camera_id: str, stamp_ns: int, *, by_itself: bool) -> bool:
        before = self._straying.get(camera_id)
        follows = before is not None and by_itself and 0 <= stamp_ns - before.last_ns <= STRAY_NS
        since_ns = before.since_ns if before is not None and follows else stamp_ns
        self._straying[camera_id] = _Straying(since_ns, stamp_ns)
        return stamp_ns - since_ns > STRAY_NS


def _near(stamp_ns: int, others: Sequence[int]) -> bool:
    return any(abs(stamp_ns - other) <= STRAY_NS for other in others)

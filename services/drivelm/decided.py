"""The pictures that were decided on, kept to be shown: those of the last ticks, and longer those of messages to the driver."""

import threading
from collections import OrderedDict
from typing import NamedTuple, TypeVar

from proto.decision import Advisory
from proto.perception import Boxes
from services.drivelm.cameras import RecentFrames

T = TypeVar("T")
KEPT_TOLD = 8
"""Pictures of messages to the driver, in memory alone; a driver asks some seconds after one."""
KEPT_RECENT = 12


class Decided(NamedTuple):
    """A picture as it came, with its boxes."""

    jpeg: bytes
    boxes: Boxes
    stamp_ns: int


class DecidedFrames:
    """The worker thread writes, tools read."""

    def __init__(self, frames: RecentFrames, camera: str) -> None:
        """`camera`: whose pictures are shown."""
        self._frames, self._camera = frames, camera
        self._lock = threading.Lock()
        self._boxes: OrderedDict[int, Boxes] = OrderedDict()
        self._ticks: OrderedDict[int, int] = OrderedDict()
        self._told: OrderedDict[int, Decided] = OrderedDict()

    def saw(self, boxes: Boxes, stamp_ns: int) -> None:
        """What was found in a picture."""
        if boxes.camera == self._camera:
            with self._lock:
                _keep(self._boxes, stamp_ns, boxes, KEPT_RECENT)

    def decide(self, advisory: Advisory) -> None:
        """A tick decided on a snapshot; its picture is kept for longer where the driver was told something."""
        with self._lock:
            _keep(self._ticks, advisory.tick, advisory.snapshot_stamp_ns, KEPT_RECENT)
            found = self._at(advisory.snapshot_stamp_ns) if advisory.kind != "SILENT" else None
            if found is not None:
                _keep(self._told, advisory.tick, found, KEPT_TOLD)

    def of_tick(self, tick: int) -> Decided | None:
        """None where no picture of it is kept."""
        with self._lock:
            return self._told.get(tick) or self._at(self._ticks.get(tick, -1))

    def of_frame(self, frame: int) -> Decided | None:
        """The picture of that number; None where it is not kept."""
        with self._lock:
            stamps = (stamp_ns for stamp_ns, boxes in reversed(self._boxes.items()) if boxes.frame == frame)
            return next((found for found in map(self._at, stamps) if found is not None), None)

    def _at(self, stamp_ns: int) -> Decided | None:
        jpeg, boxes = self._frames.jpeg(self._camera, stamp_ns), self._boxes.get(stamp_ns)
        return Decided(jpeg, boxes, stamp_ns) if jpeg is not None and boxes is not None else None


def _keep(kept: OrderedDict[int, T], key: int, value: T, most: int) -> None:
    kept[key] = value
    while len(kept) > most:
        kept.popitem(last=False)

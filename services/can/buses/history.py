"""The last frames of every bus, in memory that is set aside at the start and never grows."""

import struct
import threading
from collections import OrderedDict
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from proto.sensors import CanFrame

SLOT = struct.Struct("<qIBB64s")
"""Stamp (ns), id, kind, length, data: room for the longest frame, whatever the bus sends."""
LATEST_LIMIT = 2048
"""So many ids are remembered by their newest frame: all 11-bit ones; beyond, the one not heard for longest gives way."""
CHUNK = 1000
MB = 1_000_000
KINDS = ("extended", "fd", "remote", "error", "bitrate_switch", "error_state")

Key = tuple[bool, int]


class Ring:
    """The last frames of one bus in the order in which it carried them; the oldest give way."""

    def __init__(self, size_bytes: int) -> None:
        self.limit = max(1, size_bytes // SLOT.size)
        self._slots = bytearray(self.limit * SLOT.size)
        self._latest: OrderedDict[Key, CanFrame] = OrderedDict()
        self._lock = threading.Lock()
        self.seen = self.refused = 0
        """Frames taken, and those that no bus can carry: their numbers do not fit a slot."""

    def extend(self, frames: Iterable[CanFrame]) -> None:
        """Append frames."""
        with self._lock:
            for frame in frames:
                self._append(frame)

    def since(self, stamp_ns: int, ids: frozenset[int] | None, limit: int) -> list[CanFrame]:
        """Frames stamped at or after `stamp_ns`, oldest first, of these ids; of more than `limit` the newest. Ends
        where a thousand frames in a row are older.
        """
        found: list[CanFrame] = []
        number = self.seen
        while number > 0 and len(found) < limit:
            with self._lock:  # for a short while: the bus must not wait for a reader
                begins = max(number - CHUNK, self.seen - len(self))
                part = [self._slot(each) for each in range(number - 1, begins - 1, -1)]
            fresh = [slot for slot in part if slot[0] >= stamp_ns]  # one old stamp among them ends nothing
            found += [_frame(*slot) for slot in fresh if ids is None or slot[1] in ids]
            number = begins if fresh else 0
        return found[limit - 1 :: -1] if len(found) > limit else found[::-1]

    def latest(self) -> list[CanFrame]:
        """The newest frame of every id, the one heard last at the end."""
        with self._lock:
            return list(self._latest.values())

    @property
    def size_bytes(self) -> int:
        """What the slots take."""
        return len(self._slots)

    def __len__(self) -> int:
        return min(self.seen, self.limit)

    def _append(self, frame: CanFrame) -> None:
        length = frame.requested_bytes if frame.remote else len(frame.data)
        try:
            if length > 64:
                raise struct.error
            place = (self.seen % self.limit) * SLOT.size
            SLOT.pack_into(self._slots, place, frame.stamp_ns, frame.arbitration_id, _kind(frame), length, frame.data)
        except struct.error:
            self.refused += 1
            return
        self.seen += 1
        key = frame.extended, frame.arbitration_id
        self._latest[key] = frame
        self._latest.move_to_end(key)
        if len(self._latest) > LATEST_LIMIT:
            self._latest.popitem(last=False)

    def _slot(self, number: int) -> tuple[Any, ...]:
        return SLOT.unpack_from(self._slots, number % self.limit * SLOT.size)


class History:
    """One ring for each bus. A bus takes `megabytes`, and at most 2048 frames more for the newest of each id."""

    def __init__(self, buses: Iterable[str], megabytes: float = 16.0) -> None:
        self.rings: Mapping[str, Ring] = {bus: Ring(int(megabytes * MB)) for bus in buses}

    def extend(self, frames: Sequence[CanFrame], bus: str = "") -> None:
        """Append frames of a bus; "" is the first. Raises KeyError for an unknown bus."""
        self._ring(bus).extend(frames)

    def since(
        self, stamp_ns: int, ids: frozenset[int] | None = None, limit: int = 2000, bus: str = ""
    ) -> list[CanFrame]:
        """Frames of a bus ("": the first) from `stamp_ns` on, oldest first, of these ids; beyond `limit` the newest."""
        return self._ring(bus).since(stamp_ns, ids, limit)

    def latest(self, bus: str = "") -> list[CanFrame]:
        """The newest frame of every id on a bus ("": the first)."""
        return self._ring(bus).latest()

    @property
    def seen(self) -> int:
        """Frames of all buses since the start."""
        return sum(ring.seen for ring in self.rings.values())

    def _ring(self, bus: str) -> Ring:
        return self.rings[bus] if bus else next(iter(self.rings.values()))


def _kind(frame: CanFrame) -> int:
    return (
        frame.extended
        | frame.fd << 1
        | frame.remote << 2
        | frame.error << 3
        | frame.bitrate_switch << 4
        | frame.error_state << 5
    )


def _frame(stamp_ns: int, arbitration_id: int, kind: int, length: int, data: bytes) -> CanFrame:
    flags = {name: bool(kind >> place & 1) for place, name in enumerate(KINDS)}
    payload, requested = (b"", length) if flags["remote"] else (data[:length], 0)
    return CanFrame(stamp_ns=stamp_ns, arbitration_id=arbitration_id, data=payload, requested_bytes=requested, **flags)

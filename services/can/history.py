"""The last frames of a bus, bounded in number and therefore in memory."""

import threading
from collections import deque
from collections.abc import Sequence

from proto.sensors import CanFrame


class History:
    """A ring of frames in the order in which the bus carried them; the oldest give way.

    A frame takes about 250 bytes: the default of 20000 stays near 5 MB whatever the bus sends.
    """

    def __init__(self, limit: int = 20_000) -> None:
        self._frames: deque[CanFrame] = deque(maxlen=limit)
        self._lock = threading.Lock()
        self.seen = 0

    def extend(self, frames: Sequence[CanFrame]) -> None:
        """Append frames."""
        with self._lock:
            self._frames.extend(frames)
            self.seen += len(frames)

    def since(self, stamp_ns: int, ids: frozenset[int] | None = None, limit: int = 2000) -> list[CanFrame]:
        """Frames stamped at or after `stamp_ns`, oldest first, of these ids; of more than `limit` the newest."""
        found: list[CanFrame] = []
        with self._lock:
            for frame in reversed(self._frames):
                if frame.stamp_ns < stamp_ns or len(found) >= limit:
                    break
                if ids is None or frame.arbitration_id in ids:
                    found.append(frame)
        found.reverse()
        return found

    def latest(self) -> dict[int, CanFrame]:
        """The newest frame of every id in the ring."""
        with self._lock:
            return {frame.arbitration_id: frame for frame in self._frames}

    def __len__(self) -> int:
        return len(self._frames)

"""Which pictures are kept: all, none, or those around events. Pure."""

from collections import deque
from typing import Literal

from services.logger.writing.log_file import Record

Pictures = Literal["all", "events", "none"]
MAX_WAITING = 256
"""Pictures held back at most, whatever the clock does."""


class PictureGate:
    """Holds pictures back until it is known whether something happened around them. Times in ns."""

    def __init__(self, mode: Pictures, *, before_ns: int, after_ns: int) -> None:
        self._mode, self._before_ns, self._after_ns = mode, before_ns, after_ns
        self._waiting: deque[Record] = deque(maxlen=MAX_WAITING)
        self._open_until_ns = -1

    def offer(self, picture: Record) -> list[Record]:
        """The pictures to log now that this one has come, oldest first."""
        if self._mode == "all":
            return [picture]
        if self._mode == "none":
            return []
        if picture.log_time_ns <= self._open_until_ns:
            return [picture]
        self._waiting.append(picture)
        while self._waiting and self._waiting[0].log_time_ns < picture.log_time_ns - self._before_ns:
            self._waiting.popleft()
        return []

    def event(self, now_ns: int) -> list[Record]:
        """Something happened: the pictures from before it that are to be logged now."""
        self._open_until_ns = max(self._open_until_ns, now_ns + self._after_ns)
        kept = [one for one in self._waiting if one.log_time_ns >= now_ns - self._before_ns]
        self._waiting.clear()
        return kept

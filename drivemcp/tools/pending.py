"""Calls under way, and what ends them before their time."""

import itertools
import threading
import time
import uuid
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

from drivemcp.bus.session import Reply

_CALLER = uuid.uuid4().hex[:12]
_NUMBERS = itertools.count(1)


class Pending:
    """One call under way."""

    __slots__ = (
        "arguments",
        "call_id",
        "cancelled",
        "collected",
        "deadline_ns",
        "done",
        "ended",
        "limit_ms",
        "payload",
        "reply",
        "sent_ns",
        "server",
        "tool",
        "traceparent",
        "until_s",
    )

    def __init__(
        self,
        tool: str,
        server: str,
        arguments: Any,
        payload: bytes,
        sent_ns: int,
        deadline_ms: float,
        ended: SimpleQueue[None],
    ) -> None:
        self.tool = tool
        self.server = server
        self.arguments = arguments
        self.payload = payload
        self.call_id = f"{_CALLER}-{next(_NUMBERS)}"
        self.sent_ns = sent_ns
        self.deadline_ns = self.sent_ns + int(deadline_ms * 1e6)
        self.until_s = time.monotonic() + deadline_ms / 1e3  # the same for our own wait, whatever becomes of the clock
        self.ended = ended
        self.reply: Reply | None = None
        self.done = False
        self.collected = False
        self.cancelled = False
        self.traceparent = ""
        self.limit_ms = 0.0
        """The deadline asked for."""

    def end(self, reply: Reply | None) -> None:
        """The answer is in, or there will be none."""
        self.reply = reply
        self.done = True
        self.ended.put(None)

    def finished(self) -> bool:
        """Whether `end` was called, on the bus's thread."""
        return self.done


class Cancellation:
    """Ends the calls that it was given to, from any thread; those that have ended are left alone."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._cancelled = False
        self._ends: list[Callable[[], None]] = []

    def cancel(self) -> None:
        """End them, and those that are still to come."""
        with self._lock:
            self._cancelled, ends, self._ends = True, self._ends, []
        for end in ends:
            end()

    def bind(self, end: Callable[[], None]) -> None:
        """What ends one call."""
        with self._lock:
            if not self._cancelled:
                self._ends.append(end)
                return
        end()

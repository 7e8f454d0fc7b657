"""A call under way."""

import itertools
import time
import uuid
from collections.abc import Callable
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
        "limit_ms",
        "payload",
        "reply",
        "sent_ns",
        "server",
        "tool",
        "traceparent",
        "until_s",
        "wake",
    )

    def __init__(
        self,
        tool: str,
        server: str,
        arguments: Any,
        payload: bytes,
        sent_ns: int,
        deadline_ms: float,
        wake: Callable[[], None],
    ) -> None:
        self.tool = tool
        self.server = server
        self.arguments = arguments
        self.payload = payload
        self.call_id = f"{_CALLER}-{next(_NUMBERS)}"
        self.sent_ns = sent_ns
        self.deadline_ns = self.sent_ns + int(deadline_ms * 1e6)
        self.until_s = time.monotonic() + deadline_ms / 1e3  # the same for our own wait, whatever becomes of the clock
        self.wake = wake
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
        self.wake()

    def finished(self) -> bool:
        """Whether `end` was called, on the bus's thread."""
        return self.done

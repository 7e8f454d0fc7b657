"""The python-can interface `zenoh`: any python-can program (logger, notifier, ISO-TP stack, player) on a bus that
crosses processes.

`can.Bus(interface="zenoh", channel="can0", link=NodeLink(node, "can0"))`. It works on a `FrameLink` and knows nothing
of the transport.
"""

import queue
import time
from collections.abc import Sequence
from typing import Any

import can

from proto.sensors import CanFrame
from services.can.buses.link import FrameLink, from_message, to_message


class ZenohBus(can.BusABC):
    """A bus over topics. Of a reader that falls behind by `depth` frames the oldest are lost, and counted."""

    def __init__(self, channel: str, link: FrameLink | None = None, depth: int = 10_000, **kwargs: Any) -> None:
        if link is None:
            raise can.CanInitializationError("interface 'zenoh' needs link=NodeLink(node, channel)")
        self._link = link
        self._queue: queue.Queue[CanFrame] = queue.Queue(depth)
        self.lost = 0
        self.channel_info = f"zenoh {channel}"
        super().__init__(channel=channel, **kwargs)
        link.listen(self._take)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send one message; it is stamped when it leaves."""
        frame = from_message(msg)
        self._link.transmit((frame,))

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        try:
            frame = self._queue.get(timeout=timeout) if timeout is None or timeout > 0 else self._queue.get_nowait()
        except queue.Empty:
            return None, False
        message = to_message(frame)
        message.channel = self.channel_info
        return message, False

    def _take(self, frames: Sequence[CanFrame]) -> None:
        for frame in frames:
            while self._queue.full():
                self._drop_oldest()
            self._queue.put(frame)

    def _drop_oldest(self) -> None:
        try:
            self._queue.get_nowait()
            self.lost += 1
        except queue.Empty:  # the reader was faster
            time.sleep(0)

"""Ways to a bus: frames carried by topics between processes, or any python-can interface on a vehicle."""

import threading
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Protocol

from proto import topics
from proto.sensors import CanFrame, CanFrames

if TYPE_CHECKING:
    from drivemcp.node import Node

OnFrames = Callable[[Sequence[CanFrame]], None]
EPOCH_S = 1_000_000_000.0
"""Below this a time stamp counts from the interface's own start, not from 1970."""


class FrameLink(Protocol):
    """What a bus can do."""

    def listen(self, on_frames: OnFrames) -> None:
        """Deliver received frames, in order, on the node's worker thread."""
        ...

    def transmit(self, frames: Sequence[CanFrame]) -> None:
        """Send frames."""
        ...


class NodeLink:
    """Frames on `can/<bus>/rx` and `can/<bus>/tx`: crosses processes and machines without kernel support."""

    def __init__(self, node: "Node", bus: str) -> None:
        self._node, self._bus = node, bus

    def listen(self, on_frames: OnFrames) -> None:
        """Subscribe to what the bus carries."""
        self._node.subscribe(topics.CAN_RX, lambda message, _: on_frames(message.frames), id=self._bus)

    def transmit(self, frames: Sequence[CanFrame]) -> None:
        """Publish what is to be sent on the bus."""
        self._node.publish(topics.CAN_TX, CanFrames(frames=tuple(frames)), id=self._bus)


class PythonCanLink:
    """A python-can bus: socketcan, virtual, udp_multicast, slcan, ... A thread reads; the node's worker handles."""

    def __init__(self, bus: Any, node: "Node") -> None:
        self._bus, self._node = bus, node
        self._stopped = threading.Event()
        self._reader: threading.Thread | None = None
        node.on_close(self.close)

    def listen(self, on_frames: OnFrames) -> None:
        """Start reading."""
        self._reader = threading.Thread(target=self._read, args=(on_frames,), name="can-reader", daemon=True)
        self._reader.start()

    def transmit(self, frames: Sequence[CanFrame]) -> None:
        """Send on the bus."""
        for frame in frames:
            self._bus.send(to_message(frame))

    def close(self) -> None:
        """Stop reading and let the interface go."""
        self._stopped.set()
        if self._reader is not None:
            self._reader.join(2.0)
        self._bus.shutdown()

    def _read(self, on_frames: OnFrames) -> None:
        while not self._stopped.is_set():
            batch = self._batch()
            if batch:
                self._node.run_soon(lambda frames=batch: on_frames(frames))  # type: ignore[misc]

    def _batch(self) -> list[CanFrame]:
        """Wait for a frame, then take what follows within 10 ms: a busy bus costs a hundred hand-overs a second, not
        thousands.
        """
        first = self._bus.recv(0.2)
        batch = [] if first is None else [from_message(first)]
        ends = time.monotonic() + 0.01
        while batch and (left := ends - time.monotonic()) > 0:
            message = self._bus.recv(left)
            if message is not None and not message.is_error_frame:
                batch.append(from_message(message))
        return batch


def to_message(frame: CanFrame) -> Any:
    """A frame as python-can's message."""
    import can

    return can.Message(
        timestamp=frame.stamp_ns / 1e9,
        arbitration_id=frame.arbitration_id,
        data=frame.data,
        is_extended_id=frame.extended,
        is_fd=frame.fd,
    )


def from_message(message: Any) -> CanFrame:
    """python-can's message as a frame; one without a time of day is stamped now."""
    stamp_s = message.timestamp if message.timestamp > EPOCH_S else time.time()
    return CanFrame(
        stamp_ns=int(stamp_s * 1e9),
        arbitration_id=message.arbitration_id,
        data=bytes(message.data),
        extended=message.is_extended_id,
        fd=message.is_fd,
    )

"""Ways to a bus: frames carried by topics between processes, or any python-can interface on a vehicle."""

import contextlib
import itertools
import struct
import threading
import time
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import can

from drivemcp.errors import ConfigError
from drivemcp.files.can_logs.log import frame_of
from proto import topics
from proto.sensors import CanFrame, CanFrames
from services.can.errors import LinkDown

if TYPE_CHECKING:
    from drivemcp.node import Node

OnFrames = Callable[[Sequence[CanFrame]], None]
EPOCH_S = 1_000_000_000.0
"""Below this a time stamp counts from the interface's own start, not from 1970."""
BATCH_S = 0.005
DOWN = (can.CanError, OSError, NotImplementedError)
"""What python-can's interfaces raise when adapter or bus is gone."""
GARBLED = (ValueError, TypeError, IndexError, KeyError, struct.error)
"""What they raise on bytes that are no frame, as of a serial adapter."""
GARBLED_LIMIT = 100
BACK_OFF_S = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)
"""Waits between attempts to open a lost bus; the last repeats."""


class FrameLink(Protocol):
    """What a bus can do."""

    @property
    def state(self) -> str:
        """How the bus is, in words, for the health of the service."""
        ...

    def listen(self, on_frames: OnFrames) -> None:
        """Deliver received frames, in order, on the node's worker thread."""
        ...

    def transmit(self, frames: Sequence[CanFrame]) -> None:
        """Send frames. Raises LinkDown where the bus takes none now."""
        ...


class NodeLink:
    """Frames on `can/<bus>/rx` and `can/<bus>/tx`: crosses processes and machines without kernel support."""

    def __init__(self, node: "Node", bus: str) -> None:
        self._node, self._bus = node, bus

    state = "carried by topics"

    def listen(self, on_frames: OnFrames) -> None:
        """Subscribe to what the bus carries."""
        self._node.subscribe(topics.CAN_RX, lambda message, _: on_frames(message.frames), id=self._bus)

    def transmit(self, frames: Sequence[CanFrame]) -> None:
        """Publish what is to be sent on the bus."""
        self._node.publish(topics.CAN_TX, CanFrames(frames=tuple(frames)), id=self._bus)


class PythonCanLink:
    """A python-can bus: socketcan, virtual, udp_multicast, slcan, ... A thread reads; the node's worker handles.

    An adapter that is unplugged, or falls off its bus, is opened again and again, at growing intervals.
    """

    def __init__(self, open_bus: Callable[[], Any], node: "Node") -> None:
        self._open, self._node = open_bus, node
        self._bus: Any = open_bus()
        self.state = "up"
        self._losses = self.garbled = 0
        self._failed: Exception | None = None
        """What broke off a batch: raised once the frames before it are handed over."""
        self._stopped = threading.Event()
        self._reader: threading.Thread | None = None
        node.on_close(self.close)

    def listen(self, on_frames: OnFrames) -> None:
        """Start reading."""
        self._reader = threading.Thread(target=self._read, args=(on_frames,), name="can-reader", daemon=True)
        self._reader.start()

    def transmit(self, frames: Sequence[CanFrame]) -> None:
        """Send on the bus. Raises LinkDown."""
        bus = self._bus
        if bus is None:
            raise LinkDown(f"the bus is {self.state}")
        try:
            for frame in frames:
                bus.send(to_message(frame))
        except DOWN as error:
            raise LinkDown(f"the bus took no frame: {_words(error)}") from error

    def close(self) -> None:
        """Stop reading and let the interface go."""
        self._stopped.set()
        if self._reader is not None:
            self._reader.join(2.0)
        self._let_go()

    def _read(self, on_frames: OnFrames) -> None:
        in_a_row = 0
        while not self._stopped.is_set():
            try:
                batch = self._batch(self._bus)
            except DOWN as error:
                self._reopen(_words(error))
                continue
            except GARBLED as error:
                in_a_row = (in_a_row + 1) % GARBLED_LIMIT
                self._garbled(_words(error), lost=in_a_row == 0)
                continue
            if batch:
                in_a_row = 0
                self._node.run_soon(lambda frames=batch: on_frames(frames))  # type: ignore[misc]
        self._let_go()  # where it was opened again while the service ended

    def _garbled(self, reason: str, *, lost: bool) -> None:
        """Something came that is no frame. One is passed over; where nothing else comes the bus is opened again."""
        self.garbled += 1
        if lost:
            self._reopen(f"nothing that is a frame: {reason}")
        else:
            self.state = f"up; {self.garbled} times no frame, last: {reason}"
            self._stopped.wait(BATCH_S)

    def _batch(self, bus: Any) -> list[CanFrame]:
        """Wait for a frame, then take what follows within 5 ms: a busy bus costs two hundred hand-overs a second, not
        thousands, and the ego stays fresh.
        """
        if self._failed is not None:
            failed, self._failed = self._failed, None
            raise failed
        first = bus.recv(0.2)
        if first is None:
            _check_on_bus(bus)
            return []
        batch = [from_message(first)]
        try:
            _follow(bus, batch)
        except (*DOWN, *GARBLED) as error:
            self._failed = error
        return batch

    def _reopen(self, reason: str) -> None:
        """Try until it works or the service ends."""
        self._let_go()
        self._losses += 1
        for wait_s in itertools.chain(BACK_OFF_S, itertools.repeat(BACK_OFF_S[-1])):
            self.state = f"down: {reason}; trying every {wait_s:g} s"
            if self._stopped.wait(wait_s):
                return
            try:
                self._bus = self._open()
            except (ConfigError, *DOWN) as error:
                reason = _words(error)
                continue
            self.state = f"up, after {self._losses} losses"
            return

    def _let_go(self) -> None:
        bus, self._bus = self._bus, None
        if bus is not None:
            with contextlib.suppress(*DOWN):
                bus.shutdown()


def _follow(bus: Any, batch: list[CanFrame]) -> None:
    """Append what comes within 5 ms."""
    ends = time.monotonic() + BATCH_S
    while (left := ends - time.monotonic()) > 0:
        message = bus.recv(left)
        if message is not None:
            batch.append(from_message(message))
    if batch[-1].error:
        _check_on_bus(bus)


def _check_on_bus(bus: Any) -> None:
    """Raise CanOperationError where the controller has taken itself off the bus."""
    if bus.state is can.BusState.ERROR:
        raise can.CanOperationError("off the bus: too many errors")


def _words(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def to_message(frame: CanFrame) -> can.Message:
    """A frame as python-can's message."""
    return can.Message(
        timestamp=frame.stamp_ns / 1e9,
        arbitration_id=frame.arbitration_id,
        data=None if frame.remote else frame.data,
        dlc=frame.requested_bytes if frame.remote else len(frame.data),
        is_extended_id=frame.extended,
        is_remote_frame=frame.remote,
        is_error_frame=frame.error,
        is_fd=frame.fd,
        bitrate_switch=frame.bitrate_switch,
        error_state_indicator=frame.error_state,
    )


def from_message(message: can.Message) -> CanFrame:
    """python-can's message as a frame; one without a time of day is stamped now."""
    stamp_s = message.timestamp if message.timestamp > EPOCH_S else time.time()
    return frame_of(message, int(stamp_s * 1e9))

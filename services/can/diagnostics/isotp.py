"""ISO 15765-2, the tester's side, by `can-isotp`: short requests out, answers of any length in.

The library's state machine without its threads: a frame is put in, its flow control and whole messages come out, at
once and on the caller's thread. Why: docs/decisions/0007.
"""

import logging
from collections import deque
from collections.abc import Callable

import isotp

from services.can.diagnostics.addresses import is_extended, request_id

PADDING = 0xAA
SINGLE, FIRST = 0x0, 0x1
FLOW_FRAMES = frozenset(bytes([0x30 | status, 0, 0]) + bytes([PADDING]) * 5 for status in (0, 2))
"""Clear to send, all frames at once and no pause between them; and: longer than is taken."""

logging.getLogger(__name__).setLevel(logging.ERROR)  # the library warns of every broken frame; here they are counted
_PARAMS = {
    "stmin": 0,
    "blocksize": 0,
    "tx_padding": PADDING,
    "rx_consecutive_frame_timeout": 60_000,
    "logger_name": __name__,
    "wait_func": lambda seconds: None,  # only tried, for a millisecond, whenever a state machine is made
}
"""The library's timer runs by the wall clock; the exchange's own deadlines come first and hold in simulated time too."""


def single_frame(payload: bytes) -> bytes:
    """A request of at most 7 bytes as the data of one frame. Raises ValueError where it is longer."""
    if not 1 <= len(payload) <= 7:
        raise ValueError("a single frame carries 1 to 7 bytes")
    return bytes([len(payload)]) + payload + bytes([PADDING]) * (7 - len(payload))


def beginning(data: bytes) -> bytes:
    """The first bytes of the message that this frame begins; empty where it begins none."""
    kind = data[0] >> 4 if data else None
    if kind == SINGLE:
        return data[1 : 1 + (data[0] & 0x0F)]
    return data[2:8] if kind == FIRST else b""


class Receiver:
    """Puts the frames of one unit together; `transmit` (id, data) takes flow control."""

    def __init__(self, answer_id: int, transmit: Callable[[int, bytes], None]) -> None:
        bits = isotp.AddressingMode.Normal_29bits if is_extended(answer_id) else isotp.AddressingMode.Normal_11bits
        self._id, self._extended = answer_id, is_extended(answer_id)
        self._frames: deque[isotp.CanMessage] = deque()
        self._layer = isotp.TransportLayerLogic(
            rxfn=lambda _: self._frames.popleft() if self._frames else None,
            txfn=lambda message: transmit(message.arbitration_id, bytes(message.data)),
            address=isotp.Address(bits, txid=request_id(answer_id), rxid=answer_id),
            error_handler=self._count,
            params=_PARAMS,
        )
        self.malformed = 0

    @property
    def receiving(self) -> bool:
        """Whether a message has begun and not ended."""
        return self._layer.is_rx_active()

    def feed(self, data: bytes) -> list[bytes]:
        """The messages that this frame completes. What fits nothing is counted, and ends the message under way."""
        self._frames.append(isotp.CanMessage(arbitration_id=self._id, data=data, extended_id=self._extended))
        self._layer.process(0.0)
        whole = []
        while (message := self._layer.recv()) is not None:
            whole.append(bytes(message))
        return whole

    def _count(self, error: Exception) -> None:
        self.malformed += 1

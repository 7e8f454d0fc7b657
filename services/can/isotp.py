"""ISO 15765-2, the tester's side: short requests out, answers of any length up to 4095 bytes in."""

from services.can.errors import MalformedFrame

PADDING = 0xAA
SINGLE, FIRST, CONSECUTIVE, FLOW = 0x0, 0x1, 0x2, 0x3
FLOW_CONTINUE = bytes([0x30, 0x00, 0x00]) + bytes([PADDING]) * 5
"""Clear to send: all frames at once, no pause between them."""


def single_frame(payload: bytes) -> bytes:
    """A request of at most 7 bytes as the data of one frame. Raises ValueError where it is longer."""
    if not 1 <= len(payload) <= 7:
        raise ValueError("a single frame carries 1 to 7 bytes")
    return bytes([len(payload)]) + payload + bytes([PADDING]) * (7 - len(payload))


class Reassembly:
    """Puts the frames of one sender together again."""

    def __init__(self) -> None:
        self._data = bytearray()
        self._length = 0
        self._next = 0

    def feed(self, data: bytes) -> tuple[bytes | None, bool]:
        """(whole payload once it is complete, whether flow control must be sent). Raises MalformedFrame; then starts
        afresh.
        """
        if not data:
            raise MalformedFrame("an empty frame")
        kind = data[0] >> 4
        if kind == SINGLE:
            return self._single(data), False
        if kind == FIRST:
            return None, self._first(data)
        if kind == CONSECUTIVE:
            return self._consecutive(data), False
        if kind == FLOW:
            return None, False
        raise MalformedFrame(f"unknown frame type {kind}")

    def _reset(self) -> None:
        self._data, self._length, self._next = bytearray(), 0, 0

    def _single(self, data: bytes) -> bytes:
        self._reset()
        length = data[0] & 0x0F
        if not 1 <= length <= len(data) - 1:
            raise MalformedFrame(f"a single frame that claims {length} bytes")
        return data[1 : 1 + length]

    def _first(self, data: bytes) -> bool:
        self._reset()
        length = ((data[0] & 0x0F) << 8 | data[1]) if len(data) == 8 else 0
        if length <= 7:
            raise MalformedFrame(f"a first frame that claims {length} bytes")
        self._length, self._next = length, 1
        self._data.extend(data[2:])
        return True

    def _consecutive(self, data: bytes) -> bytes | None:
        if not self._length:
            return None  # the rest of somebody else's message
        if data[0] & 0x0F != self._next:
            self._reset()
            raise MalformedFrame("a consecutive frame out of sequence")
        self._next = (self._next + 1) & 0x0F
        self._data.extend(data[1:])
        if len(self._data) < self._length:
            return None
        payload = bytes(self._data[: self._length])
        self._reset()
        return payload

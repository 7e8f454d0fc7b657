"""How the simulated control units send: ISO 15765-2 with flow control, in simulated time, on 11- and 29-bit ids."""

from proto.sensors import CanFrame

FUNCTIONAL_11, FUNCTIONAL_29 = 0x7DF, 0x18DB33F1
PADDING = 0xAA
FLOW_TIMEOUT_NS = 1_000_000_000


def is_extended(arbitration_id: int) -> bool:
    """Whether an id takes 29 bits."""
    return arbitration_id > 0x7FF


def frame(arbitration_id: int, data: bytes, stamp_ns: int) -> CanFrame:
    """A frame padded to 8 bytes."""
    padded = data + bytes([PADDING]) * (8 - len(data))
    return CanFrame(stamp_ns=stamp_ns, arbitration_id=arbitration_id, data=padded, extended=is_extended(arbitration_id))


class Transfer:
    """A long answer that waits for flow control."""

    def __init__(self, answer_id: int, payload: bytes, now_ns: int) -> None:
        self.answer_id, self.started_ns = answer_id, now_ns
        self.rest = payload[6:]
        self.number = 1
        self.pause_ns = 0
        self.block = 0
        self.next_ns: int | None = None
        self.head = bytes([0x10 | len(payload) >> 8, len(payload) & 0xFF]) + payload[:6]

    def flow(self, data: bytes, now_ns: int) -> bool:
        """Take a flow control frame; False where the tester gave up."""
        kind = data[0] & 0x0F
        if kind == 0 and len(data) >= 3:
            self.block, self.pause_ns, self.next_ns = data[1], _pause_ns(data[2]), now_ns
        return kind in (0, 1)

    def due(self, now_ns: int) -> list[CanFrame]:
        """The parts whose time has come."""
        frames: list[CanFrame] = []
        sent = 0
        while self.rest and self.next_ns is not None and self.next_ns <= now_ns:
            data = bytes([0x20 | self.number & 0x0F]) + self.rest[:7]
            frames.append(frame(self.answer_id, data, self.next_ns))
            self.rest, self.number, sent = self.rest[7:], self.number + 1, sent + 1
            self.next_ns = None if self.block and sent == self.block else self.next_ns + self.pause_ns
        self.block -= sent if self.block else 0
        return frames


def _pause_ns(separation: int) -> int:
    """STmin of ISO 15765-2: 0 to 127 ms, 0xF1 to 0xF9 tenths of a millisecond; what is reserved counts as 127 ms."""
    if separation <= 0x7F:
        return separation * 1_000_000
    return (separation - 0xF0) * 100_000 if 0xF1 <= separation <= 0xF9 else 127_000_000


class Line:
    """What the units have to send: at once, later, or in parts."""

    def __init__(self) -> None:
        self._transfers: dict[int, Transfer] = {}
        self._later: list[tuple[int, int, bytes]] = []

    def send(self, answer_id: int, payload: bytes, now_ns: int) -> CanFrame:
        """The first frame of an answer; the rest waits for flow control."""
        self._transfers.pop(answer_id, None)
        if len(payload) <= 7:
            return frame(answer_id, bytes([len(payload)]) + payload, now_ns)
        transfer = self._transfers[answer_id] = Transfer(answer_id, payload, now_ns)
        return frame(answer_id, transfer.head, now_ns)

    def send_later(self, answer_id: int, payload: bytes, due_ns: int) -> None:
        """An answer that takes its unit a while."""
        self._later.append((due_ns, answer_id, payload))

    def flow(self, answer_id: int, data: bytes, now_ns: int) -> list[CanFrame]:
        """Flow control for the unit that answers here."""
        transfer = self._transfers.get(answer_id)
        if transfer is None:
            return []
        if not transfer.flow(data, now_ns):
            del self._transfers[answer_id]
            return []
        return self.step(now_ns)

    def drop(self, answer_id: int) -> None:
        """Forget what this unit had to send."""
        self._transfers.pop(answer_id, None)
        self._later = [each for each in self._later if each[1] != answer_id]

    def step(self, now_ns: int) -> list[CanFrame]:
        """What is due; transfers whose tester fell silent are dropped."""
        ready = [each for each in self._later if each[0] <= now_ns]
        self._later = [each for each in self._later if each[0] > now_ns]
        frames = [self.send(answer_id, payload, due_ns) for due_ns, answer_id, payload in ready]
        frames += [each for transfer in self._transfers.values() for each in transfer.due(now_ns)]
        self._transfers = {
            answer_id: transfer
            for answer_id, transfer in self._transfers.items()
            if transfer.rest and now_ns - transfer.started_ns < FLOW_TIMEOUT_NS
        }
        return frames

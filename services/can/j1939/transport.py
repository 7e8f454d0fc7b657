"""J1939-21 transport: groups of 9 to 1785 bytes put together from packets of 7, announced to all (BAM) or agreed upon
by two (RTS, CTS). It only listens.
"""

from collections import OrderedDict
from typing import NamedTuple

from services.can.j1939 import messages
from services.can.j1939.messages import Header

CONNECTION, DATA = 0xEC00, 0xEB00
RTS, BAM, ABORT = 16, 32, 255
SHORTEST, LONGEST, PACKET = 9, 1785, 7
GAP_NS = 1_250_000_000
"""T2 of J1939-21, the longest of its waits between packets: what is older was given up."""
SESSIONS_LIMIT = 512


class Group(NamedTuple):
    """A parameter group as it was sent, however many frames that took."""

    header: Header
    data: bytes
    stamp_ns: int


class _Session:
    """One message on its way."""

    def __init__(self, group: Header, size: int, packets: int, stamp_ns: int, *, in_order: bool) -> None:
        self.header, self.size, self.packets, self.in_order = group, size, packets, in_order
        self.data = bytearray(packets * PACKET)
        self.got: set[int] = set()
        self.stamp_ns = stamp_ns

    def take(self, number: int, payload: bytes) -> bool:
        """Whether the packet belongs here. To one receiver lost ones are sent again, in whatever order it asks."""
        if not 1 <= number <= self.packets or (self.in_order and number != len(self.got) + 1):
            return False
        self.data[(number - 1) * PACKET : number * PACKET] = payload
        self.got.add(number)
        return True


class Transport:
    """Puts together what the senders of one bus send in pieces; pieces of different senders may be interleaved."""

    def __init__(self) -> None:
        self._sessions: OrderedDict[tuple[int, int], _Session] = OrderedDict()
        self.malformed = 0

    def feed(self, arbitration_id: int, data: bytes, stamp_ns: int) -> Group | None:
        """The group that this frame completes: itself where it is no piece. Pieces that do not fit are counted."""
        head = messages.header(arbitration_id)
        if head.pgn == CONNECTION:
            self._control(head, data, stamp_ns)
            return None
        if head.pgn == DATA:
            return self._piece(head, data, stamp_ns)
        return Group(head, data, stamp_ns)

    def awaited(self, pgn: int, now_ns: int) -> bool:
        """Whether a message of this group is on its way."""
        sessions = list(self._sessions.values())
        return any(each.header.pgn == pgn and now_ns - each.stamp_ns < GAP_NS for each in sessions)

    def _control(self, head: Header, data: bytes, stamp_ns: int) -> None:
        key = head.source, head.destination
        if len(data) != 8:
            self.malformed += 1
        elif data[0] == ABORT:
            self._sessions.pop(key, None)
            self._sessions.pop((head.destination, head.source), None)
        elif data[0] in (RTS, BAM):
            self._begin(head, data, stamp_ns)

    def _begin(self, head: Header, data: bytes, stamp_ns: int) -> None:
        size, packets, pgn = int.from_bytes(data[1:3], "little"), data[3], int.from_bytes(data[5:8], "little")
        to_all = data[0] == BAM
        fits = SHORTEST <= size <= LONGEST and packets == -(-size // PACKET) and pgn < messages.PGN_LIMIT
        key = head.source, head.destination
        self._sessions.pop(key, None)
        if not fits or to_all != (head.destination == messages.GLOBAL):
            self.malformed += 1
            return
        group = Header(head.priority, pgn, head.destination, head.source)
        self._sessions[key] = _Session(group, size, packets, stamp_ns, in_order=to_all)
        if len(self._sessions) > SESSIONS_LIMIT:
            self._sessions.popitem(last=False)

    def _piece(self, head: Header, data: bytes, stamp_ns: int) -> Group | None:
        key = head.source, head.destination
        session = self._sessions.get(key)
        if session is None:
            return None  # it began before we listened
        late = stamp_ns - session.stamp_ns > GAP_NS
        if late or len(data) != 8 or not session.take(data[0], data[1:]):
            self.malformed += 1
            self._sessions.pop(key)
            return None
        session.stamp_ns = stamp_ns
        if len(session.got) < session.packets:
            return None
        self._sessions.pop(key)
        return Group(session.header, bytes(session.data[: session.size]), stamp_ns)

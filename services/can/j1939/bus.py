"""What is heard on a J1939 bus: the newest of every group by sender, and answers to what was asked."""

import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Iterable
from functools import partial
from typing import NamedTuple

from proto.sensors import CanFrame
from services.can.diagnostics import gate
from services.can.errors import RequestRefused
from services.can.j1939 import messages
from services.can.j1939.transport import Group, Transport

GROUPS_LIMIT = 1024
"""So many (group, sender) are remembered; beyond, the one not heard for longest gives way."""
ANSWERS_LIMIT = 64
QUIET_S = 0.25
"""After an answer so long for another: units answer a request within 200 ms (J1939-21)."""
REQUESTS_PER_S, BURST = 3.0, 6.0

Send = Callable[[int, bytes], None]
Refused = Callable[[int, bytes, str], None]
"""Told of a request that did not leave, and why."""


class Heard:
    """A group from one sender: the newest, and how often."""

    __slots__ = ("count", "group")

    def __init__(self, group: Group) -> None:
        self.group, self.count = group, 0


class _Asked(NamedTuple):
    """A group that was asked for, and what answered."""

    pgn: int
    answers: list[Group]

    def answered_by(self, group: Group) -> bool:
        """Whether it is the group itself, or an acknowledgement that names it."""
        named = group.header.pgn == messages.ACKNOWLEDGEMENT and group.data[5:8] == messages.request_data(self.pgn)
        return len(self.answers) < ANSWERS_LIMIT and (group.header.pgn == self.pgn or named)


class J1939Bus:
    """One bus. One thread feeds it; tools read and ask."""

    def __init__(self, send: Send, refused: Refused = lambda arbitration_id, data, reason: None) -> None:
        self._send, self._refused = send, refused
        self._transport = Transport()
        self._heard: OrderedDict[tuple[int, int], Heard] = OrderedDict()
        self._changed = threading.Condition()
        self._asking = threading.Lock()
        self._pace = gate.Pace(REQUESTS_PER_S, BURST)
        self._asked: _Asked | None = None

    def feed(self, frames: Iterable[CanFrame]) -> list[CanFrame]:
        """Take frames from the bus; those that were sent in pieces come back whole, as one frame each."""
        whole: list[CanFrame] = []
        for frame in frames:
            if not frame.extended or frame.error or frame.remote:
                continue
            group = self._transport.feed(frame.arbitration_id, frame.data, frame.stamp_ns)
            if group is not None:
                self._take(group)
                if group.data is not frame.data:
                    whole.append(_as_frame(group))
        return whole

    def heard(self) -> list[Heard]:
        """Every group by sender, the one heard last at the end."""
        with self._changed:
            return list(self._heard.values())

    @property
    def malformed(self) -> int:
        """Pieces that fit no message."""
        return self._transport.malformed

    def ask(self, pgn: int, timeout_s: float, clock: Callable[[], int]) -> list[Group]:
        """Ask all units for a group; what was answered, acknowledgements too. Raises RequestRefused, TimeoutError."""
        frame_id = messages.id_of(messages.REQUEST, messages.TOOL_ADDRESS)
        try:
            gate.check_j1939_request(frame_id, messages.request_data(pgn))
        except RequestRefused as error:
            self._refused(frame_id, messages.request_data(pgn), str(error))
            raise
        if not self._asking.acquire(timeout=timeout_s):
            raise TimeoutError("another request is still waiting for its answer")
        try:
            if (wait_s := self._pace.take()) > 0:
                raise TimeoutError(f"asked too often; again in {wait_s:.1f} s")
            return self._exchange(pgn, frame_id, timeout_s, clock)
        finally:
            self._asking.release()

    def _exchange(self, pgn: int, frame_id: int, timeout_s: float, clock: Callable[[], int]) -> list[Group]:
        """Wait for a first answer, then for others until the bus is quiet about it."""
        answers: list[Group] = []
        with self._changed:
            self._asked = _Asked(pgn, answers)
        try:
            self._send(frame_id, messages.request_data(pgn))
            ends = time.monotonic() + timeout_s
            with self._changed:
                self._changed.wait_for(lambda: bool(answers), timeout_s)
                while answers and (left_s := ends - time.monotonic()) > 0:
                    more = self._changed.wait_for(partial(_longer, answers, len(answers)), min(left_s, QUIET_S))
                    if not more and not self._transport.awaited(pgn, clock()):
                        break
                return list(answers)
        finally:
            self._asked = None

    def _take(self, group: Group) -> None:
        key = group.header.pgn, group.header.source
        with self._changed:
            heard = self._heard.setdefault(key, Heard(group))
            heard.group = group
            heard.count += 1
            self._heard.move_to_end(key)
            if len(self._heard) > GROUPS_LIMIT:
                self._heard.popitem(last=False)
            if self._asked is not None and self._asked.answered_by(group):
                self._asked.answers.append(group)
                self._changed.notify_all()


def _longer(answers: list[Group], known: int) -> bool:
    return len(answers) > known


def _as_frame(group: Group) -> CanFrame:
    head = group.header
    return CanFrame(
        stamp_ns=group.stamp_ns,
        arbitration_id=messages.id_of(head.pgn, head.source, head.destination, head.priority),
        data=group.data,
        extended=True,
    )

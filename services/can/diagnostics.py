"""Requests to control units and their answers, matched by id, service and parameter. Knows no bus: it is given a way
to send.
"""

import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager

from proto.sensors import CanFrame
from services.can import gate, isotp, obd
from services.can.errors import MalformedFrame

GRACE_S = 0.1
"""After the last answer to a request to everybody, so long for another. ISO 15765-4 gives each unit 50 ms."""

Send = Callable[[int, bytes], None]


class Exchange:
    """One request, and the answers that came: id of the unit's answers -> payload."""

    def __init__(self, request_id: int, payload: bytes, awaited: frozenset[int], *, first_only: bool) -> None:
        self.request_id, self.payload = request_id, payload
        self.awaited, self.first_only = awaited, first_only
        self.answers: dict[int, bytes] = {}
        self.done = threading.Event()

    def offer(self, answer_id: int, answer: bytes) -> None:
        """Take an answer that belongs to this request; others pass by."""
        if answer_id not in self.awaited or not obd.answers_to(self.payload, answer):
            return
        if answer[0] == 0x7F and answer[2] == obd.PENDING:
            return
        self.answers.setdefault(answer_id, answer)
        if self.first_only or self.answers.keys() >= self.awaited:
            self.done.set()

    def wait(self, timeout_s: float) -> bool:
        """Wait until answered, at most `timeout_s`; after some of many answered, no longer than `GRACE_S` for the
        next.
        """
        ends = time.monotonic() + timeout_s
        while (left := ends - time.monotonic()) > 0:
            before = len(self.answers)
            if self.done.wait(min(left, GRACE_S) if before else min(left, 0.01)):
                return True
            if before and len(self.answers) == before:
                return True
        return bool(self.answers)


class Diagnostics:
    """One request at a time leaves; every frame that comes back is offered to it."""

    def __init__(self, send: Send, ecus: Iterable[int]) -> None:
        self._send = send
        self._ecus = frozenset(request_id + 8 for request_id in ecus)
        self._turn = threading.Lock()
        self._open: Exchange | None = None
        self._parts: dict[int, isotp.Reassembly] = {}
        self.malformed = 0

    def on_frame(self, frame: CanFrame) -> None:
        """A frame from the bus; anything but an awaited answer is ignored."""
        exchange = self._open
        if exchange is None or frame.extended or frame.arbitration_id not in exchange.awaited:
            return
        parts = self._parts.setdefault(frame.arbitration_id, isotp.Reassembly())
        try:
            payload, flow = parts.feed(frame.data)
        except MalformedFrame:
            self.malformed += 1
            return
        if flow:
            self._transmit(frame.arbitration_id - 8, isotp.FLOW_CONTINUE)
        if payload:
            exchange.offer(frame.arbitration_id, payload)

    @contextmanager
    def request(
        self,
        request_id: int,
        payload: bytes,
        *,
        first_only: bool,
        timeout_s: float,
        clearing: bool = False,
        faults: bool = False,
    ) -> Iterator[Exchange]:
        """Send and hold the line; the caller waits on the exchange. Raises RequestRefused, TimeoutError where the
        line is taken.
        """
        if not self._turn.acquire(timeout=timeout_s):
            raise TimeoutError("another request is still waiting for its answer")
        try:
            yield self._begin(request_id, payload, first_only=first_only, clearing=clearing, faults=faults)
        finally:
            self._open = None
            self._turn.release()

    def start(self, request_id: int, payload: bytes) -> Exchange | None:
        """Send without waiting, for the worker thread; None where the line is taken. `finish` frees it."""
        if not self._turn.acquire(blocking=False):
            return None
        return self._begin(request_id, payload, first_only=False)

    def finish(self, exchange: Exchange) -> Mapping[int, bytes]:
        """End what `start` began: what was answered so far."""
        self._open = None
        self._turn.release()
        return exchange.answers

    def _begin(
        self, request_id: int, payload: bytes, *, first_only: bool, clearing: bool = False, faults: bool = False
    ) -> Exchange:
        awaited = self._ecus if request_id == gate.FUNCTIONAL_ID else frozenset({request_id + 8})
        exchange = Exchange(request_id, payload, awaited, first_only=first_only)
        self._parts.clear()
        self._open = exchange
        self._transmit(request_id, isotp.single_frame(payload), clearing=clearing, faults=faults)
        return exchange

    def _transmit(self, arbitration_id: int, data: bytes, *, clearing: bool = False, faults: bool = False) -> None:
        gate.check(arbitration_id, data, clearing=clearing, faults=faults)
        self._send(arbitration_id, data)

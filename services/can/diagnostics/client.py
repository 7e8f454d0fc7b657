"""Requests to control units and their answers, matched by id, service and parameter. Knows no bus."""

import contextlib
import threading
import time
from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

from proto.sensors import CanFrame
from services.can.diagnostics import gate, isotp, obd
from services.can.diagnostics.addresses import ANSWER_IDS, answer_id, functional_ids, is_extended, request_id
from services.can.diagnostics.exchange import GRACE_S, OWED_S, PART_S, Ended, Exchange, Responders
from services.can.errors import RequestRefused

Send = Callable[[int, bytes], None]
Clock = Callable[[], float]
Refused = Callable[[int, bytes, str], None]
"""Told of a frame that did not leave, and why."""


class Reply(NamedTuple):
    """Answers by the id they came on; how the waiting ended; the ids known to answer this that did not."""

    answers: Mapping[int, bytes]
    ended: Ended
    missing: tuple[int, ...] = ()


class Diagnostics:
    """One request at a time leaves; every frame that comes back is offered to it. `ecus`: physical request ids."""

    def __init__(
        self,
        send: Send,
        ecus: Iterable[int],
        pace: gate.Pace | None = None,
        *,
        owed_s: float = OWED_S,
        refused: Refused = lambda arbitration_id, data, reason: None,
    ) -> None:
        self._send, self._pace, self._owed_s, self._refused = send, pace or gate.Pace(), owed_s, refused
        units = frozenset(ecus)
        self.everybody = functional_ids(units)
        self.responders = Responders(frozenset(map(answer_id, units)))
        formats = {is_extended(each) for each in self.everybody}
        self._all = frozenset(each for each in ANSWER_IDS if is_extended(each) in formats)
        self._turn = threading.Lock()
        self._open: Exchange | None = None
        self._last: Exchange | None = None
        self._receivers: dict[int, isotp.Receiver] = {}
        self.malformed = 0
        """Frames of awaited units that were no part of any message."""

    def on_frame(self, frame: CanFrame) -> None:
        """A frame from the bus; anything but a part of an awaited answer is ignored."""
        unit, begins = frame.arbitration_id, isotp.beginning(frame.data)
        if frame.extended != is_extended(unit):
            return
        exchange = self._open
        if exchange is None:
            self._late(unit, begins)
        elif unit in exchange.awaited and (not begins or obd.answers_to(exchange.payload, begins)):
            self._take(exchange, unit, frame.data)

    def ask(
        self, payload: bytes, to: int | None = None, *, timeout_s: float, allowed: frozenset[int] = gate.NOTHING
    ) -> Reply:
        """Ask one unit by its physical id, or all units, and wait. An answer to a reading service that broke off is asked for once
        more.

        Raises RequestRefused; TimeoutError where the line stays taken.
        """
        if not self._turn.acquire(timeout=timeout_s):
            raise TimeoutError("another request is still waiting for its answer")
        try:
            exchange = self._begin(payload, to, allowed)
            ended = exchange.wait(timeout_s)
            found = dict(exchange.answers)
            for unit in sorted(exchange.broken - found.keys()) if payload[0] in gate.READING else ():
                again = self._begin(payload, request_id(unit), allowed)
                again.wait(timeout_s)
                found |= again.answers
        finally:
            self._close()
        return self._reply(exchange, found, ended)

    def start(self, payload: bytes, clock: Clock = time.monotonic) -> Exchange | None:
        """Ask all units without waiting, for the worker thread; `None` where the line is taken. `finish` frees it. `clock`:
        the seconds that patience is counted in.
        """
        if not self._turn.acquire(blocking=False):
            return None
        try:
            return self._begin(payload, None, gate.NOTHING, clock)
        except BaseException:
            self._close()
            raise

    def finish(self, exchange: Exchange) -> Mapping[int, bytes]:
        """End what `start` began: what was answered so far."""
        self._close()
        return exchange.answers

    def _begin(
        self, payload: bytes, to: int | None, allowed: frozenset[int], clock: Clock = time.monotonic
    ) -> Exchange:
        if not payload:
            raise RequestRefused("an empty request")
        ids = self.everybody if to is None else (to,)
        frame = isotp.single_frame(payload) if len(payload) <= 7 else payload
        for each in ids:
            self._check(each, frame, allowed)
        awaited = self._all if to is None else frozenset({answer_id(to)})
        self._receivers = {}  # a new one: the worker may still be feeding the last exchange's
        expected = self.responders.expected(payload) if to is None else awaited
        grace_s = self._owed_s if to is None and self.responders.owing(payload) else GRACE_S
        self._open = exchange = Exchange(payload, awaited, expected, grace_s, clock)
        for each in ids:
            self._wait_for_pace()
            self._send(each, frame)
        return exchange

    def _check(self, arbitration_id: int, data: bytes, allowed: frozenset[int] = gate.NOTHING) -> None:
        try:
            gate.check(arbitration_id, data, allowed)
        except RequestRefused as error:
            self._refused(arbitration_id, data, str(error))
            raise

    def _wait_for_pace(self) -> None:
        while (wait_s := self._pace.take(gate.RESERVE)) > 0.0:
            time.sleep(wait_s)

    def _reply(self, exchange: Exchange, found: Mapping[int, bytes], ended: Ended) -> Reply:
        owing = exchange.awaited
        if owing == self._all:
            owing = self.responders.owing(exchange.payload)
            self.responders.learn(exchange.payload, frozenset(found), ended)
        return Reply(found, ended, tuple(sorted(owing - found.keys())))

    def _take(self, exchange: Exchange, unit: int, data: bytes) -> None:
        receiver = self._receivers.get(unit)
        if receiver is None:
            receiver = self._receivers[unit] = isotp.Receiver(unit, self._flow)
        before, malformed = receiver.receiving, receiver.malformed
        whole = receiver.feed(data)
        self.malformed += receiver.malformed - malformed
        for payload in whole:
            exchange.offer(unit, payload)
        if receiver.receiving:
            exchange.patience(unit, PART_S)
        elif before and not whole:
            exchange.broke_off(unit)

    def _late(self, unit: int, begins: bytes) -> None:
        last = self._last
        if last and begins and unit in last.awaited - last.answers.keys() and obd.answers_to(last.payload, begins):
            self.responders.forget(last.payload)

    def _flow(self, arbitration_id: int, data: bytes) -> None:
        """Flow control is not waited for: without a frame to spare the answer breaks off and is asked for again."""
        self._check(arbitration_id, data)
        if self._pace.take() == 0.0:
            with contextlib.suppress(RequestRefused):  # the bus keeps the reason; the answer breaks off
                self._send(arbitration_id, data)
        else:
            self._refused(arbitration_id, data, "no frame to spare: the answer is asked for again")

    def _close(self) -> None:
        self._last, self._open = self._open, None
        self._turn.release()

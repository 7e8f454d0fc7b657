"""One request and the answers that came to it, by the times of ISO 15765-4 and ISO 14229-2."""

import threading
import time
from collections.abc import Callable
from typing import Literal

from services.can.diagnostics import obd
from services.can.diagnostics.obd import CODE_LISTS

Ended = Literal["answered", "quiet", "timeout"]
MAX_QUESTIONS = 512


class Responders:
    """The units that the profile lists, and those learned: the same units answered twice, and no other for a while.

    A unit that answers later than that, or again after a pause, makes its question unknown again.
    """

    def __init__(self, listed: frozenset[int]) -> None:
        self.listed = listed
        self._seen: dict[bytes, frozenset[int]] = {}
        self._learned: dict[bytes, frozenset[int]] = {}

    def expected(self, payload: bytes) -> frozenset[int]:
        """Ids on which answers to this question end the waiting; empty: unknown, only quiet ends it."""
        return self._learned.get(payload, self.listed)

    def owing(self, payload: bytes) -> frozenset[int]:
        """Ids whose silence means that something is missing: of lists of codes all that the profile lists, else those
        that were learned to answer this.
        """
        return self.listed if payload[0] in CODE_LISTS else self._learned.get(payload, frozenset())

    def learn(self, payload: bytes, answered: frozenset[int], ended: Ended) -> None:
        """How a question ended."""
        if ended == "answered" and not answered - self.expected(payload):
            return
        if len(self._seen) >= MAX_QUESTIONS:
            self._seen.clear()
            self._learned.clear()
        if answered and self._seen.get(payload) == answered:
            self._learned[payload] = answered
        else:
            self._learned[payload] = frozenset()
        self._seen[payload] = answered

    def forget(self, payload: bytes) -> None:
        """A unit answered late: until the question is learned again, only quiet ends the waiting."""
        self._learned[payload] = frozenset()
        self._seen.pop(payload, None)


GRACE_S = 0.1
"""After an answer to a request to all units, so long for another. ISO 15765-4 gives each unit 50 ms (P2)."""
OWED_S = 0.5
"""So long where one is still owed that is known to answer this: a computer under load is late, too."""
PENDING_S = 5.0
"""After "answer follows later", so long for the answer (P2*, ISO 14229-2)."""
PART_S = 1.0
"""After a part of an answer, so long for the next (N_Cr, ISO 15765-2)."""
LONGEST_S = 8.0
"""However often a unit asks for patience."""


class Exchange:
    """`awaited`: ids from which answers are taken; `expected`: those that end the waiting, empty where not known."""

    def __init__(
        self,
        payload: bytes,
        awaited: frozenset[int],
        expected: frozenset[int],
        grace_s: float = GRACE_S,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.payload, self.awaited, self.expected = payload, awaited, expected
        self.answers: dict[int, bytes] = {}
        self.broken: set[int] = set()
        """Units whose answer broke off."""
        self._grace_s, self._clock, self._changed = grace_s, clock, threading.Condition()
        self._under_way: dict[int, float] = {}
        self._started = self._heard = clock()

    @property
    def complete(self) -> bool:
        """Whether all units that were expected have answered, and no unit is still at it."""
        return bool(self.expected) and self.answers.keys() >= self.expected and not self._under_way

    def offer(self, answer_id: int, answer: bytes) -> None:
        """Take a whole answer that belongs to this request; others pass by. The first of a unit counts."""
        if not obd.answers_to(self.payload, answer):
            return
        if obd.is_pending(answer):
            self.patience(answer_id, PENDING_S)
            return
        with self._changed:
            self.answers.setdefault(answer_id, answer)
            self.broken.discard(answer_id)
            self._heard = self._clock()
            self._under_way.pop(answer_id, None)
            self._changed.notify_all()

    def patience(self, answer_id: int, seconds: float) -> None:
        """This unit is at it; it has so long from now."""
        with self._changed:
            self._heard = self._clock()
            self._under_way[answer_id] = self._heard + seconds
            self._changed.notify_all()

    def broke_off(self, answer_id: int) -> None:
        """What this unit had begun will not be whole."""
        with self._changed:
            self.broken.add(answer_id)
            self._under_way.pop(answer_id, None)
            self._changed.notify_all()

    def wait(self, timeout_s: float) -> Ended:
        """Wait until complete, or quiet where some have answered; else `timeout_s`, or while a unit is still at it."""
        with self._changed:
            while not self.complete:
                left_s = self._ends(timeout_s) - self._clock()
                if left_s <= 0.0:
                    self.broken |= self._under_way.keys()
                    return "quiet" if self.answers else "timeout"
                self._changed.wait(left_s)
        return "answered"

    def over(self, timeout_s: float) -> bool:
        """Whether nothing more is to be waited for, for a caller that does not wait but looks again; also when the clock fell back."""
        latest = min(max([self._started + timeout_s, *self._under_way.values()]), self._started + LONGEST_S)
        return self.complete or not self._started <= self._clock() < latest

    def _ends(self, timeout_s: float) -> float:
        latest = self._started + timeout_s
        ends = min(self._heard + self._grace_s, latest) if self.answers or self.broken else latest
        return min(max([ends, *self._under_way.values()]), self._started + LONGEST_S)

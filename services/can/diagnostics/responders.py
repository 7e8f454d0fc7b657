"""Which units answer which request: how a question to everybody knows that it is answered."""

from typing import Literal

from services.can.diagnostics.obd import CODE_LISTS

Ended = Literal["answered", "quiet", "timeout"]
MAX_QUESTIONS = 512


class Responders:
    """What the profile lists, and what was learned: the same units twice, and then nobody for a while.

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
        """Somebody answered late: until it is learned again, only quiet ends the waiting."""
        self._learned[payload] = frozenset()
        self._seen.pop(payload, None)

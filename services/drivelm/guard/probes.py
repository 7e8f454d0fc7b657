"""Does the answer depend on the picture? Now and then the same question is asked of a blank picture, or of another sign's.

A backend that sees answers such a question otherwise. The first question whose answer is believed is probed, then every
tenth, never twice in a second. No probe is made while those made exceed a fiftieth of all pictures asked about. While the
answers are not to be trusted, probes are made as often as second and budget allow.
"""

from collections import OrderedDict, deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from services.drivelm.reading.crops import Picture
from services.drivelm.vocabulary.classes import OTHER

EVERY = 10
PAUSE_NS = 1_000_000_000
BUDGET = 1 / 50
"""Probes per picture asked about, at most."""
WINDOW = 4
UNMOVED = 0.5
"""From this probability on, the same reading of a picture that does not show it is no reading of pictures."""
KEPT = 8
NOT_PROBED = frozenset({OTHER, "light:off", "led:blank"})
"""What a blank picture may well be taken for."""


class Settled(NamedTuple):
    """A question whose answer is believed: of which track, what was asked, what was shown, what was read."""

    key: tuple[str, int]
    question: str
    image: Picture
    reading: str


class Probe(NamedTuple):
    """A question to be asked of a picture that does not show what was read."""

    settled: Settled
    image: Picture
    what: str


class Probes:
    """When to probe one backend, with what, and how it stood the test so far."""

    def __init__(self) -> None:
        self.asked = 0
        """Pictures that the backend was asked about."""
        self.made = 0
        self.passed: deque[bool] = deque(maxlen=WINDOW)
        self._questions = 0
        self._next = 1
        self._last_ns: int | None = None
        self._others: OrderedDict[tuple[str, str], Picture] = OrderedDict()

    @property
    def stands(self) -> bool:
        """Whether the answers are taken to depend on pictures: more of the last probes passed than failed."""
        return not self.passed or 2 * sum(self.passed) > len(self.passed)

    def choose(self, settled: Sequence[Settled], stamp_ns: int) -> Probe | None:
        """Count questions whose answers are believed; the probe that is due, if one is."""
        fit = [each for each in settled if each.reading not in NOT_PROBED]
        self._questions += len(fit)
        due = bool(fit) and (self._questions >= self._next or not self.stands) and self._may(stamp_ns)
        probe = self._made(fit[self.made % len(fit)], stamp_ns) if due else None
        for each in fit:
            self._keep(each)
        return probe

    def answered(self, probe: Probe, readings: Sequence[tuple[str, float]]) -> bool:
        """Whether the answer changed with the picture."""
        changed = dict(readings).get(probe.settled.reading, 0.0) < UNMOVED
        self.passed.append(changed)
        return changed

    def _may(self, stamp_ns: int) -> bool:
        rested = self._last_ns is None or abs(stamp_ns - self._last_ns) >= PAUSE_NS
        return rested and self.made <= BUDGET * self.asked

    def _made(self, settled: Settled, stamp_ns: int) -> Probe:
        self._last_ns, self._next = stamp_ns, self._questions + EVERY
        self.made += 1
        other = self._other(settled) if self.made % 2 == 0 else None
        if other is not None:
            return Probe(settled, other, "another picture")
        return Probe(settled, blank(settled.image), "a blank picture")

    def _other(self, settled: Settled) -> Picture | None:
        """The newest picture kept of something else that was asked about in the same words."""
        fitting = [
            image
            for (question, reading), image in reversed(self._others.items())
            if question == settled.question and reading != settled.reading
        ]
        return fitting[0] if fitting else None

    def _keep(self, settled: Settled) -> None:
        slot = (settled.question, settled.reading)
        self._others[slot] = settled.image
        self._others.move_to_end(slot)
        if len(self._others) > KEPT:
            self._others.popitem(last=False)


def blank(image: Picture) -> Picture:
    """A picture of the same size and mean colour that shows nothing."""
    return np.broadcast_to(image.mean(axis=(0, 1)).astype(np.uint8), image.shape).copy()

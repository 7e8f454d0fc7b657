"""What a language model said, taken as one known sentence on the question asked, or as an abstention with its reason."""

import logging
import math
from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from services.drivelm.backends.backend import NO_ANSWER, Answer
from services.drivelm.vocabulary.classes import KIND_OF_QUESTION, OTHER, WORDS
from services.drivelm.vocabulary.parser import parse
from services.drivelm.vocabulary.text import cleaned

OFFERED = {kind: tuple(classes) for kind, classes in WORDS.items()}
"""Kind of box to the classes that an answer about it may name, besides `other`."""

UNMEASURED = 0.5
"""Score of an answer without token probabilities. Below what makes a frame count as clear (``evidence.CLEAR``, 0.75)
and below the orchestrator's SURE (0.6): by itself it can never make a reading believed; see ``late_front_end.Agreement``."""
_SAID_CHARS = 60
_HEADS = {kind: frozenset(label.partition(":")[0] for label in labels) for kind, labels in OFFERED.items()}


class Said(NamedTuple):
    """An answer's text and its probability (None: not stated), or the reason for no answer."""

    text: str = ""
    score: float | None = None
    reason: str = ""


class Abstentions:
    """Counts and logs why a backend abstained: the first time and at each power of ten, so that no log floods."""

    def __init__(self, backend: str, log: logging.Logger) -> None:
        self._backend, self._log = backend, log
        self.counts: Counter[str] = Counter()

    def note(self, reason: str, detail: str = "") -> Answer:
        """Count, and give back the abstention. `reason` is one of few words, `detail` is cleaned before it is logged."""
        self.counts[reason] += 1
        count = self.counts[reason]
        if count == 10 ** round(math.log10(count)):
            said = f": {cleaned(detail, _SAID_CHARS)!r}" if detail else ""
            self._log.warning("%s abstains (%s, %d so far)%s", self._backend, reason, count, said)
        return NO_ANSWER


def judged(text: str, question: str, score: float | None, abstentions: Abstentions) -> Answer:
    """The answer if `text` is one known sentence of the kind that was asked for; otherwise an abstention.

    `score` is the model's probability of the text, or None where it gave none.
    """
    kind, statement = KIND_OF_QUESTION.get(question), parse(text)
    if kind is None or statement is None:
        return abstentions.note("no known sentence", text)
    if statement.reading != OTHER and statement.reading.partition(":")[0] not in _HEADS[kind]:
        return abstentions.note(f"not about a {kind}", text)
    if score is None:
        return Answer(text, UNMEASURED, measured=False)
    return Answer(text, score)


def probability(log_probabilities: Sequence[float]) -> float | None:
    """The product of token probabilities: how probable the model holds this text. `None` unless all are log-probabilities."""
    if not log_probabilities or not all(math.isfinite(each) and each <= 1e-6 for each in log_probabilities):
        return None
    return min(1.0, math.exp(math.fsum(log_probabilities)))

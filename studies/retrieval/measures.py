"""Recall, discounted gain and refusal of a ranking, on labelled questions."""

import math
from collections.abc import Callable, Iterable, Sequence

import msgspec

from training.retrieval.questions import Question

DEPTH = 10
RECALL_AT = 5
BINS = 10
Ranking = Callable[[Question], Sequence[str]]
"""Names of the passages found for a question, the best first; none: it was refused."""


class Measured(msgspec.Struct, frozen=True, kw_only=True):
    """One ranking on one set of questions."""

    questions: int
    recall: float
    """Share of the questions with an answer among the first five."""
    rank: float
    """Mean reciprocal rank of the first right passage."""
    gain: float
    """nDCG at ten, where any of the expected passages answers: the discount of the first one's place."""
    refused: float
    """Share of the questions without an answer in the law that were refused."""
    wrongly_refused: float
    """Share of the others that were refused."""


def measure(ranking: Ranking, questions: Iterable[Question]) -> Measured:
    """Ask all questions. A set without questions of a kind gives NaN for that kind."""
    asked = [(question, tuple(ranking(question))[:DEPTH]) for question in questions]
    inside = [(question.expect, found) for question, found in asked if question.expect]
    outside = [found for question, found in asked if not question.expect]
    return Measured(
        questions=len(asked),
        recall=_mean(float(bool(set(found[:RECALL_AT]) & set(expect))) for expect, found in inside),
        rank=_mean(reciprocal_rank(expect, found) for expect, found in inside),
        gain=_mean(discounted_gain(expect, found) for expect, found in inside),
        refused=_mean(float(not found) for found in outside),
        wrongly_refused=_mean(float(not found) for _, found in inside),
    )


def reciprocal_rank(expect: Sequence[str], found: Sequence[str]) -> float:
    """1 where the first is an expected one, 0.5 for the second place, and so on; 0 where none is."""
    return next((1.0 / (place + 1) for place, name in enumerate(found) if name in expect), 0.0)


class Calibration(msgspec.Struct, frozen=True, kw_only=True):
    """How well confidences tell right first passages from wrong ones, on the questions that were answered."""

    answered: int
    said: float
    """Mean confidence."""
    right: float
    """Share of right first passages; of a question without an answer none is right."""
    error: float
    """Expected calibration error, ten bins of equal width."""
    told: float
    """How often a right answer has more confidence than a wrong one (area under the ROC curve)."""


def calibration(confidences: Sequence[tuple[float, bool]]) -> Calibration:
    """From the confidence of each answer and whether its first passage is right."""
    bins: dict[int, list[tuple[float, bool]]] = {}
    for each in confidences:
        bins.setdefault(min(int(each[0] * BINS), BINS - 1), []).append(each)
    off = [abs(sum(said for said, _ in each) - sum(right for _, right in each)) for each in bins.values()]
    right, wrong = ([said for said, truth in confidences if truth is kind] for kind in (True, False))
    return Calibration(
        answered=len(confidences),
        said=_mean(said for said, _ in confidences),
        right=_mean(float(truth) for _, truth in confidences),
        error=sum(off) / len(confidences) if confidences else math.nan,
        told=_mean((a > b) + 0.5 * (a == b) for a in right for b in wrong),
    )


def discounted_gain(expect: Sequence[str], found: Sequence[str]) -> float:
    """1 where the first is an expected one, 0.63 for the second place, and so on; 0 where none is."""
    return next((1.0 / math.log2(place + 2) for place, name in enumerate(found) if name in expect), 0.0)


def _mean(values: Iterable[float]) -> float:
    known = list(values)
    return sum(known) / len(known) if known else math.nan

"""The scores of a whole file: which metric each question counts under, and the table."""

import re
from collections.abc import Sequence
from statistics import fmean

import msgspec

from services.drivelm.graph.tags import points
from studies.gvqa.coordinates import f1
from studies.gvqa.language import bleu, cider, normalised, rouge_l, words
from studies.gvqa.pairing import Oddities, Pair

EXACT, JUDGED, LANGUAGE, MATCH = 0, 1, 2, 3
"""The challenge's numbers of its metrics; JUDGED needs a language model's opinion and is counted, not scored."""
_CLOSED = re.compile(r"(yes|no|[a-d])\.?", re.IGNORECASE)
_CHOICE = re.compile(r"what is the moving status|select the correct answer|predict the behavior", re.IGNORECASE)


class Score(msgspec.Struct, frozen=True, kw_only=True):
    """One metric over its questions; None: nothing was asked."""

    metric: str
    asked: int
    answered: int
    score: float | None
    lenient: float | None = None
    """Exact match of answers after `normalised`; None: the metric has no lenient form."""


class Report(msgspec.Struct, frozen=True, kw_only=True):
    """Everything that is told."""

    scores: tuple[Score, ...]
    asked: int
    answered: int
    judged: int
    """Questions the challenge has a language model judge; not scored here."""
    oddities: Oddities


def metrics_of(one: Pair) -> tuple[int, ...]:
    """The metrics of the question's own tags; without tags, the one that fits its form."""
    if one.asked.tags:
        return one.asked.tags
    if points(one.asked.answer):
        return (MATCH,)
    closed = _CLOSED.fullmatch(one.asked.answer.strip()) or _CHOICE.search(one.asked.place.question)
    return (EXACT,) if closed else (LANGUAGE,)


def report(pairs: Sequence[Pair], oddities: Oddities) -> Report:
    """The table. A question without an answer scores 0 in its metric."""
    under = {metric: [one for one in pairs if metric in metrics_of(one)] for metric in (EXACT, JUDGED, LANGUAGE, MATCH)}
    return Report(
        scores=(_exact(under[EXACT]), _match(under[MATCH]), *_language(under[LANGUAGE])),
        asked=len(pairs),
        answered=_answered(pairs),
        judged=len(under[JUDGED]),
        oddities=oddities,
    )


def _exact(pairs: Sequence[Pair]) -> Score:
    strict = _score("exact match", pairs, [float(one.answer == one.asked.answer) for one in pairs])
    alike = [float(one.answer is not None and normalised(one.answer) == normalised(one.asked.answer)) for one in pairs]
    return msgspec.structs.replace(strict, lenient=round(fmean(alike), 6) if alike else None)


def _match(pairs: Sequence[Pair]) -> Score:
    each = [f1(points(one.answer or ""), points(one.asked.answer)) for one in pairs]
    return _score("coordinate match F1", pairs, each)


def _language(pairs: Sequence[Pair]) -> list[Score]:
    said, wanted = [words(one.answer or "") for one in pairs], [words(one.asked.answer) for one in pairs]
    over_all = [[bleu(said, wanted, order)] if pairs else [] for order in (1, 2, 3, 4)]
    return [
        *(_score(f"BLEU-{order}", pairs, value) for order, value in enumerate(over_all, 1)),
        _score("ROUGE-L", pairs, [rouge_l(*both) for both in zip(said, wanted, strict=True)]),
        _score("CIDEr", pairs, cider(said, wanted)),
    ]


def _score(metric: str, pairs: Sequence[Pair], values: Sequence[float]) -> Score:
    return Score(
        metric=metric, asked=len(pairs), answered=_answered(pairs), score=round(fmean(values), 6) if values else None
    )


def _answered(pairs: Sequence[Pair]) -> int:
    return sum(one.answer is not None for one in pairs)

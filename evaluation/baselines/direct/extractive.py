"""The reader without a language model: it picks the sentence of a prompt that shares most words with the query."""

from collections.abc import Sequence
from typing import NamedTuple

from evaluation.baselines.direct.parsed_advice import Advice, advice_of, careful, sentences
from evaluation.baselines.direct.template import Asked
from services.drivelm.graph.answering import words

LEAST_SHARED = 0.1
"""Below this share (F1 of words) a sentence has nothing to do with the query."""


class _Sentence(NamedTuple):
    text: str
    shares: float
    advice: Advice

    @property
    def advises(self) -> bool:
        return self.advice.action != "none"


def extracted(asked: Asked) -> tuple[str, float]:
    """The sentence that shares most with the query, and how much (F1 of words); of equals the most careful, then the first."""
    wanted = words(asked.query)
    context, passages = _sharing(wanted, (asked.context, *asked.tools)), _sharing(wanted, asked.passages)
    if any(each.advises for each in context):
        passages = [each for each in passages if each.advises]
    found = min((*context, *passages), key=lambda each: (-each.shares, careful(each.advice)), default=None)
    return (found.text, round(found.shares, 4)) if found is not None else ("", 0.0)


def _sharing(wanted: frozenset[str], parts: Sequence[str]) -> list[_Sentence]:
    """The sentences that have something to do with the query."""
    told = (_Sentence(each, _f1(wanted, words(each)), advice_of(each)) for part in parts for each in sentences(part))
    return [each for each in told if each.shares > LEAST_SHARED]


def _f1(wanted: frozenset[str], held: frozenset[str]) -> float:
    return 2.0 * len(wanted & held) / (len(wanted) + len(held)) if wanted and held else 0.0

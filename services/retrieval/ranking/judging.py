"""How far an answer is to be trusted: whether the question is about traffic law, and whether the first passage is the right one.

Two logistic models on a few facts of a ranking; the first has a direction among the question's vectors too. Their numbers
stand in `judges.json`, fitted by `python -m training retrieval.tune`.
"""

import math
from collections.abc import Sequence

import msgspec
import numpy as np

from proto.rules import Passage
from services.retrieval.encoding.encoders import Vectors

LOOKED_AT = 5
"""So many passages are looked at, however few are asked for."""
FAR = 6.0
"""Log odds beyond which a question is as good as surely inside or outside."""


class Facts(msgspec.Struct, frozen=True, kw_only=True):
    """What is known of a ranking without knowing the answer. Each about 0 to 1."""

    score: float
    bm25: float
    cosine: float
    """The best cosine above 0.8, five times."""
    known: float
    """Share of the question's words that the passages, or the table of everyday words, know."""
    score_known: float
    matters: float
    """Matters of the table of everyday words that the question speaks of; four or more: 1."""
    lead: float
    """Of the first over the second, by score; by share of the score; by BM25; by cosine; over the fifth by score."""
    lead_share: float
    lead_bm25: float
    lead_cosine: float
    lead_fifth: float

    @property
    def row(self) -> tuple[float, ...]:
        """As numbers, in the order of the fields."""
        return tuple(getattr(self, name) for name in self.__struct_fields__)


class Model(msgspec.Struct, frozen=True, kw_only=True):
    """Log odds as a weighted sum."""

    bias: float
    facts: tuple[float, ...]
    probe: tuple[float, ...] = ()
    """By dimension of the question's vector; none: it is not looked at."""

    def odds(self, row: Sequence[float], vector: Vectors | None = None) -> float:
        """Log odds."""
        seen = 0.0 if vector is None or not self.probe else float(np.dot(self.probe, vector))
        return self.bias + math.fsum(weight * each for weight, each in zip(self.facts, row, strict=True)) + seen


class Judge(msgspec.Struct, frozen=True, kw_only=True):
    """For one encoder."""

    scope: Model
    """Whether the question is about traffic law."""
    line: float
    """Log odds below which it is refused."""
    right: Model
    """Whether the first passage answers; its last fact is the first model's log odds, as a share of FAR."""

    def scoped(self, facts: Facts, vector: Vectors | None) -> float:
        """Log odds that the question is about traffic law."""
        return self.scope.odds(facts.row, vector)

    def confidence(self, facts: Facts, scoped: float) -> float:
        """The probability that the first passage answers."""
        return 1.0 / (1.0 + math.exp(-self.right.odds((*facts.row, clipped(scoped)))))


def clipped(odds: float) -> float:
    """Log odds from -FAR to FAR as -1 to 1."""
    return min(max(odds / FAR, -1.0), 1.0)


def observed(found: Sequence[Passage], known: float, matters: int) -> Facts:
    """The facts of a ranking, the best first; of one without passages all are 0."""
    if not found:
        return Facts(**dict.fromkeys(Facts.__struct_fields__, 0.0))
    first, others = found[0], found[1:LOOKED_AT]
    second = others[0].score if others else 0.0
    fifth = found[LOOKED_AT - 1].score if len(found) >= LOOKED_AT else 0.0
    cosines = [passage.cosine or 0.0 for passage in found[:LOOKED_AT]]
    return Facts(
        score=first.score,
        bm25=first.bm25,
        cosine=5.0 * (max(cosines) - 0.8) if first.cosine is not None else 0.0,
        known=known,
        score_known=first.score * known,
        matters=min(matters, 4) / 4,
        lead=first.score - second,
        lead_share=(first.score - second) / first.score if first.score > 0.0 else 0.0,
        lead_bm25=first.bm25 - max((passage.bm25 for passage in others), default=0.0),
        lead_cosine=5.0 * (cosines[0] - max(cosines[1:], default=0.0)) if others else 0.0,
        lead_fifth=first.score - fifth,
    )

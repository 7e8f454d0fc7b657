"""Fits the judges of `services/retrieval/ranking/judging.py` on development questions: logistic regressions of scikit-learn.

The log odds that the second model sees, and the line of refusal, come from cross-validation: a model flatters the
questions it was fitted on.
"""

from collections.abc import Callable, Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from services.retrieval.encoding.encoders import Vectors
from services.retrieval.library import Library, Wanted
from services.retrieval.ranking.judging import Facts, Judge, Model, clipped
from services.rules.lookup.rule_lookup import corpus_for
from training.retrieval.questions import Question, asked

SEED = 1
FOLDS = 10
SPREAD = 6.0
"""A question's vector, less the mean, is multiplied by this: its numbers are as large as the facts then."""
INVERSE_PENALTY = 1.0
WRONGLY_REFUSED = 0.015
"""Share of the questions with an answer that may be refused, so that those without are."""


def as_retrieve(query: str) -> Wanted:
    """The texts that `retrieve` searches for a question."""
    return "all"


ASKED: tuple[Callable[[str], Wanted], ...] = (as_retrieve, corpus_for)
"""By the tools that ask: `retrieve` and `lookup_rule`."""

Numbers = NDArray[np.float64]
Truths = NDArray[np.bool_]


class Case(msgspec.Struct, frozen=True):
    """One question asked of a library that refuses nothing."""

    facts: Facts
    vector: Vectors | None
    inside: bool
    right: bool


def cases(library: Library, questions: Sequence[Question]) -> list[Case]:
    """Each question asked of all texts, as `retrieve` does, and as `lookup_rule` asks it."""
    return [_case(library, question, corpus) for corpus in ASKED for question in questions]


def fitted(found: Sequence[Case]) -> Judge:
    """The judge for the encoder that ranked these; each question stands there once in each half."""
    facts = np.array([case.facts.row for case in found])
    vectors = None if found[0].vector is None else np.array([case.vector for case in found], dtype=np.float64)
    inside = np.array([case.inside for case in found])
    groups = np.arange(len(found)) % (len(found) // 2)  # both askings of a question in one fold
    scoped = _unseen(facts, vectors, inside, groups)
    line = float(np.sort(scoped[inside])[int(WRONGLY_REFUSED * inside.sum())]) - 1e-4
    answered = scoped >= line
    seen = np.column_stack([facts, [clipped(odds) for odds in scoped]])[answered]
    right = np.array([case.right for case in found])[answered]
    return Judge(scope=_model(facts, vectors, inside), line=round(line, 4), right=_model(seen, None, right))


def _case(library: Library, question: Question, corpus: Callable[[str], Wanted]) -> Case:
    request = msgspec.structs.replace(asked(question), corpus=corpus(question.query))
    facts, vector = library.observe(request)
    found = library.search(request).passages
    right = bool(found) and found[0].passage_id.split("/")[1] in question.expect
    return Case(facts, vector, bool(question.expect), right)


def _unseen(facts: Numbers, vectors: Numbers | None, inside: Truths, groups: NDArray[np.intp]) -> Numbers:
    """Log odds of each by a model that was fitted on the others."""
    fold = np.random.default_rng(SEED).permutation(groups.max() + 1)[groups] % FOLDS
    odds = np.zeros(len(facts))
    for number in range(FOLDS):
        rest, here = fold != number, np.flatnonzero(fold == number)
        model = _model(facts[rest], None if vectors is None else vectors[rest], inside[rest])
        for at in here:
            odds[at] = model.odds(facts[at], None if vectors is None else vectors[at].astype(np.float32))
    return odds


def _model(facts: Numbers, vectors: Numbers | None, truth: Truths) -> Model:
    from sklearn.linear_model import LogisticRegression

    mean = np.zeros(0) if vectors is None else vectors.mean(axis=0)
    rows = facts if vectors is None else np.hstack([facts, (vectors - mean) * SPREAD])
    fit = LogisticRegression(C=INVERSE_PENALTY, max_iter=5000).fit(rows, truth)
    weights, probe = fit.coef_[0][: facts.shape[1]], fit.coef_[0][facts.shape[1] :] * SPREAD
    bias = round(float(fit.intercept_[0]) - float(probe @ mean), 4)
    return Model(bias=bias, facts=_rounded(weights), probe=_rounded(probe))


def _rounded(weights: Numbers) -> tuple[float, ...]:
    return tuple(round(float(weight), 3) for weight in weights)

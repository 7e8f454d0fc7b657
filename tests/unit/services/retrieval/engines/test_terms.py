"""Sparse vectors of words: their dot products are rank-bm25's scores."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from rank_bm25 import BM25Okapi

from drivemcp.paths import data
from services.retrieval.corpus import read_pack
from services.retrieval.engines.terms import Terms
from services.retrieval.ranking.analysis import Analyser

TEXTS = [text.indexed for text in read_pack(data("rulepacks/GBR-v1")) if text.language == "en"]
PLACES = np.arange(len(TEXTS), dtype=np.intp)
TERMS = Terms("en", PLACES, TEXTS, first=1000)
QUESTIONS = ["speed limit on a motorway in fog", "zebra crossing", "sign 616 no entry", "limit limit limit", "", "zzzz"]


def by_rank_bm25(texts: list[str], question: str) -> list[float]:
    analyser = Analyser("en", texts)
    scores = BM25Okapi([analyser.of_passage(text) or ["-"] for text in texts]).get_scores(
        analyser.of_question(question)
    )
    return [float(score) for score in scores]


@pytest.mark.parametrize("question", QUESTIONS)
def test_scores_are_those_of_rank_bm25(question: str) -> None:
    scores = np.zeros(len(TEXTS))
    TERMS.score(question, scores)
    assert scores.tolist() == pytest.approx(by_rank_bm25(TEXTS, question), abs=1e-4)


@pytest.mark.parametrize("question", QUESTIONS)
def test_the_dot_product_of_question_and_passage_is_the_score(question: str) -> None:
    scores = np.zeros(len(TEXTS))
    TERMS.score(question, scores)
    asked = dict(zip(*(part.tolist() for part in TERMS.of_question(question)), strict=True))
    for place in range(len(TEXTS)):
        terms, values = TERMS.of_passage(place)
        product = sum(asked.get(term, 0.0) * value for term, value in zip(terms.tolist(), values.tolist(), strict=True))
        assert product == pytest.approx(scores[place], abs=1e-4)


def test_numbers_of_terms_begin_where_another_language_ends() -> None:
    terms, _ = TERMS.of_passage(0)
    assert terms.min() >= 1000
    assert terms.max() < 1000 + len(TERMS)


@given(st.lists(st.text("ab cd", max_size=12), min_size=1, max_size=8), st.text("ab cd", max_size=12))
def test_any_texts_score_as_by_rank_bm25(texts: list[str], question: str) -> None:
    scores = np.zeros(len(texts))
    Terms("en", np.arange(len(texts), dtype=np.intp), texts).score(question, scores)
    assert scores.tolist() == pytest.approx(by_rank_bm25(texts, question), abs=1e-4)

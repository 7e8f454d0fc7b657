"""How sure an answer is: by the lead of the first passage and by what the question is about."""

import numpy as np
import pytest

from proto.rules import Passage
from services.retrieval.ranking.judging import FAR, Facts, Judge, Model, clipped, observed

NOTHING = (0.0,) * len(Facts.__struct_fields__)


def passage(score: float, bm25: float = 0.5, cosine: float | None = 0.9) -> Passage:
    return Passage(
        passage_id="P/p/en", document="d", start=0, end=1, excerpt="e", section="s", kind="statute",
        score=score, bm25=bm25, cosine=cosine, rulepack_version="v",
    )  # fmt: skip


def test_the_facts_of_a_ranking_are_its_scores_and_its_leads() -> None:
    facts = observed([passage(0.8, 0.9, 0.95), passage(0.6, 0.7, 0.9)], known=0.5, matters=9)
    assert (facts.score, facts.matters) == (0.8, 1.0)
    assert facts.score_known == pytest.approx(0.4)
    assert facts.lead == pytest.approx(0.2)
    assert facts.lead_share == pytest.approx(0.25)
    assert facts.lead_bm25 == pytest.approx(0.2)
    assert facts.lead_cosine == pytest.approx(0.25)


def test_a_ranking_without_passages_or_without_vectors_has_zeros() -> None:
    assert observed([], 1.0, 3).row == NOTHING
    assert observed([passage(0.8, cosine=None)], 1.0, 3).cosine == 0.0


def test_a_question_far_from_the_law_is_below_the_line_and_its_answer_little_trusted() -> None:
    flat = Model(bias=0.0, facts=NOTHING, probe=(1.0, -1.0))
    judge = Judge(scope=flat, line=0.0, right=Model(bias=0.0, facts=(*NOTHING, 2.0)))
    facts = observed([passage(0.8)], 1.0, 0)
    near, far = (judge.scoped(facts, np.array(each, dtype=np.float32)) for each in ((1.0, 0.0), (0.0, 1.0)))
    assert near > judge.line > far
    assert judge.confidence(facts, near) > 0.5 > judge.confidence(facts, far)


def test_without_a_vector_the_facts_alone_decide() -> None:
    assert Model(bias=0.25, facts=NOTHING, probe=(1.0,)).odds(NOTHING) == 0.25


@pytest.mark.parametrize(("odds", "share"), [(FAR, 1.0), (2 * FAR, 1.0), (-9 * FAR, -1.0), (0.0, 0.0)])
def test_odds_beyond_reason_count_no_more(odds: float, share: float) -> None:
    assert clipped(odds) == share

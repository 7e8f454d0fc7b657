"""Ranking: the jurisdiction first, then BM25 and cosine, each provision once, repeats from memory."""

import shutil
import threading
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from drivemcp.paths import data
from services.retrieval.encoding.encoders import Vectors
from services.retrieval.encoding.question_vectors import MAX_ENCODED
from services.retrieval.library import ABSENT, LATE, LOADING, Library, Request
from services.retrieval.ranking.filters import Filter
from services.retrieval.ranking.index import Index, normalised, stretched
from services.retrieval.ranking.tuning import Tuning, read_tuning
from tests.unit.services.retrieval.support import WordEncoder

FOLDERS = tuple(data(f"rulepacks/{name}") for name in ("DEU-v1", "DEU-v1-VSL", "GBR-v1"))


def library(lambda_: float = 0.5) -> Library:
    return Library(FOLDERS, Tuning(lambdas={"word": {"statutes": lambda_, "signs": lambda_}}), status=LOADING)


@pytest.fixture(scope="module")
def both() -> Library:
    made = library()
    made.use(WordEncoder())
    return made


def names(made: Library, query: str, **how: object) -> list[str]:
    found = made.search(Request(query=query, **how))  # type: ignore[arg-type]
    return [passage.passage_id.split("/")[1] for passage in found.passages]


def test_bm25_answers_at_once_and_says_that_the_encoder_is_loading() -> None:
    found = library().search(
        Request(query="visibility cut by fog, no more than 50 km/h", jurisdiction="DEU", language="en")
    )
    assert found.encoder == LOADING
    assert found.lambda_ == 0.0
    assert found.passages[0].passage_id == "DEU-v1/deu-speed-visibility/en"
    assert found.passages[0].cosine is None


def test_with_an_encoder_the_score_is_the_mix_the_paper_gives(both: Library) -> None:
    found = both.search(Request(query="pedestrian at a zebra", jurisdiction="GBR", corpus="statutes"))
    assert found.encoder == "word-1.0"
    for passage in found.passages:
        assert passage.cosine is not None
        assert passage.score == pytest.approx(0.5 * passage.bm25 + 0.5 * min(max(passage.cosine, 0.0), 1.0), abs=1e-6)


@pytest.mark.parametrize(("lambda_", "same_as_bm25"), [(0.0, True), (1.0, False)])
def test_lambda_weighs_the_cosine(lambda_: float, same_as_bm25: bool) -> None:
    made = library(lambda_)
    request = Request(query="trailer speed on a country road", jurisdiction="DEU", language="en", k=8)
    bm25 = [passage.passage_id for passage in made.search(request).passages]
    made.use(WordEncoder())
    assert ([passage.passage_id for passage in made.search(request).passages] == bm25) is same_as_bm25


def test_other_countries_are_left_out_before_ranking(both: Library) -> None:
    for country in ("DEU", "GBR"):
        found = both.search(Request(query="roundabout priority", jurisdiction=country, k=20))
        assert found.passages
        assert all(passage.passage_id.startswith(country) for passage in found.passages)
    assert {p.passage_id[:3] for p in both.search(Request(query="roundabout", k=20)).passages} == {"DEU", "GBR"}
    assert both.search(Request(query="roundabout", jurisdiction="FRA")).passages == ()


def test_a_country_without_a_pack_is_answered_from_the_conventions_and_a_part_belongs_to_its_country() -> None:
    made = Library(
        tuple(data(f"rulepacks/{name}") for name in ("DEU-v1", "USA-CA-v1", "VIENNA-v1")),
        Tuning(lambdas={}),
        status=ABSENT,
    )
    found = {
        country: {
            p.passage_id.split("/")[0] for p in made.search(Request(query="stop sign", jurisdiction=country)).passages
        }
        for country in ("PRT", "USA", "USA-CA", "USA-NV", "DEU")
    }
    american = {"USA-CA-v1"}
    assert found == {"PRT": {"VIENNA-v1"}, "USA": american, "USA-CA": american, "USA-NV": american, "DEU": {"DEU-v1"}}


def test_a_part_with_a_pack_is_answered_from_it_and_from_what_it_leaves_of_its_countrys() -> None:
    names = ("USA-v1", "USA-CA-v1", "VIENNA-v1")
    made = Library(tuple(data(f"rulepacks/{name}") for name in names), Tuning(lambdas={}), status=ABSENT)

    def found(query: str, place: str | None) -> list[str]:
        return [
            p.passage_id for p in made.search(Request(query=query, jurisdiction=place, language="en", k=20)).passages
        ]

    assert "USA-CA-v1/usa-ca-school-bus/en" in found("school bus", "USA-CA")
    assert "USA-v1/usa-school-bus/en" not in found("school bus", "USA-CA")
    assert "USA-v1/usa-fed-hours/en" in found("hours of service, rest break", "USA-CA")
    for place in ("USA", "USA-NV"):
        assert {name.partition("/")[0] for name in found("school bus", place)} == {"USA-v1"}
    everywhere = found("hours of service, rest break", None)
    assert everywhere.count("USA-v1/usa-fed-hours/en") == 1


def test_what_holds_elsewhere_or_at_another_time_is_left_out_before_ranking() -> None:
    made = Library(FOLDERS, Tuning(lambdas={}), status=ABSENT)
    asked = Request(query="limit in built-up areas", jurisdiction="DEU", language="en", k=20)
    here = made.search(msgspec.structs.replace(asked, road_type="urban")).passages
    there = made.search(msgspec.structs.replace(asked, road_type="motorway")).passages
    assert "deu-speed-urban" in {p.passage_id.split("/")[1] for p in here}
    assert "deu-speed-urban" not in {p.passage_id.split("/")[1] for p in there}
    assert made.search(msgspec.structs.replace(asked, on="1999-12-31")).passages == ()


@pytest.mark.parametrize("query", ["recipe for potato soup", "who won the football match", "cheap flights to Rome"])
def test_a_question_about_something_else_is_refused_and_called_so(query: str) -> None:
    made = Library(FOLDERS, read_tuning(), status=ABSENT)
    refused = made.search(Request(query=query, jurisdiction="GBR", language="en"))
    assert (refused.passages, refused.out_of_scope) == ((), True)
    answered = made.search(Request(query="who goes first at a roundabout", jurisdiction="GBR", language="en"))
    assert answered.passages
    assert not answered.out_of_scope


@pytest.mark.parametrize("corpus", ["statutes", "signs"])
def test_a_corpus_can_be_asked_alone(both: Library, corpus: str) -> None:
    found = names(both, "stop sign", jurisdiction="GBR", corpus=corpus, k=10)
    assert found
    assert all(name.startswith("sign:") == (corpus == "signs") for name in found)


def test_the_wanted_language_is_used_where_the_pack_speaks_it(both: Library) -> None:
    german = both.search(Request(query="Zeichen 206 Halt", jurisdiction="DEU", language="de"))
    assert all(passage.passage_id.endswith("/de") for passage in german.passages)
    polish = both.search(Request(query="stop", jurisdiction="DEU", language="pl"))
    assert polish.passages  # a language nobody wrote in does not silence the law


def test_each_provision_comes_once_and_best_first(both: Library) -> None:
    found = both.search(Request(query="speed limit Höchstgeschwindigkeit", jurisdiction="DEU", k=15)).passages
    assert len({passage.passage_id.split("/")[1] for passage in found}) == len(found) == 15
    assert [passage.score for passage in found] == sorted((passage.score for passage in found), reverse=True)


def test_a_later_packs_text_replaces_the_one_of_the_same_name(both: Library) -> None:
    found = both.search(Request(query="dark gantry panel", jurisdiction="DEU", language="en", corpus="signs"))
    assert found.passages[0].passage_id == "DEU-v1-VSL/sign:led:blank/en"


def test_repeats_do_not_ask_the_encoder_again_and_a_new_encoder_forgets_them() -> None:
    made, encoder = library(), WordEncoder()
    made.use(encoder)
    request = Request(query="fog")
    assert made.search(request) == made.search(request)
    assert (encoder.asked, made.hits) == (1, 1)
    made.give_up(ABSENT)
    assert made.search(request).encoder == ABSENT


def test_the_memory_is_bounded() -> None:
    made = Library(FOLDERS[2:], Tuning(lambdas={}), status=ABSENT, cache_size=4)
    for number in range(10):
        made.search(Request(query=f"rule {number}"))
    made.search(Request(query="rule 0"))
    assert made.hits == 0
    made.search(Request(query="rule 9"))
    assert made.hits == 1


@pytest.mark.parametrize("query", ["", "   ", "§§§", "\0\0", "the of and", "q" * 600])
def test_a_question_of_no_known_words_finds_nothing_and_breaks_nothing(query: str) -> None:
    assert library().search(Request(query=query)).passages == ()


def test_a_broken_pack_is_left_out_and_named(tmp_path: Path) -> None:
    made = Library((tmp_path, *FOLDERS[2:]), Tuning(lambdas={}), status=ABSENT)
    assert len(made.packs) == 1
    assert "manifest.json" in made.refused[0]


def test_a_second_pack_of_the_same_id_is_left_out_and_named(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(FOLDERS[2], tmp_path / "copy"))
    made = Library((*FOLDERS[2:], folder, FOLDERS[2]), Tuning(lambdas={}), status=ABSENT)
    assert list(made.packs) == [FOLDERS[2]]
    assert "GBR-v1 is already the pack in" in made.refused[0]
    assert len(made.refused) == 1


def test_embeddings_of_a_wrong_shape_are_an_error_and_bm25_goes_on() -> None:
    class Broken(WordEncoder):
        def passages(self, texts: object) -> Vectors:
            return np.zeros((1, 3), dtype=np.float32)

    made = library()
    with pytest.raises(ValueError, match="zip"):
        made.use(Broken())
    assert made.search(Request(query="fog", jurisdiction="GBR")).passages


def test_a_question_whose_vector_is_no_numbers_is_answered_by_bm25() -> None:
    class Odd(WordEncoder):
        def query(self, text: str) -> Vectors:
            return super().query(text) * np.float32(np.nan)

    made, encoder = library(), Odd()
    made.use(encoder)
    request = Request(query="fog", jurisdiction="GBR")
    found = made.search(request)
    assert found.encoder == LATE
    assert [passage.passage_id for passage in found.passages] == [
        p.passage_id for p in library().search(request).passages
    ]
    made.search(request)
    assert (encoder.asked, made.hits) == (2, 0)


def test_a_flag_that_blas_raises_over_finite_numbers_is_no_error() -> None:
    class Flagged(np.ndarray):
        """What was seen of BLAS once in some hundred runs: the flag, and a right product."""

        def __matmul__(self, other: Any) -> Any:
            np.subtract(np.float32(np.inf), np.float32(np.inf))
            return np.asarray(self) @ other

    texts = library().packs[FOLDERS[2]]
    rows, vector = WordEncoder().passages([text.indexed for text in texts]), WordEncoder().query("roundabout")
    plain, flagged = Index(texts, rows), Index(texts, rows.view(Flagged))
    how: dict[str, Any] = {"keep": Filter(), "lambda_for": lambda _: 0.5, "floor": 0.0, "limit": 5}
    assert flagged.search("roundabout", vector, **how) == plain.search("roundabout", vector, **how)


def test_normalised_scores_keep_their_order_within_one() -> None:
    scores = normalised(np.array([-1.0, 0.0, 1.0, 6.0, 100.0]))
    assert scores.tolist() == pytest.approx([0.0, 0.0, 1 / 7, 0.5, 100 / 106])
    assert stretched(np.array([0.5, 0.8, 0.9, 1.0]), 0.8).tolist() == pytest.approx([0.0, 0.0, 0.5, 1.0])


def test_a_long_question_does_not_hold_up_the_encoder() -> None:
    seen: list[int] = []

    class Counting(WordEncoder):
        def query(self, text: str) -> Vectors:
            seen.append(len(text))
            return super().query(text)

    made = library()
    made.use(Counting())
    made.search(Request(query="fog " * 150, road_context="motorway " * 60))
    assert seen == [MAX_ENCODED]


def test_an_encoder_that_is_late_leaves_bm25_and_is_asked_only_once() -> None:
    release, encoded = threading.Event(), threading.Event()

    class Slow(WordEncoder):
        def query(self, text: str) -> Vectors:
            assert release.wait(10)
            found = super().query(text)
            encoded.set()
            return found

    made = Library(FOLDERS, Tuning(lambdas={}), status=LOADING, budget_s=0.01)
    encoder = Slow()
    made.use(encoder)
    request = Request(query="fog", jurisdiction="DEU")
    first = made.search(request)
    assert first.encoder == LATE
    assert first.passages
    assert first.passages[0].cosine is None
    release.set()
    assert encoded.wait(10)
    assert made.search(msgspec.structs.replace(request, k=3)).encoder in (LATE, "word-1.0")
    patient = Library(FOLDERS, Tuning(lambdas={}), status=LOADING)
    patient.use(encoder)
    assert patient.search(request).encoder == "word-1.0"
    made.close()


def test_questions_do_not_queue_up_behind_a_stuck_encoder() -> None:
    release = threading.Event()

    class Stuck(WordEncoder):
        def query(self, text: str) -> Vectors:
            assert release.wait(10)
            return super().query(text)

    made = Library(FOLDERS[2:], Tuning(lambdas={}), status=LOADING, budget_s=0.001)
    made.use(Stuck())
    assert {made.search(Request(query=f"fog {number}")).encoder for number in range(20)} == {LATE}
    release.set()
    made.close()


def test_a_closed_library_still_answers_by_bm25() -> None:
    made = Library(FOLDERS[2:], Tuning(lambdas={}), status=LOADING)
    made.use(WordEncoder())
    made.close()
    assert made.search(Request(query="roundabout")).encoder == LATE

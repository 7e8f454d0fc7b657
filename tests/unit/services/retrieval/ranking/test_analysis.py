"""Search terms: stems, compounds, codes, slips of the finger."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.retrieval.ranking.analysis import Analyser

GERMAN = Analyser(
    "de", ["Die Höchstgeschwindigkeit auf der Autobahn bei Nässe.", "Geschwindigkeit, Richtung, Zeichen 274.1"]
)
ENGLISH = Analyser("en", ["The speed limit on a motorway", "overtaking a cyclist", "pedestrian crossing"])


@pytest.mark.parametrize(
    ("code", "terms"),
    [("274.1", ["274.1", "274", "1"]), ("1053-35", ["1053-35", "1053", "35"]), ("R413-2", ["r413-2", "r413", "2"])],
)
def test_codes_are_kept_whole_and_found_by_their_parts(code: str, terms: list[str]) -> None:
    assert ENGLISH.of_passage(code) == terms
    assert ENGLISH.of_question(code) == terms


def test_forms_of_a_word_meet_in_its_stem() -> None:
    assert ENGLISH.of_question("limits") == ENGLISH.of_passage("limit")
    assert GERMAN.of_question("Autobahnen") == GERMAN.of_passage("Autobahn")


def test_a_compound_is_found_by_what_it_is_about() -> None:
    speed = set(GERMAN.of_passage("Geschwindigkeit"))
    assert speed < set(GERMAN.of_passage("Höchstgeschwindigkeit"))
    assert speed <= set(GERMAN.of_question("Richtgeschwindigkeit"))
    assert set(GERMAN.of_question("Richtungsgeschwindigkeit")) == set(GERMAN.of_passage("Richtung Geschwindigkeit"))


@pytest.mark.parametrize(
    ("typed", "meant"), [("overtakeing", "overtaking"), ("pedestrain", "pedestrian"), ("cylcist", "cyclist")]
)
def test_a_misspelt_word_is_read_as_the_one_it_is_most_like(typed: str, meant: str) -> None:
    assert ENGLISH.of_question(typed) == ENGLISH.of_question(meant)
    assert ENGLISH.of_question(typed)[:1] == ENGLISH.of_passage(meant)


def test_a_word_like_none_stays_itself() -> None:
    assert ENGLISH.of_question("giraffe") == Analyser("en").of_passage("giraffe")


def test_numbers_are_never_mended() -> None:
    assert ENGLISH.of_question("275") == ["275"]


@given(st.text(max_size=300), st.sampled_from(["en", "de", "fr", "nl", "pl", "xx"]))
def test_any_text_has_terms_without_an_error(text: str, language: str) -> None:
    analyser = Analyser(language, [text, "Höchstgeschwindigkeit Geschwindigkeit"])
    assert all(analyser.of_question(text)) or not analyser.of_question(text)
    assert all(analyser.of_passage(text)) or not analyser.of_passage(text)

"""Text that is cut is cut where a sentence ends."""

import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from domain.languages import LANGUAGES
from drivemcp.paths import data
from services.orchestrator.text import MOST, sentences

STEPS = tomllib.loads(data("vehicles/dtc.toml").read_text(encoding="utf-8"))["steps"].values()


def test_whole_sentences_are_kept_without_the_last_full_stop() -> None:
    assert sentences("Slow down. Stop soon. Have the car checked.", 24) == "Slow down. Stop soon"
    assert sentences("Slow down. Stop soon.") == "Slow down. Stop soon"
    assert sentences("no full stop") == "no full stop"


def test_of_one_sentence_that_is_too_long_the_beginning_is_kept() -> None:
    assert sentences("abcdefgh ijkl mnop.", 10) == "abcdefgh …"


@given(st.lists(st.sampled_from([words[language] for words in STEPS for language in LANGUAGES]), min_size=1))
def test_what_to_do_about_a_car_is_never_cut_within_a_sentence(steps: list[str]) -> None:
    told = sentences(" ".join(steps))
    assert " ".join(steps).startswith(f"{told}.")
    assert len(told) <= MOST


@pytest.mark.parametrize("text", ["", ".", "...", " . "])
def test_nothing_is_no_error(text: str) -> None:
    assert len(sentences(text)) <= len(text)

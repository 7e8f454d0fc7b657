"""Recall, gain and refusal, on rankings worked out by hand."""

import math

import pytest

from studies.retrieval.measures import discounted_gain, measure
from training.retrieval.questions import Question

INSIDE = Question(query="who goes first", language="en", kind="right_of_way", expect=("a", "b"))
OUTSIDE = Question(query="play some jazz", language="en", kind="out_of_scope")


@pytest.mark.parametrize(
    ("found", "gain"), [(("a",), 1.0), (("x", "b", "a"), 1 / math.log2(3)), (("x", "y"), 0.0), ((), 0.0)]
)
def test_any_of_the_answers_gains_by_the_place_of_the_first(found: tuple[str, ...], gain: float) -> None:
    assert discounted_gain(INSIDE.expect, found) == pytest.approx(gain)


def test_an_answer_counts_among_the_first_five_only() -> None:
    assert measure(lambda _: ("1", "2", "3", "4", "b"), [INSIDE]).recall == 1.0
    late = measure(lambda _: ("1", "2", "3", "4", "5", "b"), [INSIDE])
    assert late.recall == 0.0
    assert late.gain > 0.0


def test_refusals_are_told_apart_by_whether_there_was_an_answer() -> None:
    silent = measure(lambda _: (), [INSIDE, OUTSIDE])
    assert (silent.refused, silent.wrongly_refused) == (1.0, 1.0)
    talkative = measure(lambda _: ("a",), [INSIDE, OUTSIDE])
    assert (talkative.refused, talkative.wrongly_refused) == (0.0, 0.0)


def test_what_was_never_asked_has_no_figure() -> None:
    assert math.isnan(measure(lambda _: (), [INSIDE]).refused)
    assert math.isnan(measure(lambda _: (), [OUTSIDE]).recall)

"""The metrics against cases worked by hand; the arithmetic stands beside each."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.drivelm.graph.tags import points
from studies.gvqa.coordinates import f1, has_broken_tag
from studies.gvqa.language import bleu, cider, normalised, rouge_l, words

SENTENCES = st.lists(st.sampled_from(["a", "b", "c", "d", "e"]), max_size=8)


def _f1(said: str, wanted: str) -> float:
    return f1(points(said), points(wanted))


def test_a_point_is_a_hit_where_its_axes_differ_by_less_than_16_px_together() -> None:
    wanted = "<c1,CAM_FRONT,100.0,100.0>"
    assert _f1("<c7,CAM_FRONT,108.0,107.9>", wanted) == 1.0  # 8 + 7.9 = 15.9 < 16
    assert _f1("<c7,CAM_FRONT,108.0,108.0>", wanted) == 0.0  # 8 + 8 = 16, not under it
    assert _f1("<c1,CAM_BACK,100.0,100.0>", wanted) == 0.0  # another camera is another object


def test_f1_weighs_hits_against_all_points() -> None:
    wanted = "<c1,CAM_FRONT,10.0,10.0> and <c2,CAM_FRONT,200.0,10.0>"
    # one hit of one said: precision 1/1, recall 1/2, F1 = 2 * 1 * 0.5 / 1.5 = 2/3
    assert _f1("<c1,CAM_FRONT,10.0,12.0>", wanted) == pytest.approx(2 / 3)
    # two hits of four said: precision 2/4, recall 2/2, F1 = 2 * 0.5 * 1 / 1.5 = 2/3
    four = "<c1,CAM_FRONT,10,10> <c2,CAM_FRONT,200,10> <c3,CAM_FRONT,500,10> <c4,CAM_FRONT,600,10>"
    assert _f1(four, wanted) == pytest.approx(2 / 3)


def test_a_reference_point_is_hit_once_and_the_first_said_takes_the_nearest() -> None:
    # both lie near (0, 0): the first takes it, the second finds none: precision 1/2, recall 1/1, F1 = 2/3
    assert _f1("<c1,CAM_FRONT,1,1> <c2,CAM_FRONT,0,0>", "<c1,CAM_FRONT,0,0>") == pytest.approx(2 / 3)
    # first said (6, 0) is 6 from (0, 0) and 4 from (10, 0): takes (10, 0); then (10, 0) is 10 from (0, 0): two hits
    assert _f1("<c1,CAM_FRONT,6,0> <c2,CAM_FRONT,10,0>", "<c1,CAM_FRONT,0,0> <c2,CAM_FRONT,10,0>") == 1.0


def test_what_only_begins_like_a_tag_is_told() -> None:
    assert has_broken_tag("see <c1,CAM_FRONT,12>")
    assert not has_broken_tag("see <c1,CAM_FRONT,12,13.5> at 3 < 4")
    assert points("<c1,CAM_FRONT,12>") == []


def test_words_lose_case_and_punctuation_and_keep_numbers_whole() -> None:
    assert words("The Traffic-light at <c1,CAM_FRONT,7.5,8> is RED.") == [
        "the", "traffic-light", "at", "c1", "cam_front", "7.5", "8", "is", "red",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("said", "wanted"),
    [
        ("Two cars.", "2 cars"),
        ("The light is RED", "light is red."),
        ("30.0", "30"),
        ("A.", ""),
        ("a 3.5 m gap", "3.5 m gap"),
    ],
)
def test_lenient_answers_lose_case_articles_punctuation_and_the_spelling_of_numbers(said: str, wanted: str) -> None:
    assert normalised(said) == normalised(wanted)


@given(st.text())
def test_normalising_twice_changes_nothing(text: str) -> None:
    assert normalised(normalised(text)) == normalised(text)


def test_bleu_counts_over_the_whole_set_and_punishes_shortness() -> None:
    said, wanted = [["a", "b", "c"], []], [["a", "b", "d"], ["x"]]
    # said 3 words, wanted 4: brevity exp(1 - 4/3). Words 2 of 3, pairs 1 of 2: sqrt(2/3 * 1/2)
    brevity = math.exp(1 - 4 / 3)
    assert bleu(said, wanted, 1) == pytest.approx(brevity * 2 / 3)
    assert bleu(said, wanted, 2) == pytest.approx(brevity * math.sqrt(1 / 3))
    assert bleu(said, wanted, 3) == 0.0  # no triple in common
    # a repeated word counts only as often as the reference has it: 1 of 3
    assert bleu([["a", "a", "a"]], [["a", "b", "c"]], 1) == pytest.approx(1 / 3)


def test_rouge_l_takes_the_longest_common_subsequence() -> None:
    # common: "the car brakes" = 3; precision 3/4, recall 3/5; (1 + 1.44) * 0.75 * 0.6 / (0.6 + 1.44 * 0.75) = 1.098 / 1.68
    said, wanted = ["the", "red", "car", "brakes"], ["the", "car", "ahead", "brakes", "now"]
    assert rouge_l(said, wanted) == pytest.approx(1.098 / 1.68)
    assert rouge_l(["b", "a"], ["a", "b"]) == pytest.approx(0.5)  # order counts: one of two, both ways
    assert rouge_l([], wanted) == 0.0


def test_cider_weighs_rare_words_and_cosine_per_order() -> None:
    # Two references: "stop now", "go now". "now" is in both: weight ln(2/2) = 0. "stop", "go" and both pairs are in one: ln 2.
    wanted = [["stop", "now"], ["go", "now"]]
    # Exact answer: cosine 1 for words and for pairs; no triples or quadruples: 10 * (1 + 1 + 0 + 0) / 4 = 5
    assert cider(wanted, wanted) == pytest.approx([5.0, 5.0])
    # "stop" for "stop now": words cosine 1 (weights ln 2 alone), no pairs; one word short: exp(-1 / (2 * 36));
    # 10 * 1 / 4 * exp(-1/72). "stop now" for "go now": nothing rare in common: 0
    said = [["stop"], ["stop", "now"]]
    assert cider(said, wanted) == pytest.approx([2.5 * math.exp(-1 / 72), 0.0])
    # repeating is clipped: "stop stop" has weight 2 ln 2, counted min(2, 1): cosine 1 * 1 / (2 * 1) = 1/2; its pair
    # is unknown, "stop now" not said: 0. 10 * (1/2) / 4 = 1.25, same length
    assert cider([["stop", "stop"], ["go", "now"]], wanted)[0] == pytest.approx(1.25)


def test_a_single_reference_has_nothing_rare_and_scores_0_in_cider() -> None:
    assert cider([["stop"]], [["stop"]]) == [0.0]  # ln(1/1) = 0


@given(st.lists(st.tuples(SENTENCES, SENTENCES), min_size=1, max_size=5))
def test_every_score_stays_in_its_range(pairs: list[tuple[list[str], list[str]]]) -> None:
    said, wanted = [one for one, _ in pairs], [other for _, other in pairs]
    assert all(0 <= bleu(said, wanted, order) <= 1 + 1e-9 for order in (1, 2, 3, 4))
    assert all(0 <= rouge_l(*both) <= 1 + 1e-9 for both in pairs)
    assert all(0 <= score <= 10 + 1e-9 for score in cider(said, wanted))

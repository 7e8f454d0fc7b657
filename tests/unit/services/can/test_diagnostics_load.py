"""The benchmark's own run, short: every answer right while the bus is full of other frames."""

from benchmarks.diagnostics import naive, ours


def test_every_answer_is_right_on_a_busy_bus_and_known_questions_end_with_their_answer() -> None:
    result = ours(300, seed=7)
    assert result.wrong == []
    assert result.ended.keys() <= {"answered", "quiet"}
    assert result.ended["quiet"] <= 60  # two for each question that not all units answer, until that is learned


def test_the_first_frame_heard_is_often_not_the_answer() -> None:
    assert naive(150, seed=7).wrong

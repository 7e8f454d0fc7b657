"""The judge of the disturbed drives finds what it is for: silence, and targets that rise while information is missing."""

import pytest

from tests.stack.chaos.judge import judge
from tests.stack.chaos.watcher import Seen


def seen(
    at_s: float, target_mps: float | None = 10.0, *degraded: str, why: str = "lead", law_mps: float = 13.9
) -> Seen:
    """A tick."""
    return Seen(
        at_s=at_s, tick=int(at_s * 10), kind="SILENT", target_mps=target_mps, limit_mps=13.9, why=why,
        degraded=degraded, law_mps=law_mps,
    )  # fmt: skip


BEFORE = [seen(tenth / 10) for tenth in range(80, 100)]


def test_silence_is_the_longest_time_without_a_tick_from_the_disturbance_on() -> None:
    verdict = judge("x", [*BEFORE, seen(10.2), seen(14.0), seen(15.0)], 10.0, 10.0, 16.0)
    assert verdict.silent_s == pytest.approx(3.8)
    assert judge("x", BEFORE, 10.0, 10.0, 16.0).silent_s == pytest.approx(6.0)


def test_a_target_that_rises_while_the_process_is_missing_is_told() -> None:
    after = [seen(10.5, 12.0, "perception/tracks"), seen(11.0, 13.0)]
    assert judge("x", [*BEFORE, *after], 10.0, 10.4, 12.0, "perception").rise_mps == pytest.approx(2.0)
    assert judge("x", [*BEFORE, *after], 10.0, 10.4, 12.0, "perception").back_s == pytest.approx(1.0)


@pytest.mark.parametrize("process", ["logger", "can"])
def test_a_target_may_rise_by_what_another_process_tells(process: str) -> None:
    after = [seen(10.5, 12.0, "perception/tracks", process)]
    assert judge("x", [*BEFORE, *after], 10.0, 10.4, 12.0, process).rise_mps == (2.0 if process == "can" else 0.0)
    after = [seen(10.5, 12.0, "perception/tracks")]
    assert judge("x", [*BEFORE, *after], 10.0, 10.4, 12.0, process).rise_mps == 0.0


def test_a_true_law_that_is_learnt_is_no_rise_and_one_above_it_is() -> None:
    before = [seen(tenth / 10, why="law") for tenth in range(80, 100)]
    for target_mps, rise_mps in ((13.0, 0.0), (15.9, 2.0)):
        verdict = judge("x", [*before, seen(10.5, target_mps, "drivelm", why="law")], 10.0, 10.4, 12.0, "drivelm")
        assert verdict.rise_mps == pytest.approx(rise_mps)

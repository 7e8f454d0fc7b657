"""Infractions, overspeed and wrong limits, by hand."""

import pytest

from evaluation.metrics import Record, measure
from evaluation.metrics.law import TOLERANCE_MPS
from tests.unit.evaluation.metrics.logs import limit, said, steady, truths


def speeds(*pieces: tuple[float, float]) -> Record:
    """(until, speed) pieces at a limit of 20 m/s."""
    at = lambda time_s: {"speed_mps": next(speed for until_s, speed in pieces if time_s <= until_s)}  # noqa: E731
    return Record(truths=truths(pieces[-1][0], at))


def test_speeding_needs_more_than_the_tolerance_for_a_second() -> None:
    # 3 km/h = 0.833 m/s. At 20.8: within. At 20.9 for 0.95 s: too short. At 20.9 for 1.0 s: one.
    assert measure(speeds((5.0, 20.8))).infractions_total == 0
    assert measure(speeds((0.95, 20.9), (5.0, 20.0))).infractions_total == 0
    assert measure(speeds((1.0, 20.9), (5.0, 20.0))).infractions == {
        "speeding": 1, "failure_to_stop": 0, "wrong_yielding": 0, "illegal_turn": 0,
    }  # fmt: skip
    assert pytest.approx(3 / 3.6) == TOLERANCE_MPS


def test_wavering_about_the_tolerance_is_one_episode_and_coming_back_to_the_limit_ends_it() -> None:
    wavering = speeds((2.0, 21.5), (3.0, 20.5), (5.0, 21.5))
    assert measure(wavering).infractions_total == 1
    assert measure(speeds((2.0, 21.5), (3.0, 19.9), (5.0, 21.5))).infractions_total == 2


def test_a_limit_that_falls_makes_the_same_speed_an_infraction() -> None:
    record = Record(truths=truths(4.0, lambda t: {"speed_mps": 20.0, "law_limit_mps": 20.0 if t < 2.0 else 13.9}))
    assert measure(record).infractions_total == 1


def test_lines_and_priority_count_by_the_papers_types() -> None:
    words = {1.0: "red_light", 2.0: "no_stop", 3.0: "wrong_yield", 4.0: "illegal_turn", 5.0: "speeding"}
    record = Record(truths=truths(6.0, lambda t: {"speed_mps": 10.0, "infraction": words.get(t, "")}))
    # "speeding" of the truth is not counted again: the speed was below the limit throughout.
    assert measure(record).infractions == {"speeding": 0, "failure_to_stop": 2, "wrong_yielding": 1, "illegal_turn": 1}


def test_overspeed_is_the_mean_excess_over_time_and_nothing_below_the_limit() -> None:
    # half the time 22 at 20 (10 %), half at 10 (0): 5 % on the mean
    record = speeds((5.0, 22.0), (10.0, 10.0))
    assert measure(record).overspeed_true_pct == pytest.approx(5.0)
    assert measure(Record(truths=steady(1.0, law_limit_mps=None))).overspeed_true_pct is None


def test_the_papers_overspeed_is_against_the_limit_that_is_inferred() -> None:
    # ticks at 1 and 2 s: inferred 16 at 20 m/s (25 %), inferred 25 (0 %); at 3 s none is known, at 4 s one is advised
    told = (limit(16.0), limit(25.0), None, limit(10.0, advisory=True))
    advisories = tuple(said(float(at), "SILENT", legal_limit=each) for at, each in enumerate(told, 1))
    found = measure(Record(truths=steady(5.0), advisories=advisories))
    assert found.overspeed_inferred_pct == pytest.approx(12.5)


def test_seconds_under_a_wrong_limit_and_under_none() -> None:
    # truth 20. From 1 s 25 (wrong), from 3 s 20 (right), from 4 s none, to the end at 6 s.
    advisories = tuple(
        said(at, "SILENT", legal_limit=each) for at, each in ((1.0, limit(25.0)), (3.0, limit(20.2)), (4.0, None))
    )
    found = measure(Record(truths=steady(6.0), advisories=advisories))
    assert found.wrong_limit_s == pytest.approx(2.0)
    assert found.unknown_limit_s == pytest.approx(2.0)


def test_a_limit_where_there_is_none_is_wrong_and_an_advised_speed_is_not() -> None:
    truth = steady(3.0, law_limit_mps=None)
    wrong = Record(truths=truth, advisories=(said(1.0, legal_limit=limit(30.0)),))
    advised = Record(truths=truth, advisories=(said(1.0, legal_limit=limit(36.1, advisory=True)),))
    assert measure(wrong).wrong_limit_s == pytest.approx(2.0)
    assert (measure(advised).wrong_limit_s, measure(advised).unknown_limit_s) == (0.0, 0.0)


def test_without_truth_nothing_of_the_law_is_measured() -> None:
    found = measure(Record(advisories=(said(1.0),)))
    assert (found.infractions, found.overspeed_inferred_pct, found.wrong_limit_s, found.distance_m) == (None,) * 4
    assert found.messages == 1

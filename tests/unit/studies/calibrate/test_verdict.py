"""Only what is worse in no safety number takes the shipped constants' place."""

from typing import Any

import pytest

from studies.calibrate.verdict import Closed, closed, verdict

BEFORE = Closed(
    runs=3, km=9.0, hazards=12, missed=1, response_s=0.5, near_collisions=1, false_interventions=12, nags=27
)


def other(**fields: Any) -> Closed:
    from msgspec import structs

    return structs.replace(BEFORE, **fields)


def test_fewer_false_interventions_with_nothing_worse_are_taken() -> None:
    found = verdict(BEFORE, other(false_interventions=3))
    assert found.taken
    assert "12 -> 3" in found.why


@pytest.mark.parametrize(
    "worse",
    [{"missed": 2}, {"collisions": 1}, {"near_collisions": 2}, {"infractions": 1}, {"response_s": 0.6}],
)
def test_one_safety_number_that_is_worse_is_enough(worse: dict[str, Any]) -> None:
    assert not verdict(BEFORE, other(false_interventions=0, **worse)).taken


def test_too_few_hazards_prove_nothing() -> None:
    assert not verdict(other(hazards=9), other(hazards=9, false_interventions=0)).taken
    found = verdict(BEFORE, other(hazards=9, false_interventions=0))
    assert not found.taken
    assert "more --verify" in found.why


def test_no_better_is_not_taken_and_neither_is_a_drive_that_failed() -> None:
    assert not verdict(BEFORE, BEFORE).taken
    assert not verdict(BEFORE, other(runs=2, false_interventions=0)).taken
    assert not verdict(Closed(), Closed()).taken


def test_runs_are_pooled_and_what_was_not_measured_counts_nothing() -> None:
    rows = [
        {"distance_m": 2000.0, "hazards": 2, "hazards_answered": 1, "hazard_response_s": (0.5,), "collisions": None},
        {"distance_m": 3000.0, "hazards": 1, "hazards_answered": 1, "hazard_response_s": (1.5,), "nags": 2},
    ]
    found = closed(rows)
    assert (found.runs, found.km, found.missed, found.response_s, found.nags) == (2, 5.0, 1, 1.0, 2)

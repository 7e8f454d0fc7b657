"""What we want to read, and what runs prove of it: worked by hand."""

from typing import Any

import pytest

from evaluation.campaign.plan import Row
from evaluation.campaign.store import Kept
from evaluation.tables.goals import GOALS, judged
from tests.unit.evaluation.evaluate.made import far, kept, table


def test_goals_are_judged_by_the_interval_and_say_what_the_distance_allows() -> None:
    near = {one.what: one for one in judged([table("results", lambda row, number: kept(infractions_total=0))])}
    long = {one.what: one for one in judged([table("results", far)])}
    what = "CROSS-BORDER, infractions"
    assert near[what].verdict == "holds in the mean, not proven"
    assert "cannot prove 0.1 (that takes 369 km without one)" in near[what].distance
    assert long[what].verdict == "holds"
    assert "can prove" in long[what].distance


def judged_of(what: str, runs: int = 2, **numbers: Any) -> tuple[str, str]:
    """Found, and the verdict, where every run of every row has these numbers."""
    (one,) = (
        each for each in judged([table("results", lambda row, number: kept(**numbers), runs)]) if each.what == what
    )
    return one.found, one.verdict


def test_a_goal_is_missed_surely_only_where_the_whole_interval_lies_beyond_it() -> None:
    what = "CROSS-BORDER, infractions"
    assert judged_of(what, infractions_total=1, distance_m=100_000.0)[1] == "holds in the mean, not proven"
    assert judged_of(what, infractions_total=1)[1] == "missed"
    assert judged_of(what, infractions_total=1, distance_m=40_000.0)[1] == "missed in the mean, not proven"
    nags = "CROSS-BORDER, nags"
    assert judged_of(nags, nags=1, distance_m=10_000.0) == ("1.00 [0.12, 3.61]", "missed in the mean, not proven")
    assert judged_of(nags, nags=1, distance_m=100_000.0)[1] == "holds"


def test_a_number_beside_its_bound_shows_on_which_side_it_is() -> None:
    what = "CROSS-BORDER, overspeed"
    assert judged_of(what, overspeed_inferred_pct=0.3521) == ("0.352", "missed in the mean, not proven")
    assert judged_of(what, overspeed_inferred_pct=0.35) == ("0.35", "holds in the mean, not proven")
    assert judged_of(what, overspeed_inferred_pct=0.41) == ("0.41", "missed in the mean, not proven")


def test_two_perfect_runs_prove_nothing() -> None:
    perfect = table("corruption", lambda row, number: kept(event_f1=1.0, correct_tool_rate=1.0))
    told = {one.what: one for one in judged([perfect])}
    assert told["Clean sensor stack, event F1"].found == "100.0"
    assert {one.verdict for one in told.values()} == {"holds in the mean, not proven"}


@pytest.mark.parametrize(
    ("km", "can", "verdict"), [(340, "cannot", "holds in the mean, not proven"), (370, "can", "holds")]
)
def test_a_distance_can_prove_what_the_verdict_takes_for_proven(km: int, can: str, verdict: str) -> None:
    free = table("results", lambda row, number: kept(distance_m=km * 500.0, infractions_total=0))
    (one,) = (each for each in judged([free]) if each.what == "CROSS-BORDER, infractions")
    assert f"this distance {can} prove 0.1" in one.distance
    assert one.verdict == verdict


def responded(row: Row, number: int) -> Kept | None:
    """A tenth of a second before the other or so in the places of both; many hard places are driven by DriveMCP alone."""
    ours = row.spec.method == "DriveMCP"
    if number >= 3:
        return kept(hazard_response_s=(2.0,)) if ours else None
    return kept(hazard_response_s=(0.5 + 0.2 * number - ours * (0.1 + 0.001 * number),))


def test_responses_are_compared_in_the_places_that_both_drove() -> None:
    told = {one.what: one for one in judged([table("results", responded, runs=9)]) if "NoArbiter" in one.bound}
    one = told["CROSS-BORDER, hazard response"]
    assert one.verdict == "holds", "faster in every one of them"
    assert one.found.startswith("0.60 against 0.70, difference -0.10 [-0.10, -0.10], of 3 runs")


def test_responses_in_no_place_that_both_drove_are_not_compared() -> None:
    def apart(row: Row, number: int) -> Kept | None:
        return kept() if (row.spec.method == "DriveMCP") == (number > 0) else None

    (one,) = (
        each
        for each in judged([table("results", apart)])
        if each.what == "CROSS-BORDER, hazard response" and "NoArbiter" in each.bound
    )
    assert one.verdict == "not measured"


def test_a_collision_that_no_assistant_does_not_have_misses_the_goal() -> None:
    made = table("results", lambda row, number: kept(collisions=int(row.spec.method == "DriveMCP")))
    verdicts = {one.what: one.verdict for one in judged([made])}
    assert verdicts["CROSS-BORDER, collisions"] == "missed"


def test_a_collision_where_nobody_drove_without_assistant_is_not_judged() -> None:
    def made(row: Row, number: int) -> Kept | None:
        ours = row.spec.method == "DriveMCP"
        return kept(collisions=int(ours and number == 1)) if ours or number == 0 else None

    (told,) = (each for each in judged([table("results", made)]) if each.what == "CROSS-BORDER, collisions")
    assert told.verdict == "not measured"
    assert "[1], which DriveMCP alone drove" in told.found


def test_every_goal_names_a_row_and_a_column() -> None:
    for goal in GOALS:
        made = table(goal.table, lambda row, number: None)
        assert goal.row in {row.row.key for row in made.rows}
        assert (goal.column.title, goal.column.unit) in {(column.title, column.unit) for column in made.columns}


def test_a_latency_that_nobody_measured_meets_no_goal() -> None:
    what = "CROSS-BORDER, advisory latency p50"
    for latencies, verdict in (({}, "not measured"), ({"applicable_limit": 0.6}, "holds in the mean, not proven")):
        made = table("results", lambda row, number: kept(), modelled_ms=latencies)
        (found,) = (one for one in judged([made]) if one.what == what)
        assert found.verdict == verdict


def test_responses_prove_nothing_where_hazards_were_never_answered() -> None:
    def answering(count: int) -> dict[str, tuple[str, str]]:
        def made(row: Row, number: int) -> Kept:
            ours = row.spec.method == "DriveMCP"
            times = tuple(0.1 + 0.01 * number for _ in range(count)) if ours else (0.4 + 0.02 * number,) * 10
            return kept(hazard_response_s=times, hazards=10, hazards_answered=len(times))

        found = judged([table("results", made, 8)])
        return {one.bound: (one.verdict, one.found) for one in found if one.what == "CROSS-BORDER, hazard response"}

    all_of_them, one_in_ten = answering(10), answering(1)
    for bound in ("<= 0.5 s", "<= VLM-Tools-NoArbiter's"):
        assert all_of_them[bound][0] == "holds"
        assert one_in_ten[bound][0] == "holds in the mean, not proven"
        assert one_in_ten[bound][1].endswith(", 8 of 80 answered")

"""Runs become numbers: worked by hand."""

import csv
from pathlib import Path
from typing import Any

import msgspec
import pytest

from evaluation.evaluate import files
from evaluation.evaluate.columns import (
    COLLISIONS,
    COLUMNS,
    FALSE,
    INFRACTIONS,
    LATENCY_P50,
    RESPONSE,
    Column,
    columns_of,
)
from evaluation.evaluate.compare import against, lines_of, orders, told_of, with_and_without_faults
from evaluation.evaluate.goals import GOALS, judged, told
from evaluation.evaluate.names import TABLES, TableName
from evaluation.evaluate.plan import Row
from evaluation.evaluate.store import Kept
from evaluation.evaluate.tables import value_of
from evaluation.metrics import RATES, Metrics
from tests.unit.evaluation.evaluate.made import NUMBERS, kept, table


@pytest.mark.parametrize("name", TABLES)
def test_columns_name_what_is_measured(name: TableName) -> None:
    fields = set(Metrics.__struct_fields__)
    for column in columns_of(name):
        if column.rate:
            assert {RATES[column.rate].count, RATES[column.rate].exposure} <= fields
            assert RATES[column.rate].unit == column.unit
        else:
            assert {each.partition(".")[0] for each in (column.field, *column.share) if each} <= fields


def test_a_rate_pools_all_runs_and_has_the_exact_interval() -> None:
    value = value_of(INFRACTIONS, [{**NUMBERS, "infractions_total": 3}, {**NUMBERS, "infractions_total": 0}])
    assert value.value == pytest.approx(3 / 4.0 * 10), "3 in 4 km"
    assert value.low == pytest.approx(0.6187 / 0.4, rel=1e-3)
    assert value.high == pytest.approx(8.7673 / 0.4, rel=1e-3)
    assert value.sd == pytest.approx(7.5 * 2**0.5), "15 and 0 per 10 km"
    assert value.of == "3 in 4.0 km"


def test_a_rate_of_nothing_has_an_upper_end_and_no_distance_has_none() -> None:
    none = value_of(INFRACTIONS, [{**NUMBERS, "infractions_total": 0}])
    assert none.value == none.low == 0.0
    assert none.high == pytest.approx(3.689 / 0.2, rel=1e-3)
    assert value_of(INFRACTIONS, []).value is None


def test_a_mean_is_over_runs_and_a_run_without_the_thing_is_left_out() -> None:
    value = value_of(
        RESPONSE, [NUMBERS, {**NUMBERS, "hazard_response_s": (0.5,)}, {**NUMBERS, "hazard_response_s": ()}]
    )
    assert value.value == pytest.approx((0.3 + 0.5) / 2)
    assert value.of == "2 runs"
    assert value_of(LATENCY_P50, [{**NUMBERS, "advisory_latency_s": (0.1, 0.2, 0.9)}]).value == pytest.approx(0.2)


def test_the_table_of_corruption_tells_what_a_rate_came_to() -> None:
    (column,) = (each for each in columns_of("corruption") if each.title == "signs corrupted")
    runs = [{**NUMBERS, "signs_corrupted": hit, "signs_drawn": drawn} for hit, drawn in ((8, 17), (4, 14))]
    value = value_of(column, runs)
    assert value.value == pytest.approx(100 * 12 / 31)
    assert value.of == "12 of 31"
    assert value_of(column, [NUMBERS]).value is None, "clean"
    assert column not in columns_of("results")


def column(title: str) -> Column:
    (found,) = (each for each in columns_of("results") if each.title == title)
    return found


def test_hazards_are_told_kind_by_kind_and_only_of_runs_that_had_the_kind() -> None:
    response, answered = column("hazard response, lead brakes"), column("hazards answered, lead brakes")
    runs = [
        {
            "hazard_response_by_kind_s": {"lead_brakes": times_s},
            "hazards_by_kind": {"lead_brakes": 2},
            "hazards_answered_by_kind": {"lead_brakes": len(times_s)},
        }
        for times_s in ((0.2, 0.6), (1.0,), ())
    ]
    other = {
        "hazard_response_by_kind_s": {"cut_in": (9.0,)},
        "hazards_by_kind": {"cut_in": 1},
        "hazards_answered_by_kind": {"cut_in": 1},
    }
    value = value_of(response, [*runs, other, NUMBERS])
    assert value.value == pytest.approx((0.4 + 1.0) / 2)
    assert value.of == "2 runs"
    value = value_of(answered, [*runs, other, NUMBERS])
    assert (value.value, value.of) == (50.0, "3 of 6")
    assert {each for each in columns_of("delta") if each in (response, answered)} == set()


def test_false_interventions_in_a_hazard_are_a_share_of_the_false_ones() -> None:
    runs = [{"false_interventions": 3, "false_while_hazard": 1}, {"false_interventions": 1, "false_while_hazard": 1}]
    value = value_of(column("of false interventions, while a hazard is on"), runs)
    assert (value.value, value.of) == (50.0, "2 of 4")


@pytest.mark.parametrize(
    "title",
    [
        "repeats within 20 s", "RSS violations", "RSS violations unanswered", "event F1 without overspeed",
        "of false interventions, while a hazard is on", "hazard response, stop line", "hazards answered, stop line",
    ],
)  # fmt: skip
def test_what_runs_of_older_code_did_not_measure_is_no_number(title: str) -> None:
    value = value_of(column(title), [NUMBERS, {**NUMBERS, "hazards": 3, "hazards_answered": 3}])
    assert (value.value, told(value, column(title))) == (None, "-")


def test_a_share_pools_counts() -> None:
    value = value_of(FALSE, [NUMBERS, {**NUMBERS, "interventions": 0, "false_interventions": 0}])
    assert (value.value, value.of) == (25.0, "1 of 4")
    assert value_of(FALSE, [{**NUMBERS, "interventions": 0, "false_interventions": 0}]).value is None


def test_failed_runs_are_counted_as_missing() -> None:
    made = table("delta", lambda row, number: None if number else kept())
    assert {row.missing for row in made.rows} == {1}
    assert {row.km for row in made.rows} == {2.0}


def far(row: Row, number: int) -> Kept:
    """DriveMCP has no infraction, the others have many."""
    infractions = 0 if row.spec.method == "DriveMCP" else 40
    return kept(distance_m=300_000.0, infractions_total=infractions)


@pytest.mark.parametrize(("places", "verdict"), [(7, "not told apart"), (8, "as in the paper")])
def test_orders_are_told_apart_place_by_place_once_there_are_eight(places: int, verdict: str) -> None:
    found = orders(table("results", far, places))
    of = {(one.group, one.first, one.second): one for one in found if one.column == "infractions"}
    assert of["CROSS-BORDER", "VLM-Direct", "DriveMCP"].verdict == verdict
    assert of["CROSS-BORDER", "VLM-Direct", "DriveMCP"].places == places
    assert of["CROSS-BORDER", "VLM-Direct", "DriveMCP"].paper_ratio == pytest.approx(4.5)
    assert of["CROSS-BORDER", "VLM-Direct", "VLM-Direct+RAG"].verdict == "not told apart"


def uneven(row: Row, number: int) -> Kept | None:
    """Places differ far more than methods do; DriveMCP alone drove the last one, and is always two better."""
    ours = row.spec.method == "DriveMCP"
    if number == 9 and not ours:
        return None
    return kept(infractions_total=7 * number + (0 if ours else 2))


def test_what_places_have_in_common_falls_out_of_a_difference() -> None:
    made = table("results", uneven, 10)
    ours, other = (
        next(row for row in made.rows if row.row.key == f"urb-rain/{name}") for name in ("DriveMCP", "No-assistant")
    )
    assert ours.values[0].low is not None
    assert other.values[0].high is not None
    assert ours.values[0].low < other.values[0].high, "their own intervals overlap"
    found = next(one for one in against(made) if one.first == "No-assistant" and one.column.title == "infractions")
    assert (found.second, found.places, found.told_apart) == ("DriveMCP", 9, True)
    assert found.value.value == pytest.approx(10.0), "two in 2 km"
    assert told_of(found) == "+10.00 (9)", "all equal: no interval"


def longer(row: Row, number: int) -> Kept | None:
    """As many infractions everywhere; DriveMCP's drives end a metre further on."""
    return kept(infractions_total=1, distance_m=2000.0 + (row.spec.method == "DriveMCP"))


def test_what_no_reader_could_see_tells_no_rows_apart() -> None:
    found = [one for one in against(table("results", longer, 10)) if one.column.title == "infractions"]
    assert [told_of(one) for one in found] == ["+0.00 (10)"] * len(found)
    assert not any(one.told_apart for one in found)


def hardly(row: Row, number: int) -> Kept | None:
    """More in eight places by what shows, less in forty by what does not, and so less in the mean."""
    other = 0.006 if number < 8 else -0.0049
    return kept(overspeed_inferred_pct=1.0 + (0.0 if row.spec.method == "DriveMCP" else other))


def test_what_no_reader_could_see_of_the_mean_tells_no_rows_apart() -> None:
    found = [one for one in against(table("results", hardly, 48)) if one.column.title == "overspeed"]
    assert all(one.chance is not None and one.chance < 0.01 for one in found)
    assert not any(one.told_apart for one in found)


def test_an_order_that_comes_out_the_other_way_round_is_told() -> None:
    made = table("results", lambda row, number: kept(infractions_total=3 * (row.spec.method == "DriveMCP")), 8)
    found = {one.verdict for one in orders(made) if one.column == "infractions" and one.second == "DriveMCP"}
    assert found == {"the other way round"}


def test_rows_of_a_curve_are_held_against_its_first() -> None:
    found = against(table("corruption", lambda row, number: kept(event_f1=0.9 - (row.at or 0.0)), 8))
    missed = next(one for one in found if one.first == "signs missed, 50 %" and one.column.title == "event F1")
    assert missed.second == "signs missed, 0 %"
    assert missed.value.value == pytest.approx(-50.0)
    assert missed.told_apart


def test_rows_without_a_place_in_common_have_no_difference() -> None:
    made = table("results", lambda row, number: kept() if number == (row.spec.method == "DriveMCP") else None)
    assert list(lines_of(against(made))) == []
    assert {one.verdict for one in orders(made) if "DriveMCP" in (one.first, one.second)} == {"not measured"}


def timed(row: Row, number: int) -> Kept:
    """Each method takes another time, a little otherwise in each run."""
    slow = {"VLM-Direct": 0.004, "VLM-Direct+RAG": 0.026}.get(row.spec.method, 0.001)
    return kept(advisory_latency_s=(slow + number * 1e-5,))


def latencies_told(modelled_ms: dict[str, float], settings: dict[str, Any]) -> dict[tuple[str, str], str]:
    made = table("results", timed, 8, modelled_ms=modelled_ms, settings=settings)
    found = [one for one in orders(made) if one.column == "advisory latency" and one.group == "CROSS-BORDER"]
    assert all((one.our_ratio is None) == (one.verdict == "not measured") for one in found)
    return {(one.first, one.second): one.verdict for one in found}


def test_orders_of_latencies_that_are_assumed_are_not_measured() -> None:
    fixed = latencies_told({}, {})
    assert set(fixed.values()) == {"not measured"}
    some = latencies_told({"applicable_limit": 0.6, "retrieve": 22.4}, {})
    assert some["VLM-Direct", "DriveMCP"] == some["VLM-Direct+RAG", "VLM-Direct"] == "not measured"
    assert some["VLM-Direct+RAG", "DriveMCP"] == "as in the paper"
    both = latencies_told({"applicable_limit": 0.6, "answer_prompt": 4.0}, {})
    assert both["VLM-Direct", "DriveMCP"] == "as in the paper"
    model = latencies_told({"applicable_limit": 0.6}, {"drivelm": {"prompt_backend": "openai"}})
    assert model["VLM-Direct", "DriveMCP"] == "as in the paper", "a model takes its own time"


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


def test_a_faulty_car_is_compared_with_a_sound_one_run_by_run() -> None:
    def made(row: Row, number: int) -> Kept | None:
        if row.key == "DriveMCP/sound" and number == 1:
            return None
        return kept(target_mean_mps=20.0 + number - (5.0 if row.key.endswith("/faulty") else 0.0))

    found = {(one.group, one.column.title): one for one in with_and_without_faults(table("can-fault", made, 3))}
    target = found["DriveMCP", "target speed"]
    assert target.value.value == pytest.approx(-18.0)
    assert target.value.sd == pytest.approx(0.0)
    assert target.places == 2, "not where only one of the two drove"
    assert found["Oracle", "target speed"].places == 3
    assert with_and_without_faults(table("delta", lambda row, number: kept())) == ()


def test_in_either_state_of_the_car_all_are_compared_with_drivemcp() -> None:
    made = table("can-fault", lambda row, number: kept())
    groups = list(dict.fromkeys(row.row.group for row in made.rows))
    assert [row.row.group for row in made.rows] == [group for group in groups for _ in made.rows[::2]], (
        "one after another"
    )
    assert {(one.group, one.second) for one in against(made)} == {(group, "DriveMCP") for group in groups}


def test_files_hold_every_run_and_row(tmp_path: Path) -> None:
    made = table("delta", lambda row, number: kept())
    files.write(tmp_path, [made])
    with (tmp_path / "runs.csv").open(encoding="utf-8") as file:
        runs = list(csv.DictReader(file))
    assert len(runs) == 2 * len(made.rows)
    assert runs[0]["hazard_response_s"] == "0.2 0.4"
    with (tmp_path / "delta.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert float(rows[0]["interventions [/10 km]"]) == 20.0
    assert float(rows[0]["interventions [/10 km] paper"]) == 3.2
    told = msgspec.json.decode((tmp_path / "delta.json").read_bytes())
    assert len(told["table"]["rows"]) == len(made.rows)
    assert len(COLUMNS["delta"]) == 3


def test_seconds_an_hour_have_the_interval_of_what_they_are() -> None:
    """One long run and five short ones, in which much went wrong: the short ones count for little, in the interval too."""
    (column,) = (each for each in columns_of("results") if each.title == "wrong limit")
    count, exposure = RATES[column.rate].count, RATES[column.rate].exposure
    runs = [{count: 0.0, exposure: 3600.0}, *({count: 30.0, exposure: 60.0} for _ in range(5))]
    value = value_of(column, runs)
    assert value.value == pytest.approx(150.0 / 3900.0 * 3600.0)
    assert value.low is not None
    assert value.high is not None
    assert value.value is not None
    assert value.low <= value.value <= value.high


def test_a_run_that_could_not_be_judged_is_in_no_share() -> None:
    unjudged = {**NUMBERS, "interventions": 4, "false_interventions": None}
    value = value_of(FALSE, [unjudged, {**NUMBERS, "interventions": 2, "false_interventions": 2}])
    assert (value.value, value.of) == (100.0, "2 of 2")


def test_what_happens_before_the_first_metre_is_counted() -> None:
    value = value_of(COLLISIONS, [{**NUMBERS, "collisions": 1, "distance_m": 0.0}, NUMBERS])
    assert (value.value, value.of) == (500.0, "1 in 2.0 km")


def test_a_ratio_beside_a_verdict_is_of_the_same_places() -> None:
    """DriveMCP alone drove the hard places: there it is worse, and that says nothing of the others."""

    def made(row: Row, number: int) -> Kept | None:
        ours = row.spec.method == "DriveMCP"
        if number > 1:
            return kept(infractions_total=50) if ours else None
        return kept(infractions_total=2 if ours else 4)

    found = next(
        one
        for one in orders(table("results", made, 4))
        if (one.column, one.first, one.second) == ("infractions", "VLM-Direct", "DriveMCP")
    )
    assert (found.our_ratio, found.places) == (2.0, 2)


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

"""Rows are compared place by place, and put beside the paper's orders: worked by hand."""

from typing import Any

import pytest

from evaluation.campaign.plan import Row
from evaluation.campaign.store import Kept
from evaluation.tables.compare import against, lines_of, orders, told_of, with_and_without_faults
from tests.unit.evaluation.evaluate.made import far, kept, table


@pytest.mark.parametrize(("places", "verdict"), [(7, "without a significant difference"), (8, "as in the paper")])
def test_orders_are_told_apart_place_by_place_once_there_are_eight(places: int, verdict: str) -> None:
    found = orders(table("results", far, places))
    of = {(one.group, one.first, one.second): one for one in found if one.column == "infractions"}
    assert of["CROSS-BORDER", "VLM-Direct", "DriveMCP"].verdict == verdict
    assert of["CROSS-BORDER", "VLM-Direct", "DriveMCP"].places == places
    assert of["CROSS-BORDER", "VLM-Direct", "DriveMCP"].paper_ratio == pytest.approx(4.5)
    assert of["CROSS-BORDER", "VLM-Direct", "VLM-Direct+RAG"].verdict == "without a significant difference"


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

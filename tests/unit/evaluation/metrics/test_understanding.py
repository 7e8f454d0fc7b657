"""Events and tools against those derived from truth, by hand."""

from typing import Any

import pytest

from evaluation.metrics import Record, Scores, measure, truth_events
from proto.truth import TrueHazard, Truth
from services.orchestrator.events import TABLE
from tests.unit.evaluation.metrics.logs import person, said, steady, ticked, truths


def ticks(seconds: float, *on: tuple[str, float, float], calls: dict[float, str] | None = None) -> tuple[Any, ...]:
    """Ten a second; (kind, from, to) are detected."""
    times = [round(0.1 * step, 1) for step in range(1, round(10 * seconds) + 1)]
    return tuple(
        ticked(
            time_s,
            tuple(kind for kind, from_s, to_s in on if from_s <= time_s <= to_s),
            (calls[time_s],) if calls and time_s in calls else (),
        )
        for time_s in times
    )


def scores(kind: str, truth: tuple[Truth, ...], *on: tuple[float, float]) -> Scores:
    record = Record(truths=truth, traces=ticks(truth[-1].time_s, *((kind, *each) for each in on)))
    return measure(record).events[kind]


def fast(from_s: float, to_s: float, share: float, seconds: float = 20.0) -> tuple[Truth, ...]:
    """Overspeed by a share of the limit in a stretch."""
    return truths(seconds, lambda t: {"speed_mps": 20.0 * (1 + share) if from_s <= t <= to_s else 20.0})


def test_all_kinds_that_truth_has_a_say_in_are_scored_and_the_others_named() -> None:
    kinds = {row.kind for row in TABLE}
    assert set(truth_events.KINDS) == kinds - {"uncertain_sign", "place_ahead", "stale_fact", "driver_query"}


def test_a_detection_that_touches_an_event_is_a_hit_and_each_event_counts_once() -> None:
    # 8 % is above 5/4 of the 5 % threshold
    assert scores("overspeed", fast(5.0, 10.0, 0.08), (6.0, 7.0)) == Scores(hit=1)
    assert scores("overspeed", fast(5.0, 10.0, 0.08), (6.0, 6.2), (8.0, 8.5)) == Scores(hit=1)


def test_an_event_that_nobody_detects_is_missed_and_one_that_is_not_there_is_false() -> None:
    assert scores("overspeed", fast(5.0, 10.0, 0.08)) == Scores(missed=1)
    # 1 s before and 2 s after are within the tolerance of this kind; 13 s is not
    assert scores("overspeed", fast(5.0, 10.0, 0.08), (11.5, 11.9)) == Scores(hit=1)
    assert scores("overspeed", fast(5.0, 10.0, 0.08), (13.0, 14.0)) == Scores(missed=1, false=1)


def test_about_the_threshold_a_detection_is_neither_asked_for_nor_false() -> None:
    # 5 %: between 3/4 and 5/4 of the threshold
    assert scores("overspeed", fast(5.0, 10.0, 0.05)) == Scores()
    assert scores("overspeed", fast(5.0, 10.0, 0.05), (6.0, 7.0)) == Scores()
    assert scores("overspeed", fast(5.0, 10.0, 0.03), (6.0, 7.0)) == Scores(false=1)
    # over 5/4 for a moment only: 0.2 s
    assert scores("overspeed", fast(5.0, 5.2, 0.08)) == Scores()


def test_f1_is_over_all_kinds() -> None:
    # overspeed: 1 hit. closing_lead: 1 false. F1 = 2 / (2 + 1)
    record = Record(
        truths=fast(5.0, 10.0, 0.08), traces=ticks(20.0, ("overspeed", 6.0, 9.0), ("closing_lead", 15.0, 16.0))
    )
    assert measure(record).event_f1 == pytest.approx(2 / 3)
    assert measure(Record(truths=steady(5.0), traces=ticks(5.0))).event_f1 is None


def test_f1_is_told_without_the_law_as_well() -> None:
    # overspeed: 1 missed. closing_lead: 1 false, then 1 hit of 24 m at 8 m/s from 10 s on: 2 / (2 + 1 + 1) and 2 / (2 + 1)
    def at(time_s: float) -> dict[str, Any]:
        near = {"gap_m": 24.0, "closing_mps": 8.0} if time_s >= 10.0 else {}
        return {"speed_mps": 21.6 if 5.0 <= time_s <= 8.0 else 20.0, **near}

    found = measure(
        Record(truths=truths(15.0, at), traces=ticks(15.0, ("closing_lead", 1.0, 2.0), ("closing_lead", 11.0, 12.0)))
    )
    assert found.event_f1 == pytest.approx(1 / 2)
    assert found.event_f1_without_law == pytest.approx(2 / 3)
    alone = measure(Record(truths=fast(5.0, 10.0, 0.08), traces=ticks(20.0, ("overspeed", 6.0, 9.0))))
    assert (alone.event_f1, alone.event_f1_without_law) == (1.0, None)


def test_a_closing_lead_must_be_detected_from_its_time_to_collision() -> None:
    # 1 / TTC above 0.25 * 5/4: below 3.2 s; 24 m at 8 m/s are 3 s, 40 m 5 s, 28 m 3.5 s
    for gap, expected in ((24.0, Scores(missed=1)), (28.0, Scores()), (40.0, Scores())):
        truth = truths(5.0, lambda t, gap=gap: {"speed_mps": 20.0, "gap_m": gap, "closing_mps": 8.0})  # type: ignore[misc]
        assert scores("closing_lead", truth) == expected


def test_who_comes_from_the_side_with_right_of_way_may_be_taken_for_a_closing_lead_while_he_does() -> None:
    hazards = (TrueHazard(kind="priority", onset_s=2.0, actor_id=481),)
    truth = truths(10.0, lambda t: {"speed_mps": 10.0, "hazards": hazards if 2.0 <= t <= 5.0 else ()})
    assert scores("closing_lead", truth, (3.0, 4.0)) == Scores()
    assert scores("closing_lead", truth) == Scores()
    assert scores("closing_lead", truth, (7.0, 8.0)) == Scores(false=1)


def test_a_red_light_asks_for_a_stop_by_the_deceleration_that_it_needs() -> None:
    # 10 m/s to 60 m with 1 m kept: 100 / 118 = 0.85 m/s2, above 0.5; at 1 m/s 1 / 118
    red = {"light": "red", "light_distance_m": 60.0}
    assert scores("stop_required", steady(3.0, 10.0, **red)) == Scores(missed=1)
    assert scores("stop_required", steady(3.0, 1.0, **red)) == Scores()
    assert scores("stop_required", steady(3.0, 10.0, light="green", light_distance_m=60.0), (1.0, 2.0)) == Scores(
        false=1
    )
    line = {"stop_kind": "stop_sign", "stop_distance_m": 60.0}
    assert scores("stop_required", steady(3.0, 10.0, **line), (1.0, 2.0)) == Scores(hit=1)


def test_people_in_the_path_must_be_seen_and_people_beside_it_may_be() -> None:
    kind = "vulnerable_road_user"
    assert scores(kind, steady(3.0, actors=(person(40.0),))) == Scores(missed=1)
    beside = steady(3.0, actors=(person(40.0, in_path=False, y_m=3.0),))
    assert (scores(kind, beside), scores(kind, beside, (1.0, 2.0))) == (Scores(), Scores())
    far = steady(3.0, actors=(person(40.0, in_path=False, y_m=9.0),))
    assert scores(kind, far, (1.0, 2.0)) == Scores(false=1)


def test_a_wet_road_may_and_a_slippery_one_must_be_called_so() -> None:
    # 1 - 0.48 / 0.8 = 0.4, above 0.375
    assert scores("low_friction", steady(9.0, mu=0.48, film_mm=1.0)) == Scores(missed=1)
    assert scores("low_friction", steady(9.0, mu=0.7, film_mm=0.3), (1.0, 9.0)) == Scores()
    assert scores("low_friction", steady(9.0, mu=0.8, film_mm=0.0), (1.0, 9.0)) == Scores(false=1)


def test_faults_are_scored_only_where_truth_tells_them() -> None:
    broken = truths(30.0, lambda t: {"speed_mps": 20.0, "faults": ("abs_unit",) if t > 5.0 else ()})
    assert scores("vehicle_fault", broken, (8.0, 30.0)) == Scores(hit=1)
    assert scores("vehicle_fault", steady(30.0), (8.0, 30.0)) == Scores(false=1)
    untold = Record(truths=steady(5.0, faults=None), traces=ticks(5.0, ("vehicle_fault", 1.0, 2.0)))
    assert "vehicle_fault" not in measure(untold).events


def test_changes_are_told_within_seconds_and_any_sign_passed_excuses_them() -> None:
    change = truths(30.0, lambda t: {"speed_mps": 20.0, "law_limit_mps": 20.0 if t < 15.0 else 25.0})
    assert scores("speed_limit_change", change, (16.0, 17.5)) == Scores(hit=1)
    assert scores("speed_limit_change", change, (20.0, 21.5)) == Scores(missed=1, false=1)
    assert scores("speed_limit_change", steady(30.0), (0.1, 1.5)) == Scores()  # all is new at the start

    def sign(time_s: float) -> dict[str, Any]:
        post = {"id": 7.0, "code": "limit:70", "country": "DEU", "x_m": 300.0 - 20 * time_s, "y_m": -4.0}
        return {"speed_mps": 20.0, "signs": (post,)}

    # its front is there after 14.9 s
    assert scores("speed_limit_change", truths(30.0, sign), (16.0, 17.5)) == Scores()
    assert scores("speed_limit_change", truths(30.0, sign), (25.0, 26.5)) == Scores(false=1)


def test_a_gantry_that_shows_something_else_than_the_last_is_an_update() -> None:
    def gantries(time_s: float) -> dict[str, Any]:
        shown = ((1.0, "led:80", 100.0), (2.0, "led:80", 300.0), (3.0, "led:60", 500.0), (4.0, "led:60", 502.0))
        signs = tuple({"id": i, "code": code, "x_m": at - 20 * time_s, "y_m": 0.0} for i, code, at in shown)
        return {"speed_mps": 20.0, "signs": signs}

    truth = truths(30.0, gantries)
    found = [row.span.from_s for row in truth_events.expected(Record(truths=truth))["dynamic_limit_update"] if row.due]
    assert found == pytest.approx([4.9, 24.9])


def test_what_a_gantry_shows_over_another_lane_is_no_update_of_ours() -> None:
    def gantries(time_s: float) -> dict[str, Any]:
        shown = ((100.0, ("led:lane_open", "led:100", "led:100")), (300.0, ("led:100", "led:100", "led:100")))
        signs = tuple(
            {"id": at + lane, "code": code, "x_m": at - 20 * time_s, "y_m": 3.6 * (1 - lane)}
            for at, codes in shown
            for lane, code in enumerate(codes)
        )
        return {"speed_mps": 20.0, "signs": signs}

    expected = truth_events.expected(Record(truths=truths(30.0, gantries)))
    assert [row.span.from_s for row in expected["dynamic_limit_update"] if row.due] == pytest.approx([4.9])


def test_signs_that_face_others_change_nothing() -> None:
    def gantry(time_s: float) -> dict[str, Any]:
        sign = {"id": 7.0, "code": "led:60", "x_m": 150.0 - 20 * time_s, "y_m": 8.0, "faces_ego": 0.0}
        return {"speed_mps": 20.0, "signs": (sign,)}

    expected = truth_events.expected(Record(truths=truths(10.0, gantry)))
    assert not any(row.due for row in expected["dynamic_limit_update"])


def test_a_foreign_plate_is_due_from_where_it_can_be_read() -> None:
    def post(time_s: float) -> dict[str, Any]:
        sign = {"id": 7.0, "code": "limit:70+plate:when_wet:de", "x_m": 150.0 - 20 * time_s, "y_m": -4.0}
        return {"speed_mps": 20.0, "signs": (sign,)}

    # nearer than 30 m from 6.05 s on, passed at 7.5 s
    (row,) = truth_events.expected(Record(truths=truths(10.0, post)))["foreign_sign"]
    assert row.span == pytest.approx((0.05, 7.45))
    assert row.due == pytest.approx((6.05, 7.45))


@pytest.mark.parametrize(("reads", "spoken_to_in", "due"), [("de", "en", False), ("en", "de", True), ("", "de", False)])
def test_what_is_foreign_is_the_drivers_matter_and_not_the_systems(reads: str, spoken_to_in: str, due: bool) -> None:
    def post(time_s: float) -> dict[str, Any]:
        sign = {"id": 7.0, "code": "limit:70+plate:when_wet:de", "x_m": 150.0 - 20 * time_s, "y_m": -4.0}
        return {"speed_mps": 20.0, "signs": (sign,)}

    record = Record(truths=truths(10.0, post, driver_language=reads), advisories=(said(1.0, language=spoken_to_in),))
    assert bool(truth_events.expected(record)["foreign_sign"]) is due


def test_a_plate_in_a_language_that_the_driver_does_not_read_is_foreign() -> None:
    assert truth_events.foreign("limit:70+plate:when_wet:de", "en")
    assert not truth_events.foreign("limit:70+plate:when_wet:de", "de")
    assert not truth_events.foreign("limit:70+plate:when_wet:drawn", "en")
    assert not truth_events.foreign("limit:70", "en")


def rate(
    truth: tuple[Truth, ...], *on: tuple[str, float, float], calls: dict[float, str] | None = None
) -> float | None:
    return measure(Record(truths=truth, traces=ticks(truth[-1].time_s, *on, calls=calls))).correct_tool_rate


def test_where_nothing_is_on_no_call_is_right() -> None:
    assert rate(steady(10.0)) == 1.0
    assert rate(steady(10.0), calls={7.0: "applicable_limit"}) == pytest.approx(0.99)


def test_the_tool_of_an_event_must_have_answered_a_second_after_it_began() -> None:
    # overspeed from 2 s to 8 s: due from 3 s on, 51 ticks of 100
    truth = fast(2.0, 8.0, 0.08, seconds=10.0)
    assert rate(truth) == pytest.approx(0.49)
    assert rate(truth, calls={2.5: "applicable_limit"}) == 1.0
    assert rate(truth, calls={5.0: "applicable_limit"}) == pytest.approx(0.80)


def test_right_of_way_is_needed_only_where_there_is_something_to_ask() -> None:
    walker = {"actors": (person(40.0),)}
    assert rate(steady(5.0, 3.0, **walker)) == 1.0
    assert rate(steady(5.0, 3.0, light="green", light_distance_m=80.0, **walker)) == pytest.approx(10 / 50, abs=0.03)


def test_what_goes_stale_may_be_asked_again() -> None:
    assert rate(steady(10.0), ("stale_fact", 5.0, 5.0), calls={5.0: "assess_weather"}) == 1.0

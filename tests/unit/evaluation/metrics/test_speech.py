"""Messages, nags, slow-downs, latencies, comfort: by hand."""

from typing import Any

import msgspec
import pytest
from msgspec import structs

from evaluation.metrics import RATES, At, Record, measure
from evaluation.statistics import poisson_ci
from proto.decision import Advisory
from tests.unit.evaluation.metrics.logs import hazard, limit, person, said, steady, truths


def nags(*spoken: At[Advisory], **truth: Any) -> int:
    return measure(Record(truths=steady(100.0, **truth), advisories=spoken)).nags


def of_limit(mps: float) -> dict[str, Any]:
    return {"legal_limit": limit(mps), "directive": f"Limit {mps * 3.6:.0f} km/h"}


def test_every_speak_is_a_message_and_an_uninterrupted_act_is_one() -> None:
    heard = (said(1.0), said(1.1, "SILENT"), said(2.0, "ACT"), said(2.1, "ACT"), said(2.2, "ACT"), said(4.0, "ACT"))
    assert measure(Record(truths=steady(5.0), advisories=heard)).messages == 3


def test_an_act_that_pauses_for_less_than_half_a_second_is_one_message_and_nags_nobody() -> None:
    def acted(*pauses: str, again_s: float) -> Record:
        silent = (said(1.0 + 0.1 * number, kind) for number, kind in enumerate(pauses, 1))
        return Record(truths=steady(5.0), advisories=(said(1.0, "ACT"), *silent, said(again_s, "ACT")))

    goes_on = measure(acted("SILENT", "SILENT", again_s=1.3))
    assert (goes_on.messages, goes_on.nags) == (1, 0)
    anew = measure(acted("SILENT", "SILENT", "SILENT", "SILENT", again_s=1.5))
    assert (anew.messages, anew.nags) == (2, 1)
    # what is spoken meanwhile is a message of its own
    assert measure(acted("SILENT", "SPEAK", again_s=1.3)).messages == 2


def test_the_same_said_again_is_a_nag_within_a_minute() -> None:
    assert nags(said(1.0), said(31.0)) == 1
    assert nags(said(1.0), said(62.0)) == 0
    assert nags(said(1.0), said(2.0, topic="friction")) == 0


def test_what_was_said_before_the_last_word_on_a_topic_is_a_nag_as_well() -> None:
    a, b = of_limit(20.0), of_limit(13.9)
    assert nags(said(1.0, **a), said(10.0, **b), said(20.0, **a), said(30.0, **b)) == 2
    # the first of them is 61 s ago, and what it was repeated by is not
    assert nags(said(1.0, **a), said(10.0, **b), said(62.0, **a)) == 0
    assert nags(said(1.0, **a), said(10.0, **b), said(59.0, **a), said(62.0, **a)) == 2


def test_a_limit_told_again_is_news_only_since_words_from_before_another_limit() -> None:
    # the law has 13.9 m/s from 10 to 20 s
    law = lambda t: {"speed_mps": 8.0, "law_limit_mps": 13.9 if 10.0 <= t <= 20.0 else 20.0}  # noqa: E731

    def told(*spoken: At[Advisory]) -> int:
        return measure(Record(truths=truths(60.0, law), advisories=spoken)).nags

    a, b = of_limit(20.0), of_limit(13.9)
    assert told(said(1.0, **a), said(11.0, **b), said(21.0, **a)) == 0
    # 13.9 was the law meanwhile, and is news again; the last repeats the third
    assert told(said(1.0, **a), said(11.0, **b), said(21.0, **a), said(30.0, **b), said(40.0, **a)) == 1


def test_a_standing_warning_waits_four_seconds_from_the_last_such_one() -> None:
    warning = {"topic": "lead", "hazard": "closing_lead", "urgency": "warning"}
    on, mild = {"hazards": (hazard("lead_brakes", 0.5),)}, {**warning, "urgency": "info"}
    assert nags(said(1.0, **warning), said(5.0, **warning), said(9.0, **warning), **on) == 0
    # 8 s after the first and 3 s after the second
    assert nags(said(1.0, **warning), said(6.0, **warning), said(9.0, **warning), **on) == 1
    # a milder word meanwhile is none such: 5 s
    assert nags(said(1.0, **warning), said(5.0, **mild), said(6.0, **warning), **on) == 0
    # where nothing is on, three of three repeat the first
    assert nags(said(1.0, **warning), said(5.0, **mild), said(6.0, **warning)) == 2


def test_a_red_light_is_told_again_once_the_last_was_over() -> None:
    red, green = {"topic": "stop", "directive": "Stop: red light"}, {"topic": "stop", "directive": "Green: go on"}
    spoken = (said(1.0, **red), said(10.0, **green), said(21.0, **red))

    def lights(*kinds: str) -> int:
        at = lambda t: {"speed_mps": 8.0, "stop_kind": kinds[min(2, int(t / 10.0))]}  # noqa: E731
        return measure(Record(truths=truths(30.0, at), advisories=spoken)).nags

    assert lights("red_light", "", "red_light") == 0
    assert lights("red_light", "stop_sign", "red_light") == 0
    # it stayed red, or came in sight between the words, or somebody had right of way at another line
    assert lights("red_light", "red_light", "red_light") == 1
    assert lights("", "red_light", "red_light") == 1
    assert lights("red_light", "yield", "red_light") == 1


def test_the_same_words_within_twenty_seconds_are_a_repeat_whatever_they_are_on() -> None:
    def told(*spoken: At[Advisory], **truth: Any) -> int | None:
        return measure(Record(truths=steady(60.0, **truth), advisories=spoken)).repeats_20s

    a, b = {"directive": "Brake"}, {"directive": "Limit 50 km/h"}
    assert told(said(1.0, **a), said(5.0, **b), said(20.9, **a)) == 1
    assert told(said(1.0, **a), said(21.1, **a)) == 0
    assert told(said(1.0, topic="lead", **a), said(5.0, topic="person", hazard="pedestrian", **a)) == 1
    warning = {"topic": "lead", "hazard": "closing_lead", "urgency": "warning", **a}
    on = {"hazards": (hazard("lead_brakes", 0.5),)}
    assert (nags(said(1.0, **warning), said(5.0, **warning), **on), told(said(1.0, **a), said(5.0, **a), **on)) == (
        0,
        1,
    )
    # 2 in 60 s at 20 m/s: 1.2 km
    found = msgspec.to_builtins(measure(Record(truths=steady(60.0), advisories=(said(1.0), said(2.0), said(3.0)))))
    row = RATES["repeats_20s"]
    assert found[row.count] / found[row.exposure] * row.per == pytest.approx(2 / 0.12)


@pytest.mark.parametrize(
    "news",
    [
        {"legal_limit": limit(13.9)},
        {"ahead_mps": 13.9},
        {"urgency": "warning"},
        {"hazard": "closing_lead"},
        {"target_mps": 18.0},  # 2 m/s lower; 5 km/h are 1.39
        {"degraded": ("rules",)},
    ],
)
def test_what_is_new_is_no_nag(news: dict[str, Any]) -> None:
    assert nags(said(1.0), said(5.0, **news)) == 0


@pytest.mark.parametrize("old", [{"target_mps": 19.0}, {"target_mps": 25.0}, {"target_mps": None}])
def test_a_target_hardly_lower_or_higher_is_no_news(old: dict[str, Any]) -> None:
    assert nags(said(1.0), said(5.0, **old)) == 1


def test_a_warning_may_be_repeated_while_its_hazard_is_on_and_not_sooner_than_after_four_seconds() -> None:
    warning = {"topic": "lead", "hazard": "closing_lead", "urgency": "warning"}
    on = {"hazards": (hazard("lead_brakes", 0.5),)}
    assert nags(said(1.0, **warning), said(5.0, **warning), **on) == 0
    assert nags(said(1.0, **warning), said(3.0, **warning), **on) == 1
    assert nags(said(1.0, **warning), said(5.0, **warning)) == 1


def test_a_warning_is_not_excused_by_another_hazard() -> None:
    lead = {"topic": "lead", "hazard": "closing_lead", "urgency": "warning"}
    walker = {"topic": "person", "hazard": "pedestrian", "urgency": "warning"}
    twice = {name: (said(1.0, **what), said(5.0, **what)) for name, what in (("lead", lead), ("person", walker))}
    light = {"hazards": (hazard("stop_line", 0.5),)}
    assert nags(*twice["lead"], **light) == nags(*twice["person"], **light) == 1
    assert nags(*twice["person"], hazards=(hazard("pedestrian", 0.5),)) == 0
    # a lead met in 6 s is the lead's matter; nobody closes in on the person who is not there
    assert nags(*twice["lead"], gap_m=30.0, closing_mps=5.0) == 0
    assert nags(*twice["person"], gap_m=30.0, closing_mps=5.0) == 1


@pytest.mark.parametrize(
    ("y_m", "across_mps", "nagged"), [(0.0, 0.0, 0), (-4.0, 1.3, 0), (-5.0, 1.3, 1), (-4.0, 0.0, 1)]
)
def test_a_person_in_the_way_or_soon_in_it_may_be_warned_of_again(y_m: float, across_mps: float, nagged: int) -> None:
    # 1.7 m beside is in the way; at 1.3 m/s he comes 2.86 m in 2.2 s
    walker = {"topic": "person", "hazard": "pedestrian", "urgency": "warning"}
    body = structs.replace(person(40.0, in_path=y_m == 0.0, y_m=y_m), vy_mps=across_mps)
    assert nags(said(1.0, **walker), said(5.0, **walker), actors=(body,)) == nagged


def test_another_word_on_a_light_is_no_nag_and_the_same_is() -> None:
    red, green = {"topic": "stop", "directive": "Stop: red light"}, {"topic": "stop", "directive": "Green: go on"}
    assert nags(said(1.0, **red), said(5.0, **green)) == 0
    assert nags(said(1.0, **red), said(5.0, **red)) == 1
    assert nags(said(1.0, directive="Limit 50 km/h"), said(5.0, directive="The limit is 50 km/h")) == 1


def test_a_word_on_another_place_to_give_way_at_is_no_nag() -> None:
    way = {"topic": "give_way", "directive": "Give way: drive 25 km/h"}
    # 20 m/s: 60 m take 3 s
    assert nags(said(1.0, **way), said(4.2, **way)) == 0
    assert nags(said(1.0, **way), said(3.8, **way)) == 1
    assert nags(said(1.0, topic="friction"), said(4.2, topic="friction")) == 1


def test_a_limit_is_told_again_after_the_law_had_another_one() -> None:
    def meanwhile(law_mps: float | None, **message: Any) -> int:
        law = lambda t: {"speed_mps": 8.0, "law_limit_mps": law_mps if 10.0 <= t <= 20.0 else 8.3}  # noqa: E731
        spoken = (said(1.0, **message), said(31.0, **message))
        return measure(Record(truths=truths(40.0, law), advisories=spoken)).nags

    assert meanwhile(25.0, topic="limit") == 0
    assert meanwhile(None, topic="ahead") == 0
    assert meanwhile(8.4, topic="limit") == 1
    assert meanwhile(25.0, topic="friction") == 1


OF_A_PERSON = {"topic": "person", "hazard": "pedestrian", "urgency": "alarm"}
OF_A_LEAD = {"topic": "lead", "hazard": "closing_lead", "urgency": "warning"}
OF_A_QUEUE = {"topic": "lead", "hazard": "slow_traffic", "urgency": "warning"}


@pytest.mark.parametrize(
    ("warning", "truth", "false"),
    [
        (OF_A_PERSON, {}, 1),
        (OF_A_PERSON, {"actors": (person(40.0),)}, 0),
        (OF_A_PERSON, {"actors": (person(40.0, in_path=False, y_m=6.0),)}, 1),
        (OF_A_PERSON, {"gap_m": 20.0, "closing_mps": 10.0}, 1),  # another one is no reason
        (OF_A_PERSON, {"hazards": (hazard("pedestrian", 4.0),)}, 0),
        (OF_A_LEAD, {}, 1),
        (OF_A_LEAD, {"gap_m": 49.0, "closing_mps": 10.0}, 0),
        (OF_A_LEAD, {"gap_m": 60.0, "closing_mps": 10.0}, 1),
        (OF_A_QUEUE, {"gap_m": 79.0, "closing_mps": 10.0}, 0),
        (OF_A_QUEUE, {"gap_m": 90.0, "closing_mps": 10.0}, 1),
        (OF_A_LEAD, {"gap_m": 8.0, "closing_mps": 0.0}, 0),  # nearer than RSS allows
        (OF_A_LEAD, {"actors": (person(40.0),)}, 1),
        (OF_A_LEAD, {"hazards": (hazard("priority", 4.0),)}, 0),
        ({"topic": "stop", "hazard": "red_light", "urgency": "warning"}, {}, 0),  # no road user
        ({"topic": "person", "urgency": "advice"}, {}, 0),  # no warning
    ],
)
def test_a_warning_of_a_road_user_that_truth_does_not_know_is_false(
    warning: dict[str, Any], truth: dict[str, Any], false: int
) -> None:
    record = Record(truths=steady(10.0, **truth), advisories=(said(5.0, **warning),))
    assert measure(record).false_warnings == false


@pytest.mark.parametrize(("at_s", "false"), [(3.9, 1), (4.1, 0), (5.9, 0), (6.3, 1)])
def test_a_warning_is_founded_by_what_is_there_within_a_second(at_s: float, false: int) -> None:
    there = lambda t: {"speed_mps": 10.0, "actors": (person(30.0),) if at_s <= t < at_s + 0.1 else ()}  # noqa: E731
    record = Record(truths=truths(10.0, there), advisories=(said(5.0, **OF_A_PERSON),))
    assert measure(record).false_warnings == false


def slowing(**always: Any) -> Record:
    """From 20 to 15 m/s between 2 and 7 s, after advice to drive 15 at 1 s."""
    at = lambda t: {"speed_mps": min(20.0, max(15.0, 22.0 - t)), **always}  # noqa: E731
    return Record(truths=truths(15.0, at), advisories=(said(1.0, target_mps=15.0),))


def test_a_slow_down_without_a_cause_is_unnecessary() -> None:
    assert measure(slowing()).unnecessary_slow_downs == 1


@pytest.mark.parametrize(
    "cause",
    [
        {"hazards": (hazard("deep_water", 1.0),)},
        {"stop_kind": "red_light"},
        {"light": "red"},
        {"law_limit_mps": 14.0},
        {"mu": 0.5},
        {"gap_m": 25.0, "closing_mps": 0.0},  # 1.25 s
        {"gap_m": 100.0, "closing_mps": 14.0},  # 7.1 s
        {"visibility_m": 40.0},  # 20 m/s: 25 m of reaction and 25.5 m of braking
    ],
)
def test_a_slow_down_with_a_cause_is_none(cause: dict[str, Any]) -> None:
    assert measure(slowing(**cause)).unnecessary_slow_downs == 0


def test_the_mean_target_is_over_all_advisories_that_have_one() -> None:
    told = (said(1.0, target_mps=10.0), said(1.1, kind="SILENT", target_mps=16.0), said(1.2, target_mps=None))
    assert measure(Record(truths=steady(3.0), advisories=told)).target_mean_mps == pytest.approx(13.0)
    assert measure(Record(truths=steady(3.0), advisories=told[2:])).target_mean_mps is None


def test_advice_that_nobody_follows_slows_nobody_down() -> None:
    record = Record(truths=steady(15.0), advisories=(said(1.0, target_mps=15.0),))
    assert measure(record).unnecessary_slow_downs == 0


def test_latencies_are_the_advisories_own() -> None:
    told = [
        said(1.0, event_to_advice_ms=4.0, snapshot_to_advice_ms=10.0),
        said(2.0, "SILENT", snapshot_to_advice_ms=30.0),
    ]
    found = measure(Record(truths=steady(3.0), advisories=tuple(told)))
    assert found.advisory_latency_s == pytest.approx((0.004,))
    assert found.sensor_latency_p50_s == pytest.approx(0.020)


def test_braking_and_jerk_over_half_seconds() -> None:
    # 20 m/s, from 2 to 4 s at -4 m/s2, then 12 m/s
    record = Record(truths=truths(8.0, lambda t: {"speed_mps": 20.0 - 4.0 * min(2.0, max(0.0, t - 2.0))}))
    found = measure(record)
    assert found.hardest_braking_mps2 == pytest.approx(4.0)
    assert found.hard_brakings == 1
    # The mean deceleration climbs by 4 within half a second and falls as fast: the half-second differences rise evenly to
    # 4 and fall again, twice, 8 m/s3 at the top: 2 * 1 s of a triangle of height 8, mean square 8^2 / 3 over that 2 s,
    # of the 7 s that have differences: sqrt(64 / 3 * 2 / 7)
    assert found.jerk_rms_mps3 == pytest.approx((64 / 3 * 2 / 7) ** 0.5, rel=0.02)


def test_rates_pool_counts_over_exposures() -> None:
    # 100 s at 20 m/s are 2 km; 3 messages: 15 per 10 km
    found = measure(Record(truths=steady(100.0), advisories=tuple(said(at, topic=str(at)) for at in (1.0, 2.0, 3.0))))
    row, values = RATES["messages"], msgspec.to_builtins(found)
    rate = poisson_ci(values[row.count], values[row.exposure], row.per)
    assert rate.value == pytest.approx(15.0)
    # Garwood for 3: 0.61867 to 8.76727
    assert (rate.low, rate.high) == pytest.approx((0.61867 * 5, 8.76727 * 5), abs=1e-3)


def test_every_rate_is_made_of_fields_that_are_there() -> None:
    fields = {field.name for field in msgspec.structs.fields(type(measure(Record())))}
    assert {row.count for row in RATES.values()} | {row.exposure for row in RATES.values()} <= fields

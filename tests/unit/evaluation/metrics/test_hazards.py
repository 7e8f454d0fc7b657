"""Response to hazards and time to collision at the first escalation, by hand."""

from typing import Any

import pytest
from msgspec import structs

from evaluation.metrics import At, Record, hazards, measure
from evaluation.metrics.conflicts import EGO_LENGTH_M
from evaluation.metrics.metrics import Metrics
from proto.decision import Advisory
from proto.truth import TrueHazard, Truth
from services.simulator.driver.profile import MEDIAN_REACTION_S
from tests.unit.evaluation.metrics.logs import hazard, person, said, truths

LEAD = {"topic": "lead", "hazard": "closing_lead", "urgency": "warning"}


BEFORE = -1.0


def answered_s(found: Metrics) -> tuple[float, ...]:
    """The responses, and `BEFORE` for each hazard that was answered before its onset."""
    return (BEFORE,) * (found.hazards_answered_before or 0) + found.hazard_response_s


def braking_lead(onset_s: float = 2.0, over_s: float = 8.0) -> tuple[Truth, ...]:
    """From the onset on the gap of 100 m shrinks by 10 m/s."""

    def at(time_s: float) -> dict[str, Any]:
        on = onset_s <= time_s <= over_s
        gap = 100.0 - 10.0 * max(0.0, time_s - onset_s)
        return {
            "speed_mps": 20.0,
            "gap_m": gap,
            "closing_mps": 10.0 if on else 0.0,
            "hazards": (hazard("lead_brakes", onset_s),) if on else (),
        }

    return truths(10.0, at)


def test_response_is_from_onset_to_the_first_word_that_names_the_hazard() -> None:
    spoken = (said(2.5), said(3.0, **LEAD), said(4.0, **LEAD))
    found = measure(Record(truths=braking_lead(), advisories=spoken))
    assert (found.hazards, found.hazards_answered) == (1, 1)
    assert found.hazard_response_s == pytest.approx((1.0,))
    # at 3.0 s the gap is 90 m at 10 m/s
    assert found.ttc_escalation_s == pytest.approx((9.0,))


def test_a_word_too_late_for_the_median_driver_is_no_response() -> None:
    # 10 m/s: 1.25 s of reaction are 12.5 m, braking with 0.8 g = 7.85 m/s2 takes 6.4 m: 18.9 m, left at 2 + 8.1 s.
    late = braking_lead(over_s=10.0)
    assert pytest.approx(1.25) == MEDIAN_REACTION_S
    assert measure(Record(truths=late, advisories=(said(9.9, **LEAD),))).hazards_answered == 1

    def nearer(time_s: float) -> dict[str, Any]:
        gap = 38.8 - 10.0 * max(0.0, time_s - 2.0)
        on = 2.0 <= time_s <= 5.0
        now = (hazard("lead_brakes", 2.0),) if on else ()
        return {"speed_mps": 20.0, "gap_m": max(gap, 0.0), "closing_mps": 10.0, "hazards": now}

    # 38.8 m at the onset: at 3.9 s 19.8 m are left, at 4.0 s 18.8 m
    early, too_late = (Record(truths=truths(6.0, nearer), advisories=(said(at, **LEAD),)) for at in (3.9, 4.0))
    assert measure(early).hazard_response_s == pytest.approx((1.9,))
    assert measure(too_late).hazard_response_s == ()
    assert (measure(too_late).hazards, measure(too_late).hazards_answered) == (1, 0)
    # an intervention is an answer though its words, just heard in the alarm, are not said again
    alarm, acts = said(4.0, **LEAD | {"urgency": "alarm"}), tuple(said(4.5 + n / 10.0, "ACT", **LEAD) for n in range(3))
    braked = Record(truths=truths(6.0, nearer), advisories=(alarm, *acts))
    assert [each.time_s for each in braked.spoken] == [4.0]
    assert measure(braked).hazard_response_s == pytest.approx((2.5,))
    # it has escalated all the same
    assert measure(too_late).ttc_escalation_s == pytest.approx((1.88,))


def test_an_intervention_counts_however_late() -> None:
    found = measure(Record(truths=braking_lead(over_s=10.0), advisories=(said(9.95, "ACT", **LEAD),)))
    assert found.hazard_response_s == pytest.approx((7.95,))


def test_a_warning_that_still_stands_at_the_onset_is_an_answer_before_it_and_no_response() -> None:
    found = measure(Record(truths=braking_lead(onset_s=5.0), advisories=(said(3.0, **LEAD),)))
    assert found.hazard_response_s == ()
    assert (found.hazards_answered, found.hazards_answered_before) == (1, 1)
    long_ago = Record(truths=braking_lead(onset_s=9.0, over_s=9.5), advisories=(said(3.0, **LEAD),))
    assert measure(long_ago).hazards_answered == 0


def beside(spoken_s: float, lead_m: float, cutter_m: float, told_m: float | None = None) -> Record:
    """At 20 m/s behind a steady lead; from 2.0 s on somebody from the next lane, who is 8 m/s slower, is a hazard.

    `cutter_m` is his gap at 2.0 s.
    """

    def at(time_s: float) -> dict[str, Any]:
        gap = cutter_m - 8.0 * (time_s - 2.0)
        body = person(gap + (0.4 + EGO_LENGTH_M) / 2, 8.0, in_path=time_s >= 2.0, number=7)
        on = TrueHazard(kind="cut_in", onset_s=2.0, actor_id=7, distance_m=told_m and gap)
        return {
            "speed_mps": 20.0,
            "gap_m": lead_m,
            "closing_mps": 0.0,
            "actors": (structs.replace(body, kind="vehicle"),),
            "hazards": (on,) if time_s >= 2.0 else (),
        }

    return Record(truths=truths(4.0, at), advisories=(said(spoken_s, **LEAD),))


@pytest.mark.parametrize("told_m", [None, 1.0])
def test_who_cuts_in_is_measured_by_his_own_gap_and_not_by_the_leads(told_m: float | None) -> None:
    # 0.1 s before the onset he is 24.8 m away: 3.1 s; 0.5 s after it 20 m: 2.5 s
    assert measure(beside(1.9, 130.0, 24.0, told_m)).ttc_escalation_s == pytest.approx((3.1,))
    assert measure(beside(2.5, 130.0, 24.0, told_m)).ttc_escalation_s == pytest.approx((2.5,))
    # the median driver needs 8 * 1.25 + 64 / (2 * 7.85) = 14.1 m: 14.4 m are enough, 13.8 m are too few
    assert measure(beside(1.9, 130.0, 13.6, told_m)).hazards_answered_before == 1
    assert measure(beside(1.9, 130.0, 13.0, told_m)).hazards_answered == 0


def test_a_word_before_the_onset_has_to_leave_room_to_stop_as_well() -> None:
    # At 13.9 m/s the median driver needs 17.4 + 12.3 = 29.7 m to a yield line. Somebody comes from the right at 2.0 s,
    # when it is 27.4 m away; 0.1 s earlier it was 28.8 m, 0.2 s earlier 30.2 m.
    def at(time_s: float) -> dict[str, Any]:
        on = (hazard("priority", 2.0, 27.4 - 13.9 * (time_s - 2.0)),) if time_s >= 2.0 else ()
        return {"speed_mps": 13.9, "hazards": on}

    what = {"topic": "lead", "hazard": "give_way", "urgency": "warning"}
    early, late = (measure(Record(truths=truths(3.0, at), advisories=(said(t, **what),))) for t in (1.8, 1.9))
    assert (early.hazards_answered_before, late.hazards_answered_before) == (1, 0)
    assert (late.hazards, late.hazards_answered) == (1, 0)
    # (27.4 + 0.2 * 13.9) / 13.9, and with 0.1 s
    assert early.ttc_escalation_s == pytest.approx((2.171,), abs=1e-3)
    assert late.ttc_escalation_s == pytest.approx((2.071,), abs=1e-3)


def test_of_two_hazards_of_a_kind_each_has_its_own_distance() -> None:
    def at(time_s: float) -> dict[str, Any]:
        lines = (hazard("stop_line", 0.05, 20.0), hazard("stop_line", 2.0, 60.0))
        return {"speed_mps": 10.0, "hazards": lines if time_s >= 2.0 else lines[:1]}

    stop = said(2.5, topic="stop", hazard="stop_sign", urgency="warning")
    assert measure(Record(truths=truths(3.0, at), advisories=(stop,))).ttc_escalation_s == pytest.approx((2.0, 6.0))


def test_advice_stands_longer_than_a_warning_as_it_does_with_the_driver() -> None:
    def line(time_s: float) -> dict[str, Any]:
        now = (hazard("stop_line", 12.0, 100.0 - 10.0 * (time_s - 12.0)),) if time_s >= 12.0 else ()
        return {"speed_mps": 10.0, "hazards": now}

    ahead = {"topic": "stop", "urgency": "advice"}
    early, firm = (
        Record(truths=truths(15.0, line), advisories=(said(4.0, **each),))
        for each in (ahead, {**ahead, "urgency": "warning", "hazard": "stop_sign"})
    )
    assert measure(early).hazards_answered_before == 1
    assert measure(firm).hazards_answered == 0


def test_limit_advice_and_mere_advice_escalate_nothing() -> None:
    advice = said(3.0, **{**LEAD, "urgency": "advice"})
    limit = said(3.2, urgency="warning", topic="limit", hazard="")
    found = measure(Record(truths=braking_lead(), advisories=(advice, limit)))
    assert found.ttc_escalation_s == ()
    assert found.hazard_response_s == pytest.approx((1.0,))


@pytest.mark.parametrize(
    ("closing_mps", "ttcs_s"), [(-1.0, ()), (0.05, ()), (0.104, ()), (2.4, ()), (2.5, (20.0,)), (5.0, (10.0,))]
)
def test_nobody_closing_in_has_no_time_to_collision(closing_mps: float, ttcs_s: tuple[float, ...]) -> None:
    def at(time_s: float) -> dict[str, Any]:
        now = (hazard("lead_brakes", 0.05),)
        return {"speed_mps": 20.0, "gap_m": 50.0, "closing_mps": closing_mps, "hazards": now}

    found = measure(Record(truths=truths(3.0, at), advisories=(said(1.0, **LEAD),)))
    assert (found.ttc_escalation_s, found.hazards_answered) == (ttcs_s, 1)


def test_another_hazards_name_is_no_answer() -> None:
    wrong = said(3.0, topic="person", hazard="pedestrian", urgency="warning")
    assert measure(Record(truths=braking_lead(), advisories=(wrong,))).hazards_answered == 0


def schooled(distance_m: float, **what: Any) -> Record:
    both = (hazard("lead_brakes", 1.0), hazard("school_zone", 1.5, distance_m))
    return Record(truths=truths(3.0, lambda t: {"speed_mps": 14.0, "hazards": both}), advisories=(said(2.0, **what),))


def test_two_hazards_at_once_are_two() -> None:
    record = schooled(60.0, topic="ahead", asked_mps=8.3)
    assert [each.kind for each in hazards.episodes(record)] == ["lead_brakes", "school_zone"]
    assert (measure(record).hazards, measure(record).hazards_answered) == (2, 1)
    assert measure(record).hazard_response_s == pytest.approx((0.5,))


def test_a_school_is_named_by_its_own_limit_and_by_one_that_asks_for_less_speed() -> None:
    assert measure(schooled(60.0, topic="ahead", asked_mps=14.5)).hazards_answered == 0
    assert measure(schooled(60.0, topic="ahead", asked_mps=14.5, ahead_mps=8.3)).hazards_answered == 1
    assert measure(schooled(60.0, topic="ahead", asked_mps=14.5, ahead_mps=15.0)).hazards_answered == 0
    assert measure(schooled(60.0, topic="limit", asked_mps=8.3)).hazards_answered == 0
    assert measure(schooled(-5.0, topic="limit", asked_mps=8.3)).hazards_answered == 1


def test_hazards_and_their_answers_are_told_kind_by_kind() -> None:
    def at(time_s: float) -> dict[str, Any]:
        lead = (hazard("lead_brakes", 2.0),) if 2.0 <= time_s <= 4.0 else ()
        again = (hazard("lead_brakes", 6.0),) if 6.0 <= time_s <= 8.0 else ()
        walker = (hazard("pedestrian", 3.0),) if 3.0 <= time_s <= 4.0 else ()
        return {"speed_mps": 10.0, "hazards": (*lead, *again, *walker)}

    spoken = (said(2.5, **LEAD), said(7.5, **LEAD))
    found = measure(Record(truths=truths(10.0, at), advisories=spoken))
    assert found.hazards_by_kind == {"lead_brakes": 2, "pedestrian": 1}
    assert found.hazards_answered_by_kind == {"lead_brakes": 2, "pedestrian": 0}
    assert found.hazard_response_by_kind_s["lead_brakes"] == pytest.approx((0.5,))
    assert found.hazards_answered_before == 1, "the word at 2.5 s stands to 6.5"
    assert found.hazard_response_by_kind_s["pedestrian"] == ()
    assert measure(Record()).hazards_by_kind == {}


def to_line(stop_kind: str, *spoken: At[Advisory], nearer_m: float | None = None) -> tuple[float, ...]:
    """At 10 m/s to a line that is a hazard from 5.0 s on, 90 m ahead; till then truth has one stop at another, so much nearer."""

    def at(time_s: float) -> dict[str, Any]:
        room = 90.0 - 10.0 * (time_s - 5.0)
        if time_s >= 5.0:
            return {
                "speed_mps": 10.0, "stop_kind": stop_kind, "stop_distance_m": room,
                "hazards": (hazard("stop_line", 5.0, room),),
            }  # fmt: skip
        other = {"stop_kind": "red_light", "stop_distance_m": room - nearer_m} if nearer_m is not None else {}
        return {"speed_mps": 10.0, **other}

    return answered_s(measure(Record(truths=truths(10.0, at), advisories=spoken)))


@pytest.mark.parametrize(
    ("stop_kind", "named", "answered"),
    [
        ("red_light", "red_light", True),
        ("red_light", "stop_sign", False),
        ("stop_sign", "red_light", False),
        ("stop_sign", "stop_sign", True),
        ("stop_sign", "", True),  # advice names neither
        ("", "red_light", True),  # truth does not tell
    ],
)
def test_a_word_on_a_light_is_no_answer_to_a_stop_sign(stop_kind: str, named: str, answered: bool) -> None:
    found = to_line(stop_kind, said(6.0, topic="stop", hazard=named, urgency="warning"))
    assert found == (pytest.approx((1.0,)) if answered else ())


@pytest.mark.parametrize(
    ("nearer_m", "answered"), [(None, True), (0.0, True), (9.0, True), (11.0, False), (60.0, False)]
)
def test_a_word_while_a_nearer_line_has_one_stop_is_on_that_one(nearer_m: float | None, answered: bool) -> None:
    advice = {"topic": "stop", "urgency": "advice"}
    assert to_line("red_light", said(2.0, **advice), nearer_m=nearer_m) == ((BEFORE,) if answered else ())
    # said again at the line itself
    late = to_line("red_light", said(2.0, **advice), said(6.0, **advice), nearer_m=nearer_m)
    assert late == pytest.approx((BEFORE,) if answered else (1.0,))


def test_deep_water_is_answered_by_a_word_that_asks_for_less_speed_than_is_driven() -> None:
    def told(at_s: float, **what: Any) -> tuple[float, ...]:
        wet = truths(3.0, lambda t: {"speed_mps": 14.0, "hazards": (hazard("deep_water", 1.0, 60.0),)})
        return answered_s(
            measure(Record(truths=wet, advisories=(said(at_s, topic="caution", hazard="deep_water", **what),)))
        )

    assert told(1.75, asked_mps=9.7) == pytest.approx((0.75,))
    assert told(0.75, asked_mps=9.7) == (BEFORE,), "before its onset, and still kept to"
    assert told(1.75, asked_mps=14.5) == (), "faster than is driven"
    assert told(1.75, asked_mps=None) == ()


def test_a_truth_that_tells_only_the_oldest_hazard_is_understood() -> None:
    record = Record(truths=truths(3.0, lambda t: {"speed_mps": 10.0, "hazard": "cut_in", "hazard_onset_s": 0.5}))
    assert [each.kind for each in hazards.episodes(record)] == ["cut_in"]


@pytest.mark.parametrize(
    ("changes", "well"),
    [
        ({}, True),
        ({"infraction": "speeding"}, False),
        ({"collision": True}, False),
        ({"acceleration_mps2": -3.6}, False),
        ({"gap_m": 12.0}, False),  # 10 m/s within 12 m take 4.2 m/s2
    ],
    ids=["well", "infraction", "contact", "braked hard", "too near"],
)
def test_an_unanswered_hazard_was_met_well_where_nothing_happened_and_ordinary_braking_sufficed(
    changes: dict[str, Any], well: bool
) -> None:
    met = tuple(structs.replace(each, **changes) if each.time_s >= 3.0 else each for each in braking_lead(over_s=5.0))
    found = measure(Record(truths=met))
    assert (found.hazards, found.hazards_answered, found.hazards_met_untold) == (1, 0, int(well))
    warned = measure(Record(truths=met, advisories=(said(2.5, **LEAD),)))
    assert (warned.hazards_answered, warned.hazards_met_untold) == (1, 0)


def test_deep_water_is_never_met_well_without_a_word() -> None:
    on = (hazard("deep_water", 2.0),)
    found = measure(Record(truths=truths(4.0, lambda at_s: {"speed_mps": 20.0, "hazards": on if at_s >= 2.0 else ()})))
    assert (found.hazards, found.hazards_met_untold) == (1, 0)

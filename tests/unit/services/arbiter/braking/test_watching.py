"""Whom the arbiter itself warns of, and who hides whom."""

import math
from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from msgspec.structs import replace

from proto.decision import Urgency
from proto.perception import Track
from services.arbiter.assessment.assess import View, measure, speak_bounds
from services.arbiter.assessment.reading import Reading
from services.arbiter.braking.act import Permission
from services.arbiter.braking.watching import shrinks, watch
from services.arbiter.decide import decide
from services.arbiter.state import Sighting, fresh
from tests.unit.services.arbiter.support import (
    CALIBRATED,
    FEW,
    SECOND,
    fused,
    mirror,
    request,
    track,
    tracks,
    watched,
    with_view,
)


def test_what_is_passed_is_not_shouted_about_and_what_is_met_or_cuts_in_is() -> None:
    def shouts(**fields: Any) -> bool:
        lead = track(gap_m=15.0, **fields)
        quiet = request(lead, fused=fused(new_information=False))
        return decide(quiet, mirror(quiet, permission=Permission()), CALIBRATED).decision.hazard != ""

    assert not shouts(closing_mps=20.0, clearance_m=0.1)
    assert not shouts(closing_mps=35.0, clearance_m=0.1, oncoming=True)
    assert shouts(closing_mps=20.0, clearance_m=-0.1)
    assert shouts(closing_mps=20.0)
    assert shouts(closing_mps=10.0, clearance_m=0.1)
    assert not shouts(closing_mps=20.0, steady_s=0.0), "seen again for the first time"
    assert shouts(closing_mps=20.0, steady_s=None)


@given(
    confidence=st.floats(0.45, 1.0), age_s=st.floats(0.3, 3.0), vy_mps=st.floats(-9.0, 9.0), oncoming=st.booleans(),
    kind=st.sampled_from(["vehicle", "pedestrian"]),
)  # fmt: skip
def test_a_vehicle_that_is_doubted_is_shouted_about_once_it_is_known(
    confidence: float, age_s: float, vy_mps: float, *, oncoming: bool, kind: str
) -> None:
    thing = track(confidence=confidence, age_s=age_s, vy_mps=vy_mps, closing_mps=20.0, oncoming=oncoming, kind=kind)
    quiet = request(thing, fused=fused(new_information=False))
    hazard = decide(quiet, mirror(quiet, permission=Permission()), CALIBRATED).decision.hazard
    certain, known = confidence >= 0.7, age_s >= 1.0 or abs(vy_mps) >= 2.0
    believed = kind != "vehicle" or ((certain and known) if oncoming else (certain or known))
    assert (hazard != "") is believed


@given(
    across_mps=st.floats(2.1, 9.0), sigma_mps=st.one_of(st.none(), st.floats(0.1, 4.0)), age_s=st.floats(0.3, 3.0),
    confidence=st.floats(0.45, 1.0), clearance_m=st.one_of(st.none(), st.floats(-1.0, 6.0)),
)  # fmt: skip
def test_a_vehicle_that_may_only_seem_to_come_from_the_side_is_shouted_about_once_it_is_certain_and_known(
    across_mps: float, sigma_mps: float | None, age_s: float, confidence: float, clearance_m: float | None
) -> None:
    thing = track(
        confidence=confidence, age_s=age_s, vy_mps=-across_mps, sigma_vy_mps=sigma_mps, clearance_m=clearance_m,
        closing_mps=20.0,
    )  # fmt: skip
    quiet = request(thing, fused=fused(new_information=False))
    hazard = decide(quiet, mirror(quiet, permission=Permission()), CALIBRATED).decision.hazard
    surely, aside = sigma_mps is None or across_mps >= 4.0 * sigma_mps, clearance_m is not None and clearance_m > 0.0
    certain, known = confidence >= 0.7, age_s >= 1.0
    assert (hazard != "") is (surely or ((certain and known) if aside else (certain or known)))


def test_whose_near_end_is_beside_us_is_not_shouted_about_unless_it_leaves_no_room() -> None:
    def shouts(**fields: Any) -> bool:
        lead = track(gap_m=-0.5, closing_mps=8.0, **fields)
        quiet = request(lead, fused=fused(new_information=False))
        return decide(quiet, mirror(quiet, permission=Permission()), CALIBRATED).decision.hazard != ""

    assert not shouts(clearance_m=0.4)
    assert not shouts(clearance_m=0.4, vy_mps=1.5)
    assert shouts(clearance_m=-0.1)
    assert shouts(clearance_m=None)


@pytest.mark.parametrize(("ego_mps", "told"), [(0.2, False), (0.5, False), (1.0, True), (3.0, True)])
def test_who_stands_is_not_told_to_brake_for_a_vehicle(ego_mps: float, told: bool) -> None:
    near = track(gap_m=1.0, closing_mps=2.0)
    quiet = request(near, ego_speed_mps=ego_mps, fused=fused(new_information=False))
    assert (decide(quiet, mirror(quiet, permission=Permission()), CALIBRATED).decision.hazard != "") is told


@given(
    ego_mps=st.floats(1.0, 30.0) | st.none(), gap_m=st.floats(2.0, 12.0), confidence=st.floats(0.2, 1.0),
    beyond=st.fixed_dictionaries(
        {"oncoming": st.booleans(), "confidence": st.floats(0.7, 1.0), "age_s": st.floats(1.0, 4.0)}
    ),
)  # fmt: skip
def test_who_is_surely_next_hides_others_from_the_words_unless_they_surely_show(
    ego_mps: float | None, gap_m: float, confidence: float, beyond: dict[str, Any]
) -> None:
    assume(beyond["oncoming"] or ego_mps is None or ego_mps > 8.0)  # else it would drive backwards
    following = track(gap_m=gap_m, closing_mps=0.0, track_id=8, confidence=confidence)
    behind_it = track(gap_m=15.0, closing_mps=8.0, **beyond)
    quiet = request(behind_it, ego_speed_mps=ego_mps, fused=fused(new_information=False))
    inputs = with_view(mirror(quiet, permission=Permission()), actors=(following, behind_it))
    crawls, shows = ego_mps is not None and ego_mps < 5.0, beyond["age_s"] >= 2.0
    hidden = confidence >= CALIBRATED.act_confidence and (crawls or not shows)
    decision = decide(quiet, inputs, CALIBRATED).decision
    would_brake = decision.reason.startswith("ACT withheld")  # that needs more than a word does
    assert (decision.hazard == "" or would_brake) is (hidden or would_brake)
    assert decision.metrics.r >= decide(quiet, mirror(quiet, permission=Permission()), CALIBRATED).decision.metrics.r


@pytest.mark.parametrize(
    ("next_one", "other"),
    [
        ({"gap_m": 8.0, "closing_mps": 0.0}, {"kind": "pedestrian"}),
        ({"gap_m": 8.0, "closing_mps": 0.0, "in_ego_path": False}, {}),
        ({"gap_m": 8.0, "closing_mps": 0.0, "unseen_s": 0.9}, {}),
        ({"gap_m": 8.0, "closing_mps": 0.0, "kind": "pedestrian"}, {}),
        ({"gap_m": 13.5, "closing_mps": 0.0}, {}),
        ({"gap_m": -0.5, "closing_mps": 0.0}, {}),
        ({"gap_m": 8.0, "closing_mps": 0.0, "age_s": 0.9}, {}),
        ({"gap_m": 8.0, "closing_mps": 0.0, "confidence": 0.69}, {}),
        ({"gap_m": 8.0, "closing_mps": 7.0}, {}),
    ],
)
def test_nobody_else_hides_anyone_nor_is_a_person_hidden(next_one: dict[str, Any], other: dict[str, Any]) -> None:
    behind_it = track(gap_m=15.0, closing_mps=8.0, oncoming=True, **other)
    quiet = request(ego_speed_mps=4.0, fused=fused(new_information=False))
    inputs = with_view(mirror(quiet), actors=(track(track_id=8, **next_one), behind_it))
    state = watched(inputs.state, inputs.reading.view, inputs.now_ns, CALIBRATED)
    assert decide(quiet, replace(inputs, permission=Permission(), state=state), CALIBRATED).decision.hazard != ""


@pytest.mark.parametrize("looks", range(5))
@pytest.mark.parametrize("oncoming", [False, True])
def test_a_vehicle_that_comes_is_shouted_about_once_three_pictures_show_it_in_the_way(
    looks: int, *, oncoming: bool
) -> None:
    """`looks` before the present one."""
    thing = track(gap_m=30.0, closing_mps=20.0, oncoming=oncoming)
    quiet = request(thing, fused=fused(new_information=False))
    inputs = mirror(quiet, permission=Permission())
    seen = inputs.state.sightings
    state = replace(inputs.state, sightings=seen[len(seen) - looks :])
    hazard = decide(quiet, replace(inputs, state=state), CALIBRATED).decision.hazard
    assert (hazard != "") is (not oncoming or looks >= 2)


def test_ordinary_following_is_no_violation_though_the_papers_distance_says_so() -> None:
    asked = request(track(gap_m=40.0, closing_mps=0.0), ego_speed_mps=25.0)
    metrics = decide(asked, mirror(asked), CALIBRATED).decision.metrics
    assert metrics.rss_viol_high_mu is False
    paper = decide(asked, mirror(asked), replace(CALIBRATED, rss="paper")).decision.metrics
    assert paper.rss_viol_high_mu is True


def test_the_arbiter_warns_of_what_only_it_sees() -> None:
    asked = request(fused=fused(directive="", new_information=False))
    inputs = with_view(mirror(asked), actors=(track(gap_m=20.0, closing_mps=12.0),))
    decision = decide(asked, inputs, CALIBRATED).decision
    assert decision.kind == "SPEAK"
    assert decision.reason == "hazard: closing_lead"


@given(tracks, st.floats(0.0, 8.0), st.none() | st.floats(0.0, 40.0))
def test_nobodys_braking_towards_us_is_counted_on(thing: Track, brakes_mps2: float, ego_mps: float | None) -> None:
    """Of one who comes towards us, and where our own speed is unknown: the time to collision is no longer than without it."""
    assume(thing.oncoming or ego_mps is None)

    def time_s(ax_mps2: float) -> float:
        view = View(ego_speed_mps=ego_mps, actors=(replace(thing, ax_mps2=ax_mps2),))
        found = measure(view.actors[0], view, speak_bounds(view, CALIBRATED), CALIBRATED).ttc_s
        return found if found is not None else math.inf

    assert time_s(brakes_mps2) <= time_s(0.0)


@FEW
@given(
    fused_hazard=st.sampled_from(("vehicle_fault", "red_light", "stop_sign", "slow_traffic", "closing_lead")),
    urgency=st.sampled_from(("warning", "alarm")),
    appears=st.integers(1, 60),
)
def test_no_hazard_of_the_request_silences_one_of_another_kind_that_the_arbiter_sees(
    fused_hazard: str, urgency: Urgency, appears: int
) -> None:
    person = track(gap_m=20.0, closing_mps=12.0, kind="pedestrian", track_id=50)
    state, told = fresh(CALIBRATED), []
    for tick in range(appears + 3):
        now_ns = 10 * SECOND + tick * SECOND // 10
        asked = request(fused=fused(hazard=fused_hazard, urgency=urgency, new_information=False))
        inputs = with_view(
            mirror(asked, state=state, now_ns=now_ns, permission=Permission()),
            actors=(person,) if tick >= appears else (),
        )
        verdict = decide(asked, inputs, CALIBRATED)
        state = verdict.state
        told.append(verdict.decision.hazard)
    assert told[0] == fused_hazard
    assert "pedestrian" in told[appears : appears + 2]
    assert told.count(fused_hazard) == 1 + (appears + 2) // 40


@pytest.mark.parametrize(
    ("fields", "watched"), [({}, True), ({"confidence": 0.6}, False), ({"age_s": 0.8}, False), ({"gap_m": 40.0}, False)]
)
def test_a_person_that_surely_comes_is_watched_before_the_path_is_reached(
    fields: dict[str, Any], watched: bool
) -> None:
    """Only that the gap shrinks is seen before: nothing is warned of and braked for beside the path."""
    sightings: tuple[Sighting, ...] = ()
    for picture in range(4):
        gap_m = fields.get("gap_m", 40.0 - picture)
        person = track(**{**fields, "gap_m": gap_m, "closing_mps": 10.0, "kind": "pedestrian", "in_ego_path": False})
        reading = Reading(coming=(person,), tracks_age_s=0.0)
        sightings = watch(sightings, reading, SECOND + picture * SECOND // 10, CALIBRATED)
    assert shrinks(sightings, person.track_id, 10.0, CALIBRATED) is watched


@given(gap_m=st.floats(6.0, 40.0), closing_mps=st.floats(4.0, 16.0), braking_mps2=st.none() | st.floats(-2.0, 9.0))
def test_the_arbiter_warns_by_itself_of_what_needs_more_braking_than_there_is(
    gap_m: float, closing_mps: float, braking_mps2: float | None
) -> None:
    slows = None if braking_mps2 is None else -braking_mps2
    quiet = request(
        track(gap_m=gap_m, closing_mps=closing_mps),
        ego_acceleration_mps2=slows,
        fused=fused(directive="", new_information=False),
    )
    decision = decide(quiet, mirror(quiet, permission=Permission()), CALIBRATED).decision
    if decision.reason.startswith("ACT withheld"):
        return
    need_mps2 = closing_mps**2 / (2.0 * (gap_m - CALIBRATED.hazard_spare_m))
    assume(abs(need_mps2 - max(1.5, braking_mps2 or 0.0)) > 1e-6)
    if decision.hazard:
        assert need_mps2 > max(1.5, braking_mps2 or 0.0)
    elif gap_m / closing_mps < 2.9 and (braking_mps2 or 0.0) <= 0.0:
        assert need_mps2 < 1.5

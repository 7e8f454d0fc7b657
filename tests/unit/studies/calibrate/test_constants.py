"""The design's properties hold for every candidate, wherever in its bounds."""

import msgspec
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from proto.decision import ArbitrationRequest
from services.arbiter.decide import decide, weigh
from services.arbiter.profiles.profile import Profile, reachability
from services.orchestrator.events import out_of_bounds
from studies.calibrate.constants import (
    DELTAS,
    EVENT,
    ROWS,
    Candidate,
    scaled,
    shipped,
    unfit,
    unscaled,
)
from tests.unit.services.arbiter.support import CALIBRATED, acts, mirror, probability, requests
from tests.unit.services.arbiter.test_properties import LESS, critical

SOME = settings(max_examples=40, deadline=None)
candidates = st.lists(probability, min_size=len(ROWS), max_size=len(ROWS)).map(unscaled)


def profile_of(candidate: Candidate) -> Profile:
    assume(not unfit(candidate, CALIBRATED))
    return candidate.profile(CALIBRATED)


def test_every_row_has_a_unit_and_a_reason_and_holds_what_is_shipped() -> None:
    for row in ROWS:
        assert row.low < row.high, row.name
        assert row.unit, row.name
        assert len(row.reason) > 5, row.name
    assert unfit(shipped(CALIBRATED), CALIBRATED) == ""


def test_no_guard_of_braking_can_be_loosened_and_no_bound_of_braking_is_fitted() -> None:
    for row in ROWS:
        if row.name.startswith("act_"):
            assert row.low == getattr(CALIBRATED, row.name), row.name
    fixed = (
        "act_brake_max_mps2",
        "act_duration_s",
        "pedal_brake",
        "t_r_s",
        "brake_max_mps2",
        "delta",
        "c_min_low",
        "k_fp",
    )
    assert not set(fixed) & {row.name for row in ROWS}


@given(candidates)
def test_what_is_written_is_what_was_tried(candidate: Candidate) -> None:
    assert unscaled(scaled(candidate)) == candidate


@given(candidates)
def test_every_threshold_is_one_that_the_orchestrator_takes(candidate: Candidate) -> None:
    assert out_of_bounds(candidate.thresholds) == ""
    assert all(row.name.removeprefix(EVENT) in candidate.thresholds for row in ROWS if row.name.startswith(EVENT))


@SOME
@given(candidates)
def test_act_stays_within_reach_and_sooner_at_a_smaller_delta(candidate: Candidate) -> None:
    profile = profile_of(candidate)
    times = [reachability(profile, delta).ttc_needed_healthy_s for delta in DELTAS]
    assert None not in times
    assert times == sorted(times, reverse=True)  # type: ignore[type-var]
    assert profile.c_min_low <= profile.c_min <= profile.c_min_high


@pytest.mark.parametrize(
    ("name", "value", "why"),
    [("c_act", 0.45, "out of reach"), ("c_act", 0.15, "braked for below"), ("tau_s", 9.0, "outside"), ("c_min", 0.3, "outside")],
)  # fmt: skip
def test_a_candidate_that_the_design_refuses_is_told_why(name: str, value: float, why: str) -> None:
    assert why in unfit(shipped(CALIBRATED).moved(name, value), CALIBRATED)


@SOME
@given(candidates, requests() | critical)
def test_no_candidate_acts_without_an_rss_violation_in_both_views_and_confidence(
    candidate: Candidate, asked: ArbitrationRequest
) -> None:
    profile = profile_of(candidate)
    inputs = mirror(asked, profile=profile)
    decision = decide(asked, inputs, profile).decision
    if decision.kind == "ACT":
        case = weigh(asked, inputs, inputs.state, profile).case
        assert case.asked is not None and case.asked.rss_viol  # noqa: PT018
        assert case.own is not None and case.own.rss_viol  # noqa: PT018
        assert min(case.asked.track.confidence, case.own.track.confidence) >= CALIBRATED.act_confidence
        assert asked.fused.confidence >= profile.c_min
        assert not asked.tool_timed_out


@pytest.mark.parametrize("way", list(LESS))
@settings(max_examples=15, deadline=None)
@given(candidate=candidates, asked=critical, x=probability)
def test_less_information_never_turns_speak_into_act_under_any_candidate(
    way: str, candidate: Candidate, asked: ArbitrationRequest, x: float
) -> None:
    profile = profile_of(candidate)
    fewer = LESS[way](asked, x)
    if not acts(asked, mirror(asked, profile=profile), profile):
        assert not acts(fewer, mirror(fewer, profile=profile), profile)


@SOME
@given(candidates, requests(), st.floats(0.0, 50.0), probability)
def test_what_is_known_to_be_worse_never_lowers_r_under_any_candidate(
    candidate: Candidate, asked: ArbitrationRequest, nearer: float, more: float
) -> None:
    profile, worse = profile_of(candidate), asked
    if asked.lead is not None:
        lead = msgspec.structs.replace(asked.lead, x_m=max(0.1, asked.lead.x_m - nearer))
        worse = msgspec.structs.replace(worse, lead=lead)
    if asked.h is not None:
        worse = msgspec.structs.replace(worse, h=min(1.0, asked.h + more))
    before, after = (decide(a, mirror(a, profile=profile), profile).decision.metrics for a in (asked, worse))
    assert after.r >= before.r - 1e-12


@SOME
@given(candidates, requests())
def test_no_candidate_silences_a_first_notice(candidate: Candidate, asked: ArbitrationRequest) -> None:
    profile = profile_of(candidate)
    first = msgspec.structs.replace(asked, fused=msgspec.structs.replace(asked.fused, first_notice=True, hazard=""))
    assert decide(first, mirror(first, profile=profile), profile).decision.kind != "SILENT"

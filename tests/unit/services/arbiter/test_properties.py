"""Properties of all decisions: what is worse or less known never lowers r, nor turns SPEAK into ACT."""

from collections.abc import Callable

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from proto.decision import ArbitrationRequest
from proto.vehicle import Ego
from services.arbiter.assessment.reading import Latest, believed, read
from services.arbiter.decide import decide
from tests.safety import safety
from tests.unit.services.arbiter.closed_loop import EMERGENCY
from tests.unit.services.arbiter.support import (
    CALIBRATED,
    SECOND,
    acts,
    fused,
    mirror,
    probability,
    request,
    requests,
    track,
)


@safety(few=60)
@given(requests())
def test_every_situation_gets_a_decision_that_survives_the_wire(asked: ArbitrationRequest) -> None:
    decision = decide(asked, mirror(asked), CALIBRATED).decision
    assert msgspec.json.decode(msgspec.json.encode(decision), type=type(decision)) == decision


# -- known worse: never a lower r -------------------------------------------------------------------------------------


@safety(few=60)
@given(requests(), st.floats(0.0, 0.9))
def test_less_friction_never_lowers_r(asked: ArbitrationRequest, less: float) -> None:
    if asked.mu_low is None or asked.mu_high is None:
        return
    worse = replace(asked, mu_low=max(0.05, asked.mu_low - less), mu_high=max(0.05, asked.mu_high - less))
    before, after = (decide(a, mirror(a), CALIBRATED).decision.metrics for a in (asked, worse))
    assert after.r >= before.r
    assert after.r_act >= before.r_act


@safety(few=60)
@given(requests(), probability)
def test_more_degradation_never_lowers_r(asked: ArbitrationRequest, more: float) -> None:
    if asked.h is None:
        return
    worse = replace(asked, h=min(1.0, asked.h + more))
    before, after = (decide(a, mirror(a), CALIBRATED).decision.metrics for a in (asked, worse))
    assert after.r >= before.r
    assert after.r_act >= before.r_act


@safety(few=60)
@given(requests(), probability)
def test_weaker_brakes_never_lower_r(asked: ArbitrationRequest, less: float) -> None:
    if asked.brake_envelope is None:
        return
    worse = replace(asked, brake_envelope=max(0.0, asked.brake_envelope - less))
    before, after = (decide(a, mirror(a), CALIBRATED).decision.metrics for a in (asked, worse))
    assert after.r >= before.r
    assert after.r_act >= before.r_act


@safety(few=60)
@given(requests(), st.floats(0.0, 50.0))
def test_a_smaller_gap_never_lowers_r(asked: ArbitrationRequest, nearer: float) -> None:
    if asked.lead is None:
        return
    # Still ahead: an actor behind the ego's centre is no longer in front of it.
    worse = replace(asked, lead=replace(asked.lead, x_m=max(0.1, asked.lead.x_m - nearer)))
    before, after = (decide(a, mirror(a), CALIBRATED).decision.metrics for a in (asked, worse))
    assert after.r >= before.r - 1e-12
    assert after.r_act >= before.r_act - 1e-12


@safety(few=60)
@given(requests(), probability, probability)
def test_a_vaguer_field_of_view_never_lowers_r_and_leaves_the_time_to_collision(
    asked: ArbitrationRequest, vague: float, vaguer: float
) -> None:
    if asked.lead is None:
        return
    low, high = sorted((vague, vaguer))
    for people, each in ((True, asked), (False, replace(asked, pedestrian=None))):
        known, before, after = (
            decide(a, mirror(a), CALIBRATED).decision.metrics
            for a in (each, *(replace(each, lead=replace(asked.lead, range_spread=spread)) for spread in (low, high)))
        )
        assert known.r <= before.r <= after.r
        if not people:  # the metrics are those of the gravest actor: beside a person that may become the lead
            assert known.ttc_s == after.ttc_s


@safety(few=60)
@given(st.floats(0.01, 1.0), st.floats(0.5, 25.0), st.floats(5.0, 20.0))
def test_no_brake_is_applied_on_a_range_of_a_guessed_field_of_view(
    spread: float, gap_m: float, closing_mps: float
) -> None:
    assert not acts(request(track(gap_m=gap_m, closing_mps=closing_mps, range_spread=spread), h=1.0))


# -- less information: never from SPEAK to ACT -------------------------------------------------------------------------


def _less_sure(a: ArbitrationRequest, x: float) -> ArbitrationRequest:
    return replace(a, fused=replace(a.fused, confidence=a.fused.confidence * x))


def _wider_friction(a: ArbitrationRequest, x: float) -> ArbitrationRequest:
    if a.mu_low is None or a.mu_high is None:
        return a
    return replace(a, mu_low=a.mu_low * x, mu_high=a.mu_high + (1.0 - a.mu_high) * (1.0 - x))


def _doubted_lead(a: ArbitrationRequest, x: float) -> ArbitrationRequest:
    return replace(a, lead=replace(a.lead, confidence=a.lead.confidence * x)) if a.lead is not None else a


def _older_lead(a: ArbitrationRequest, x: float) -> ArbitrationRequest:
    return replace(a, lead=replace(a.lead, unseen_s=a.lead.unseen_s + x)) if a.lead is not None else a


def _vaguer_lead(a: ArbitrationRequest, x: float) -> ArbitrationRequest:
    if a.lead is None:
        return a
    return replace(a, lead=replace(a.lead, sigma_x_m=a.lead.sigma_x_m + x, sigma_vx_mps=a.lead.sigma_vx_mps + x))


def _guessed_lens(a: ArbitrationRequest, x: float) -> ArbitrationRequest:
    if a.lead is None:
        return a
    return replace(a, lead=replace(a.lead, range_spread=x, sigma_x_m=a.lead.sigma_x_m + x * a.lead.x_m))


def _absurd_lead(**fields: float) -> Callable[[ArbitrationRequest, float], ArbitrationRequest]:
    """With numbers that no measurement has, the farther off the greater x."""

    def absurd(a: ArbitrationRequest, x: float) -> ArbitrationRequest:
        if a.lead is None:
            return a
        return replace(a, lead=replace(a.lead, **{name: value * (0.01 + x) for name, value in fields.items()}))

    return absurd


LESS: dict[str, Callable[[ArbitrationRequest, float], ArbitrationRequest]] = {
    "field of view guessed": _guessed_lens,
    "lower confidence": _less_sure,
    "wider friction interval": _wider_friction,
    "doubted actor": _doubted_lead,
    "actor not seen for longer": _older_lead,
    "actor measured less exactly": _vaguer_lead,
    "place below no deviation": _absurd_lead(sigma_x_m=-1e3),
    "speed below no deviation": _absurd_lead(sigma_vx_mps=-1e2),
    "aside below no deviation": _absurd_lead(sigma_y_m=-1e2),
    "surer than sure": lambda a, x: replace(a, lead=replace(a.lead, confidence=1.01 + x)) if a.lead else a,
    "no friction": lambda a, x: replace(a, mu_low=None, mu_high=None),
    "no upper bound of friction": lambda a, x: replace(a, mu_high=None),
    "no degradation": lambda a, x: replace(a, h=None),
    "no brake envelope": lambda a, x: replace(a, brake_envelope=None),
    "no ego speed": lambda a, x: replace(a, ego_speed_mps=None),
    "no ego acceleration": lambda a, x: replace(a, ego_acceleration_mps2=None),
    "no lead": lambda a, x: replace(a, lead=None),
    "no pedestrian": lambda a, x: replace(a, pedestrian=None),
    "a tool timed out": lambda a, x: replace(a, tool_timed_out=True),
    "sight degraded": lambda a, x: replace(a, degraded=("perception/tracks",)),
}


@pytest.mark.parametrize("way", list(LESS))
@safety(few=60, ways=len(LESS))
@given(asked=requests(), x=probability)
def test_less_information_never_turns_speak_into_act(way: str, asked: ArbitrationRequest, x: float) -> None:
    fewer = LESS[way](asked, x)
    if not acts(asked):
        assert not acts(fewer)
        assert not acts(fewer, mirror(asked)), "seen by the arbiter, lost on the orchestrator"
        assert not acts(asked, mirror(fewer)), "seen by the orchestrator, lost on the arbiter"


critical = st.builds(
    lambda gap, closing, h: request(track(gap_m=gap, closing_mps=closing), h=h),
    st.floats(0.5, 25.0),
    st.floats(5.0, 20.0),
    probability,
)


@pytest.mark.parametrize("way", list(LESS))
@safety(few=60, ways=len(LESS))
@given(asked=critical, x=probability)
def test_less_information_in_danger_never_turns_speak_into_act(way: str, asked: ArbitrationRequest, x: float) -> None:
    fewer = LESS[way](asked, x)
    if not acts(asked):
        assert not acts(fewer)


def _acts_hard(asked: ArbitrationRequest) -> bool:
    """Whether the arbiter brakes under a grant for emergencies."""
    return acts(asked, mirror(asked, permission=EMERGENCY))


@safety(few=60)
@given(st.one_of(requests(), critical))
def test_friction_that_is_not_known_begins_no_emergency(asked: ArbitrationRequest) -> None:
    if _acts_hard(replace(asked, mu_low=None, mu_high=None)):
        assert _acts_hard(asked)


@safety(few=60)
@given(st.floats(0.5, 200.0), st.floats(0.1, 60.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0), probability)
def test_no_friction_brakes_for_what_is_far_away_in_time(
    gap_m: float, closing_mps: float, mu: float, other_mu: float, h: float
) -> None:
    low, high = sorted((mu, other_mu))
    fields = {"ego_speed_mps": closing_mps + 0.1, "h": h, "mu_high": high}
    met = request(track(gap_m=gap_m, closing_mps=closing_mps), mu_low=low, **fields)
    if _acts_hard(met):
        assert gap_m < CALIBRATED.tau_s * closing_mps
        known = _acts_hard(replace(met, mu_low=high))
        assert known or gap_m < CALIBRATED.tau_hazard_s * closing_mps, "a low lower bound alone begins nothing early"


@safety(few=60)
@given(st.one_of(requests(), critical))
def test_rss_is_violated_at_the_lower_bound_of_friction_wherever_the_arbiter_brakes(asked: ArbitrationRequest) -> None:
    decision = decide(asked, mirror(asked, permission=EMERGENCY), CALIBRATED).decision
    if decision.kind == "ACT":
        assert decision.metrics.rss_viol_low_mu


def test_what_stands_is_not_braked_for_sooner_because_it_seems_to_brake() -> None:
    brakes = []
    for gap_m in (59.0, 59.5, 60.0, 60.5, 61.0, 61.5, 62.0):
        still = track(gap_m=gap_m, closing_mps=25.0)
        stands = request(still, ego_speed_mps=25.0, mu_low=0.72, mu_high=0.98)
        seems = replace(stands, lead=replace(still, ax_mps2=-1.0))
        assert _acts_hard(seems) == _acts_hard(stands)
        brakes.append(_acts_hard(stands))
    assert {True, False} == set(brakes)


def test_a_doubted_road_user_hides_no_certain_one_from_the_brake() -> None:
    ghost = track(gap_m=12.0, closing_mps=12.0, track_id=3, kind="pedestrian", confidence=0.3)
    person = track(gap_m=14.0, closing_mps=12.0, track_id=4, kind="pedestrian")
    alone = request(None, pedestrian=person)
    assert _acts_hard(alone)
    assert _acts_hard(replace(alone, pedestrian=ghost, others=(person,)))
    assert not _acts_hard(replace(alone, pedestrian=ghost))


@safety(few=60)
@given(critical)
def test_a_smaller_delta_acts_wherever_a_larger_one_does(asked: ArbitrationRequest) -> None:
    acted = [acts(asked, mirror(asked, profile=p), p) for p in (replace(CALIBRATED, delta=d / 10) for d in range(5))]
    assert acted == sorted(acted, reverse=True)


def test_delta_trades_interventions_against_time() -> None:
    """Approaching a standing car at 14 m/s: the time to collision at which each Delta first acts."""

    def first_act_s(delta: float) -> float:
        profile = replace(CALIBRATED, delta=delta)
        for gap in range(80, 0, -1):
            asked = request(track(gap_m=float(gap), closing_mps=14.0), ego_speed_mps=14.0)
            if acts(asked, mirror(asked, profile=profile), profile):
                return gap / 14.0
        return 0.0

    times = [first_act_s(delta / 10) for delta in range(5)]
    assert times == sorted(times, reverse=True)
    assert len(set(times)) >= 4


@safety(few=60)
@given(st.text(max_size=200), st.text(max_size=200))
def test_no_text_moves_the_decision(directive: str, justification: str) -> None:
    asked = request(track(gap_m=30.0, closing_mps=3.0))
    said = replace(asked, fused=fused(directive="x" + directive, justification=justification, topic=directive))
    assert (
        decide(said, mirror(said), CALIBRATED).decision.kind == decide(asked, mirror(asked), CALIBRATED).decision.kind
    )


def test_an_accelerometer_that_lies_begins_no_braking() -> None:
    asked = request(track(gap_m=20.0, closing_mps=5.0), mu_low=0.8, mu_high=1.0)
    assert not acts(asked)
    before = believed(Latest(ego=(Ego(speed_mps=20.0, acceleration_mps2=0.0), SECOND)), SECOND)
    for tick in range(1, 30):  # the speed stays as it is
        now_ns = SECOND + tick * SECOND // 10
        latest = Latest(ego=(Ego(speed_mps=20.0, acceleration_mps2=14.0), now_ns), speed=before)
        before, view = believed(latest, now_ns), read(latest, now_ns, 0.3).view
    lies = replace(asked, ego_acceleration_mps2=view.ego_acceleration_mps2)
    assert not acts(lies)

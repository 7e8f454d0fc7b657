"""SILENT, SPEAK or ACT."""

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from proto.decision import ArbitrationRequest, Feedback
from services.arbiter.assessment.reading import Pedals
from services.arbiter.braking.act import Permission
from services.arbiter.braking.guard import objections
from services.arbiter.decide import decide, redecide
from services.arbiter.state import fresh
from tests.unit.services.arbiter.support import (
    CALIBRATED,
    FEW,
    HANDS_OFF,
    SECOND,
    acts,
    fused,
    mirror,
    request,
    requests,
    track,
    with_view,
)

CRITICAL = request(track(gap_m=15.0, closing_mps=12.0))


def test_a_car_close_ahead_is_braked_for_under_a_grant() -> None:
    verdict = decide(CRITICAL, mirror(CRITICAL), CALIBRATED)
    assert verdict.decision.kind == "ACT"
    assert verdict.command is not None
    assert verdict.command.grant_id == "g-1"
    assert verdict.command.tick == CRITICAL.tick
    assert verdict.command.valid_for_ns == 200_000_000


@given(asked=requests(), granted=st.booleans())
def test_who_brakes_or_would_says_what_for(asked: ArbitrationRequest, granted: bool) -> None:
    inputs = mirror(asked) if granted else mirror(asked, permission=Permission())
    decision = decide(asked, inputs, CALIBRATED).decision
    if decision.kind == "ACT" or decision.reason.startswith("ACT withheld"):
        assert decision.hazard in ("closing_lead", "pedestrian")
    assert decision.kind != "SILENT" or decision.hazard == ""


def test_without_a_grant_the_act_is_withheld_and_spoken() -> None:
    verdict = decide(CRITICAL, mirror(CRITICAL, permission=Permission()), CALIBRATED)
    assert (verdict.decision.kind, verdict.decision.act_withheld) == ("SPEAK", "no grant")
    assert verdict.command is None


def test_a_withheld_act_is_said_again_in_its_time_and_not_every_tick() -> None:
    state, spoken, withheld = mirror(CRITICAL).state, 0, 0
    for tick in range(41):
        inputs = mirror(CRITICAL, permission=Permission(), now_ns=10 * SECOND + tick * SECOND // 10)
        verdict = decide(
            CRITICAL,
            replace(inputs, state=replace(inputs.state, attention=state.attention, memory=state.memory)),
            CALIBRATED,
        )
        state = verdict.state
        spoken += verdict.decision.kind == "SPEAK"
        withheld += verdict.decision.act_withheld == "no grant"
    assert (spoken, withheld) == (2, 41)


@pytest.mark.parametrize(
    "pedals",
    [
        replace(HANDS_OFF, accelerator=0.9),
        Pedals(),
    ],
)
def test_the_drivers_pedals_win(pedals: Pedals) -> None:
    inputs = mirror(CRITICAL)
    inputs = replace(inputs, reading=replace(inputs.reading, pedals=pedals))
    verdict = decide(CRITICAL, inputs, CALIBRATED)
    assert verdict.command is None
    assert verdict.decision.kind == "SPEAK"
    assert "driver" in verdict.decision.act_withheld


@pytest.mark.parametrize(
    ("change", "objection"),
    [
        ({"tool_timed_out": True}, "timed out"),
        ({"degraded": ("perception/tracks",)}, "degraded"),
        ({"fused": fused(confidence=0.3)}, "c_min"),
        ({"ego_acceleration_mps2": None}, "unknown to the orchestrator"),
        ({"lead": track(gap_m=15.0, confidence=0.5)}, "no undoubted actor"),
        ({"lead": track(gap_m=15.0, unseen_s=0.5)}, "no undoubted actor"),
        ({"lead": track(gap_m=15.0, age_s=0.1)}, "no undoubted actor"),
        ({"lead": track(gap_m=15.0, steady_s=0.0)}, "no undoubted actor"),
        ({"lead": track(gap_m=15.0, steady_s=None)}, "no undoubted actor"),
        ({"lead": track(gap_m=15.0, sigma_vx_mps=3.5)}, "no undoubted actor"),
    ],
)
def test_less_than_all_evidence_in_the_request_forbids_act(change: dict[str, object], objection: str) -> None:
    asked = replace(CRITICAL, **change)
    inputs = mirror(CRITICAL)
    assert not acts(asked, inputs)
    from services.arbiter.decide import weigh

    found = objections(weigh(asked, inputs, inputs.state, CALIBRATED).case)
    assert any(objection in text for text in found)


@pytest.mark.parametrize(
    "change",
    [
        {"actors": ()},
        {"actors": (track(gap_m=60.0, closing_mps=0.0),)},
        {"actors": (track(gap_m=15.0, confidence=0.2),)},
        {"ego_speed_mps": None},
        {"ego_acceleration_mps2": None},
    ],
)
def test_the_arbiter_brakes_for_nothing_it_does_not_see_itself(change: dict[str, object]) -> None:
    inputs = with_view(mirror(CRITICAL), **change)
    assert acts(CRITICAL)
    assert not acts(CRITICAL, inputs)


def test_the_arbiter_brakes_only_where_it_saw_the_gap_shrink() -> None:
    """A part of the car ahead, taken for a person who stands: claimed to close in at 12 m/s, and always 15 m away."""
    unwatched = mirror(CRITICAL, state=fresh(CALIBRATED))
    assert not acts(CRITICAL, unwatched)
    state, kinds = fresh(CALIBRATED), []
    for tick in range(8):
        verdict = decide(CRITICAL, mirror(CRITICAL, state=state, now_ns=(100 + tick) * SECOND // 10), CALIBRATED)
        state = verdict.state
        kinds.append(verdict.decision.kind)
    assert "ACT" not in kinds
    state, kinds = fresh(CALIBRATED), []
    for tick in range(8):
        closer = request(track(gap_m=25.0 - 1.2 * tick, closing_mps=12.0))
        verdict = decide(closer, mirror(closer, state=state, now_ns=(100 + tick) * SECOND // 10), CALIBRATED)
        state = verdict.state
        kinds.append(verdict.decision.kind)
    assert kinds[-1] == "ACT"
    assert "ACT" not in kinds[:3]


def test_braking_that_works_is_not_let_go_because_it_works() -> None:
    """Towards a standing car, integrated: one intervention, not a flicker, and it ends when the closing does."""
    state, gap, speed, accel, kinds = fresh(CALIBRATED), 60.0, 14.0, 0.0, []
    for tick in range(80):
        asked = request(track(gap_m=gap, closing_mps=speed), ego_speed_mps=speed, ego_acceleration_mps2=accel)
        verdict = decide(asked, mirror(asked, state=state, now_ns=(100 + tick) * SECOND // 10), CALIBRATED)
        state = verdict.state
        kinds.append(verdict.decision.kind == "ACT")
        accel = -verdict.decision.brake_mps2
        gap, speed = gap - speed * 0.1, max(0.0, speed + accel * 0.1)
    first, last = kinds.index(True), 80 - kinds[::-1].index(True)
    assert all(kinds[first:last])
    assert last - first >= 15
    assert last - first <= 31


def test_no_violation_in_the_own_reading_forbids_act_at_any_delta() -> None:
    eager = replace(CALIBRATED, delta=0.0)
    slow = with_view(mirror(CRITICAL, profile=eager), ego_speed_mps=5.0)
    assert acts(CRITICAL, mirror(CRITICAL, profile=eager), eager)
    assert not acts(CRITICAL, slow, eager)


@given(clearance_m=st.floats(-2.0, 2.0), sigma_m=st.floats(0.0, 1.0))
def test_act_needs_bodies_that_would_surely_meet(clearance_m: float, sigma_m: float) -> None:
    aside = request(track(gap_m=15.0, closing_mps=12.0, clearance_m=clearance_m, sigma_y_m=sigma_m))
    assert acts(aside) == (clearance_m + sigma_m <= -CALIBRATED.act_overlap_m)


@FEW
@given(
    kind=st.sampled_from(("vehicle", "pedestrian", "cyclist")), gap_m=st.floats(0.5, 40.0),
    clearance_m=st.floats(-2.0, 4.0), vy_mps=st.floats(-4.0, 4.0),
)  # fmt: skip
def test_a_clearance_that_is_not_told_enables_no_braking(
    kind: str, gap_m: float, clearance_m: float, vy_mps: float
) -> None:
    told = track(gap_m, kind=kind, clearance_m=clearance_m, vy_mps=vy_mps, sigma_y_m=0.0)
    asked = [request(each, tick=1) for each in (told, replace(told, clearance_m=None))]
    known, unknown = (acts(each) for each in asked)
    assert known or not unknown


def test_a_person_beside_the_way_is_braked_for_too() -> None:
    person = track(gap_m=15.0, closing_mps=12.0, kind="pedestrian", clearance_m=0.2)
    assert acts(request(None, pedestrian=person))


STOPS_M = 12.0**2 / (2.0 * 4.0)


def on_foot(gap_m: float, clearance_m: float, vy_mps: float = 1.4) -> ArbitrationRequest:
    """A person at walking pace towards the way of a car at 12 m/s."""
    person = track(gap_m, kind="pedestrian", vy_mps=vy_mps, clearance_m=clearance_m, sigma_y_m=0.0)
    return request(None, pedestrian=person)


def test_a_person_with_room_to_halt_is_braked_for_at_the_last_moment_alone() -> None:
    in_the_way, near, far = -0.5, 0.6, 1.0
    assert [acts(on_foot(22.0, each)) for each in (in_the_way, near, far)] == [True, True, False]
    assert [acts(on_foot(18.0, each)) for each in (in_the_way, near, far)] == [True, True, True]


@given(gap_m=st.floats(0.5, 40.0), clearance_m=st.floats(-2.0, 4.0), vy_mps=st.floats(-4.0, 4.0))
def test_room_to_halt_frees_nothing_that_waiting_would_lose(gap_m: float, clearance_m: float, vy_mps: float) -> None:
    """`STOPS_M`: the way in which 4 m/s2, which the grant allows, end 12 m/s."""
    beside, there = acts(on_foot(gap_m, clearance_m, vy_mps)), acts(on_foot(gap_m, -0.5))
    assert there or not beside
    if gap_m <= STOPS_M:
        assert beside == there


def test_stale_own_tracks_forbid_act() -> None:
    inputs = mirror(CRITICAL)
    assert not acts(CRITICAL, replace(inputs, reading=replace(inputs.reading, tracks_age_s=0.5)))
    assert not acts(CRITICAL, replace(inputs, reading=replace(inputs.reading, ego_age_s=None)))


def test_a_further_actor_that_only_one_side_sees_does_not_stop_braking_for_the_one_both_see() -> None:
    ghost = track(gap_m=8.0, closing_mps=15.0, track_id=9)
    assert acts(replace(CRITICAL, pedestrian=ghost), mirror(CRITICAL))


def test_the_act_test_takes_the_upper_bound_of_friction_and_speak_the_lower() -> None:
    asked = request(track(gap_m=40.0, closing_mps=5.0), mu_low=0.2, mu_high=0.9)
    metrics = decide(asked, mirror(asked), CALIBRATED).decision.metrics
    assert metrics.rss_viol_low_mu is True
    assert metrics.rss_viol_high_mu is False
    assert metrics.r > metrics.r_act


def test_a_decision_can_be_decided_again_from_its_log() -> None:
    asked = request(track(gap_m=18.0), feedback=(Feedback(label="late_warning"),))
    logged = decide(asked, mirror(asked), CALIBRATED).decision
    wire = msgspec.json.decode(msgspec.json.encode(logged), type=type(logged))
    assert redecide(asked, wire, CALIBRATED).decision == logged

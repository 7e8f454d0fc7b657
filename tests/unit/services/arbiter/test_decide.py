"""SILENT, SPEAK or ACT."""

import math
from collections.abc import Callable
from typing import Any

import msgspec
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from proto.decision import ArbitrationRequest, Decision, Feedback, Urgency
from proto.perception import Track
from services.arbiter.act import Permission
from services.arbiter.assess import View, measure, speak_bounds
from services.arbiter.attention import GRAVITY, PRESSING
from services.arbiter.decide import decide, redecide
from services.arbiter.guard import objections
from services.arbiter.profiles import Profile
from services.arbiter.reading import Pedals
from services.arbiter.state import ArbiterState, Attention, fresh
from tests.unit.services.arbiter.support import (
    CALIBRATED,
    FEW,
    HANDS_OFF,
    SECOND,
    fused,
    mirror,
    probability,
    request,
    requests,
    track,
    tracks,
    with_view,
)

replace = msgspec.structs.replace


def acts(asked: ArbitrationRequest, inputs: object = None, profile: Profile = CALIBRATED) -> bool:
    """Whether the arbiter would brake, grant or no grant."""
    verdict = decide(asked, inputs or mirror(asked), profile)  # type: ignore[arg-type]
    return verdict.decision.kind == "ACT" or verdict.decision.act_withheld != ""


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
        verdict = decide(CRITICAL, replace(inputs, state=replace(inputs.state, attention=state.attention)), CALIBRATED)
        state = verdict.state
        spoken += verdict.decision.kind == "SPEAK"
        withheld += verdict.decision.act_withheld == "no grant"
    assert (spoken, withheld) == (2, 41)


@pytest.mark.parametrize(
    "pedals",
    [
        replace(HANDS_OFF, brake=0.2),
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

    found = objections(weigh(asked, inputs.reading, inputs.state, CALIBRATED).case)
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


def test_a_person_beside_the_way_is_braked_for_too() -> None:
    person = track(gap_m=15.0, closing_mps=12.0, kind="pedestrian", clearance_m=0.2)
    assert acts(request(None, pedestrian=person))


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


@given(ego_mps=st.floats(1.0, 30.0) | st.none(), gap_m=st.floats(2.0, 12.0), confidence=st.floats(0.2, 1.0))
def test_in_a_crawling_queue_the_next_vehicle_alone_hides_others_from_the_words(
    ego_mps: float | None, gap_m: float, confidence: float
) -> None:
    following = track(gap_m=gap_m, closing_mps=0.0, track_id=8, confidence=confidence)
    behind_it = track(gap_m=15.0, closing_mps=8.0, oncoming=True)
    quiet = request(behind_it, ego_speed_mps=ego_mps, fused=fused(new_information=False))
    inputs = with_view(mirror(quiet, permission=Permission()), actors=(following, behind_it))
    hidden = ego_mps is not None and ego_mps < 5.0 and confidence >= CALIBRATED.act_confidence
    decision = decide(quiet, inputs, CALIBRATED).decision
    assert (decision.hazard == "") is hidden
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
    assert decide(quiet, replace(inputs, permission=Permission()), CALIBRATED).decision.hazard != ""


def test_stale_own_tracks_forbid_act() -> None:
    inputs = mirror(CRITICAL)
    assert not acts(CRITICAL, replace(inputs, reading=replace(inputs.reading, tracks_age_s=0.5)))
    assert not acts(CRITICAL, replace(inputs, reading=replace(inputs.reading, ego_age_s=None)))


def test_a_further_actor_that_only_one_side_sees_does_not_stop_braking_for_the_one_both_see() -> None:
    ghost = track(gap_m=8.0, closing_mps=15.0, track_id=9)
    assert acts(replace(CRITICAL, pedestrian=ghost), mirror(CRITICAL))


def test_ordinary_following_is_no_violation_though_the_papers_distance_says_so() -> None:
    asked = request(track(gap_m=40.0, closing_mps=0.0), ego_speed_mps=25.0)
    metrics = decide(asked, mirror(asked), CALIBRATED).decision.metrics
    assert metrics.rss_viol_high_mu is False
    paper = decide(asked, mirror(asked), replace(CALIBRATED, rss="paper")).decision.metrics
    assert paper.rss_viol_high_mu is True


def test_the_act_test_takes_the_upper_bound_of_friction_and_speak_the_lower() -> None:
    asked = request(track(gap_m=40.0, closing_mps=5.0), mu_low=0.2, mu_high=0.9)
    metrics = decide(asked, mirror(asked), CALIBRATED).decision.metrics
    assert metrics.rss_viol_low_mu is True
    assert metrics.rss_viol_high_mu is False
    assert metrics.r > metrics.r_act


SPOKEN = (
    (fused(hazard="closing_lead", urgency="alarm"), "hazard"),
    (fused(first_notice=True, topic="overspeed"), "first notice"),
)


@pytest.mark.parametrize(("said", "reason"), SPOKEN)
@pytest.mark.parametrize("confidence", [0.0, 0.9])
@pytest.mark.parametrize("muted", [False, True])
@pytest.mark.parametrize("messages", [0.0, 4.0])
def test_neither_budget_nor_c_min_nor_mute_silences_a_hazard_or_a_first_notice(
    said: object, reason: str, confidence: float, muted: bool, messages: float
) -> None:
    asked = request(fused=replace(said, confidence=confidence, muted=muted, new_information=False))  # type: ignore[type-var]
    inputs = mirror(asked)
    inputs = replace(inputs, state=replace(inputs.state, attention=Attention(messages=messages)))
    decision = decide(asked, inputs, CALIBRATED).decision
    assert decision.kind == "SPEAK"
    assert reason in decision.reason


@pytest.mark.parametrize(
    ("said", "reason"),
    [
        (fused(new_information=False), "nothing new"),
        (fused(directive=""), "nothing to say"),
        (fused(muted=True), "muted"),
        (fused(confidence=0.1), "c_min"),
    ],
)
def test_silence_is_a_decision_with_a_reason(said: object, reason: str) -> None:
    asked = request(fused=said)
    decision = decide(asked, mirror(asked), CALIBRATED).decision
    assert decision.kind == "SILENT"
    assert reason in decision.reason


def test_the_attention_budget_runs_out_and_comes_back() -> None:
    state, kinds = mirror(request()).state, []
    slow = replace(CALIBRATED, budget_refill_s=20.0)
    for tick in range(6):
        verdict = decide(request(tick=tick), mirror(request(), state=state, now_ns=(10 + 2 * tick) * SECOND), slow)
        kinds.append(verdict.decision.kind)
        state = verdict.state
    assert kinds == ["SPEAK"] * 4 + ["SILENT"] * 2
    later = decide(request(), mirror(request(), state=state, now_ns=60 * SECOND), slow)
    assert later.decision.kind == "SPEAK"


@given(messages=st.floats(0.0, 4.0))
def test_information_never_takes_the_message_that_is_kept_for_advice(messages: float) -> None:
    kinds = {}
    for urgency in ("info", "advice"):
        asked = request(fused=fused(urgency=urgency))
        inputs = mirror(asked)
        held = Attention(messages=messages, refilled_ns=inputs.now_ns)
        verdict = decide(asked, replace(inputs, state=replace(inputs.state, attention=held)), CALIBRATED)
        kinds[urgency] = verdict.decision.kind
        if urgency == "info" and verdict.decision.kind == "SPEAK":
            assert verdict.state.attention.messages >= CALIBRATED.budget_reserve
    assert kinds == {
        "info": "SPEAK" if messages >= 1.0 + CALIBRATED.budget_reserve else "SILENT",
        "advice": "SPEAK" if messages >= 1.0 else "SILENT",
    }


@given(topic=st.sampled_from(["stop", "ahead"]), messages=st.floats(0.0, 4.0), muted=st.booleans(), new=st.booleans())
def test_advice_that_is_of_no_use_later_waits_for_no_budget_and_is_muted_like_any_other(
    topic: str, messages: float, muted: bool, new: bool
) -> None:
    asked = request(fused=fused(topic=topic, urgency="advice", muted=muted, new_information=new))
    inputs = mirror(asked)
    held = Attention(messages=messages, refilled_ns=inputs.now_ns)
    verdict = decide(asked, replace(inputs, state=replace(inputs.state, attention=held)), CALIBRATED)
    assert verdict.decision.kind == ("SPEAK" if new and not muted else "SILENT")
    assert 0.0 <= verdict.state.attention.messages <= messages


def test_a_standing_hazard_is_said_again_but_not_every_tick() -> None:
    asked = request(fused=fused(hazard="closing_lead"))
    state, spoken = mirror(asked).state, 0
    for tick in range(81):
        verdict = decide(asked, mirror(asked, state=state, now_ns=10 * SECOND + tick * SECOND // 10), CALIBRATED)
        spoken += verdict.decision.kind == "SPEAK"
        state = verdict.state
    assert spoken == 3


def later(asked: ArbitrationRequest, before: ArbiterState, seconds: float) -> Decision:
    """What is decided on the same request some time after another decision."""
    inputs = mirror(asked, now_ns=10 * SECOND + round(seconds * SECOND))
    return decide(asked, replace(inputs, state=replace(inputs.state, attention=before.attention)), CALIBRATED).decision


def test_a_calmer_word_on_a_vehicle_just_told_is_no_news_and_a_graver_one_is() -> None:
    grave, calm = (request(fused=fused(hazard=hazard)) for hazard in ("closing_lead", "slow_traffic"))
    assert later(calm, decide(grave, mirror(grave), CALIBRATED).state, 1.0).kind == "SILENT"
    assert later(grave, decide(calm, mirror(calm), CALIBRATED).state, 1.0).kind == "SPEAK"


def test_two_hazards_that_take_turns_are_each_said_in_their_time() -> None:
    state, spoken = mirror(request()).state, 0
    for tick in range(21):
        asked = request(fused=fused(hazard=("closing_lead", "pedestrian")[tick % 2]))
        verdict = decide(asked, mirror(asked, state=state, now_ns=10 * SECOND + tick * SECOND // 10), CALIBRATED)
        state, spoken = verdict.state, spoken + (verdict.decision.kind == "SPEAK")
    assert spoken == 2


FAR = track(gap_m=80.0, closing_mps=12.0)


@given(braking_mps2=st.floats(-9.0, 2.0))
def test_a_driver_who_was_told_and_brakes_enough_is_not_told_again(braking_mps2: float) -> None:
    asked = request(FAR, fused=fused(hazard="closing_lead"))
    state = decide(asked, mirror(asked), CALIBRATED).state
    braking = replace(asked, ego_acceleration_mps2=braking_mps2)
    needed = 12.0**2 / (2.0 * (80.0 - CALIBRATED.d0_m))
    assert (later(braking, state, 5.0).kind == "SILENT") == (-braking_mps2 >= needed)


@given(braking_mps2=st.floats(-9.0, 2.0))
def test_nobodys_braking_silences_what_was_not_told_or_what_became_graver(braking_mps2: float) -> None:
    asked = request(FAR, fused=fused(hazard="closing_lead"), ego_acceleration_mps2=braking_mps2)
    assert decide(asked, mirror(asked), CALIBRATED).decision.kind == "SPEAK"
    graver = request(FAR, fused=fused(hazard="closing_lead", urgency="alarm"), ego_acceleration_mps2=braking_mps2)
    assert later(graver, decide(asked, mirror(asked), CALIBRATED).state, 1.0).kind == "SPEAK"


def answered_for(other: Track, away_s: float) -> Decision:
    """What is decided on another vehicle five seconds after a word on FAR, whose hazard ends so long before; the driver brakes."""
    told = request(FAR, fused=fused(hazard="closing_lead"))
    state = decide(told, mirror(told), CALIBRATED).state
    for tenth in range(1, 50):
        seen = told if tenth <= 10 * (5.0 - away_s) else request()
        now_ns = 10 * SECOND + tenth * SECOND // 10
        braking = replace(seen, ego_acceleration_mps2=-9.0)
        state = decide(braking, mirror(braking, state=state, now_ns=now_ns), CALIBRATED).state
    asked = request(other, fused=fused(hazard="closing_lead"), ego_acceleration_mps2=-9.0)
    return later(asked, state, 5.0)


@given(age_s=st.floats(5.1, 60.0), away_s=st.floats(0.0, 4.9))
def test_braking_for_one_vehicle_silences_no_other_that_came_into_the_path_since(age_s: float, away_s: float) -> None:
    assert answered_for(replace(FAR, track_id=8, age_s=age_s), away_s).reason == "hazard: closing_lead"


@FEW
@given(age_s=st.floats(0.4, 4.9), away_s=st.floats(0.0, 4.9))
def test_a_vehicle_first_seen_since_the_word_is_another_once_the_hazard_was_away(age_s: float, away_s: float) -> None:
    gone_s = round(away_s, 1)
    assume(abs(gone_s - 2.0) > 0.15)
    kind = answered_for(replace(FAR, track_id=8, age_s=age_s), gone_s).kind
    assert (kind == "SPEAK") == (gone_s > 2.0)


@given(age_s=st.floats(5.1, 60.0))
def test_who_was_in_the_path_at_the_word_was_told_of_with_the_others(age_s: float) -> None:
    beside = track(gap_m=81.0, closing_mps=12.0, track_id=8)
    told = request(FAR, fused=fused(hazard="closing_lead"))
    both = with_view(mirror(told), actors=(FAR, beside))
    state = decide(told, both, CALIBRATED).state
    asked = request(replace(beside, age_s=age_s), fused=fused(hazard="closing_lead"), ego_acceleration_mps2=-9.0)
    assert later(asked, state, 5.0).kind == "SILENT"


def test_advice_waits_for_the_end_of_the_last_message_and_first_notices_do_not() -> None:
    state = decide(request(), mirror(request()), CALIBRATED).state
    assert "still being heard" in later(request(), state, 1.0).reason
    assert later(request(fused=fused(first_notice=True)), state, 1.0).kind == "SPEAK"
    assert later(request(), state, 2.0).kind == "SPEAK"


@given(*(st.sampled_from(("info", "advice", "warning")) for _ in range(2)), st.floats(0.0, 1.9))
def test_what_is_graver_cuts_the_last_message_short_and_nothing_else_does(
    last: Urgency, now: Urgency, seconds: float
) -> None:
    state = decide(request(fused=fused(urgency=last)), mirror(request()), CALIBRATED).state
    graver = ("info", "advice", "warning").index(now) > ("info", "advice", "warning").index(last)
    assert (later(request(fused=fused(urgency=now)), state, seconds).kind == "SPEAK") is graver


WORDS = st.tuples(
    st.sampled_from(("person", "stop", "ahead", "give_way", "friction", "limit")), st.sampled_from(GRAVITY)
)


@given(WORDS, WORDS, st.floats(0.0, 1.9))
def test_of_two_as_grave_what_presses_cuts_short_what_does_not(
    last: tuple[str, Urgency], now: tuple[str, Urgency], seconds: float
) -> None:
    assume(last[1] == now[1])
    said = fused(topic=last[0], urgency=last[1])
    state = decide(request(fused=said), mirror(request()), CALIBRATED).state
    spoken = later(request(fused=fused(topic=now[0], urgency=now[1])), state, seconds).kind == "SPEAK"
    assert spoken is (now[1] != "info" and now[0] in PRESSING and last[0] not in PRESSING)


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


def test_a_decision_can_be_decided_again_from_its_log() -> None:
    asked = request(track(gap_m=18.0), feedback=(Feedback(label="late_warning"),))
    logged = decide(asked, mirror(asked), CALIBRATED).decision
    wire = msgspec.json.decode(msgspec.json.encode(logged), type=type(logged))
    assert redecide(asked, wire, CALIBRATED).decision == logged


@FEW
@given(requests())
def test_every_situation_gets_a_decision_that_survives_the_wire(asked: ArbitrationRequest) -> None:
    decision = decide(asked, mirror(asked), CALIBRATED).decision
    assert msgspec.json.decode(msgspec.json.encode(decision), type=type(decision)) == decision


# -- known worse: never a lower r -------------------------------------------------------------------------------------


@FEW
@given(requests(), st.floats(0.0, 0.9))
def test_less_friction_never_lowers_r(asked: ArbitrationRequest, less: float) -> None:
    if asked.mu_low is None or asked.mu_high is None:
        return
    worse = replace(asked, mu_low=max(0.05, asked.mu_low - less), mu_high=max(0.05, asked.mu_high - less))
    before, after = (decide(a, mirror(a), CALIBRATED).decision.metrics for a in (asked, worse))
    assert after.r >= before.r
    assert after.r_act >= before.r_act


@FEW
@given(requests(), probability)
def test_more_degradation_never_lowers_r(asked: ArbitrationRequest, more: float) -> None:
    if asked.h is None:
        return
    worse = replace(asked, h=min(1.0, asked.h + more))
    before, after = (decide(a, mirror(a), CALIBRATED).decision.metrics for a in (asked, worse))
    assert after.r >= before.r
    assert after.r_act >= before.r_act


@FEW
@given(requests(), probability)
def test_weaker_brakes_never_lower_r(asked: ArbitrationRequest, less: float) -> None:
    if asked.brake_envelope is None:
        return
    worse = replace(asked, brake_envelope=max(0.0, asked.brake_envelope - less))
    before, after = (decide(a, mirror(a), CALIBRATED).decision.metrics for a in (asked, worse))
    assert after.r >= before.r
    assert after.r_act >= before.r_act


@FEW
@given(requests(), st.floats(0.0, 50.0))
def test_a_smaller_gap_never_lowers_r(asked: ArbitrationRequest, nearer: float) -> None:
    if asked.lead is None:
        return
    # Still ahead: an actor behind the ego's centre is no longer in front of it.
    worse = replace(asked, lead=replace(asked.lead, x_m=max(0.1, asked.lead.x_m - nearer)))
    before, after = (decide(a, mirror(a), CALIBRATED).decision.metrics for a in (asked, worse))
    assert after.r >= before.r - 1e-12
    assert after.r_act >= before.r_act - 1e-12


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


LESS: dict[str, Callable[[ArbitrationRequest, float], ArbitrationRequest]] = {
    "lower confidence": _less_sure,
    "wider friction interval": _wider_friction,
    "doubted actor": _doubted_lead,
    "actor not seen for longer": _older_lead,
    "actor measured less exactly": _vaguer_lead,
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
@FEW
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
@FEW
@given(asked=critical, x=probability)
def test_less_information_in_danger_never_turns_speak_into_act(way: str, asked: ArbitrationRequest, x: float) -> None:
    fewer = LESS[way](asked, x)
    if not acts(asked):
        assert not acts(fewer)


@FEW
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


@FEW
@given(st.text(max_size=200), st.text(max_size=200))
def test_no_text_moves_the_decision(directive: str, justification: str) -> None:
    asked = request(track(gap_m=30.0, closing_mps=3.0))
    said = replace(asked, fused=fused(directive="x" + directive, justification=justification, topic=directive))
    assert (
        decide(said, mirror(said), CALIBRATED).decision.kind == decide(asked, mirror(asked), CALIBRATED).decision.kind
    )

"""How often the driver is spoken to: budget, repeats, what cuts what short."""

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from msgspec.structs import replace

from domain.speech import GRAVITY, WARNS
from proto.decision import ArbitrationRequest, Decision, Urgency
from proto.perception import Track
from services.arbiter.decide import decide
from services.arbiter.memory import attention
from services.arbiter.state import ArbiterState, Attention
from tests.unit.services.arbiter.support import (
    CALIBRATED,
    FEW,
    SECOND,
    fused,
    mirror,
    request,
    track,
    with_view,
)

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


@given(topic=st.text(max_size=8), urgency=st.sampled_from(sorted(WARNS)), messages=st.floats(0.0, 4.0))
def test_what_warns_waits_for_no_budget(topic: str, urgency: Urgency, messages: float) -> None:
    asked = request(fused=fused(topic=topic, urgency=urgency))
    inputs = mirror(asked)
    held = Attention(messages=messages, refilled_ns=inputs.now_ns)
    verdict = decide(asked, replace(inputs, state=replace(inputs.state, attention=held)), CALIBRATED)
    assert verdict.decision.kind == "SPEAK"
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
    told = replace(inputs.state, attention=before.attention, memory=before.memory)
    return decide(asked, replace(inputs, state=told), CALIBRATED).decision


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


def test_advice_waits_for_the_end_of_the_last_message() -> None:
    state = decide(request(), mirror(request()), CALIBRATED).state
    assert "still being heard" in later(request(), state, 1.0).reason
    assert later(request(), state, 2.0).kind == "SPEAK"


WORDS = st.tuples(
    st.sampled_from(("person", "stop", "ahead", "give_way", "friction", "limit")), st.sampled_from(GRAVITY)
)


@given(WORDS, WORDS, st.floats(0.0, 1.9), st.booleans())
def test_a_warning_cuts_a_calmer_message_short_and_all_else_waits_first_notices_too(
    last: tuple[str, Urgency], now: tuple[str, Urgency], seconds: float, first_notice: bool
) -> None:
    said = fused(topic=last[0], urgency=last[1])
    state = decide(request(fused=said), mirror(request()), CALIBRATED).state
    asked = request(fused=fused(topic=now[0], urgency=now[1], first_notice=first_notice))
    spoken = later(asked, state, seconds).kind == "SPEAK"
    assert spoken is (now[1] in ("warning", "alarm") and GRAVITY.index(now[1]) > GRAVITY.index(last[1]))
    assert not first_notice or later(asked, state, CALIBRATED.speech_gap_s).reason == "first notice"


def test_the_budget_refills_with_time_up_to_its_measure_and_by_no_clock_that_goes_back() -> None:
    empty = attention.refill(Attention(messages=0.5), 10 * SECOND, CALIBRATED)
    assert empty == Attention(messages=0.5, refilled_ns=10 * SECOND)
    half_s = CALIBRATED.budget_refill_s / 2.0
    later = attention.refill(empty, 10 * SECOND + int(half_s * 1e9), CALIBRATED)
    assert later.messages == pytest.approx(1.0)
    assert attention.refill(later, 9 * SECOND, CALIBRATED) == later
    assert attention.refill(later, 10_000 * SECOND, CALIBRATED).messages == CALIBRATED.budget_messages
    assert attention.spend(Attention(messages=2.5, refilled_ns=3)) == Attention(messages=1.5, refilled_ns=3)
    assert attention.spend(Attention(messages=0.5)).messages == 0.0


def test_a_clock_that_is_a_little_behind_was_not_set_back() -> None:
    now_ns = 10 * SECOND
    assert not attention.set_back(Attention(messages=1.0), now_ns)
    assert not attention.set_back(Attention(messages=1.0, refilled_ns=now_ns + attention.SET_BACK_NS), now_ns)
    assert attention.set_back(Attention(messages=1.0, refilled_ns=now_ns + attention.SET_BACK_NS + 1), now_ns)


def test_information_needs_the_reserve_too_and_what_warns_needs_nothing() -> None:
    assert attention.needed(fused(urgency="info"), CALIBRATED) == 1.0 + CALIBRATED.budget_reserve
    assert attention.needed(fused(urgency="advice"), CALIBRATED) == 1.0
    assert all(attention.needed(fused(urgency=urgency), CALIBRATED) == 0.0 for urgency in WARNS)

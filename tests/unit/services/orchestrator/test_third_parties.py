"""What a third party's expert may do: lower, widen, speak; never permit."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.tools import Effect
from services.orchestrator.observations.inputs import Expert
from tests.unit.services.orchestrator.judge import arbiter
from tests.unit.services.orchestrator.scenes import acts, hostile, next_seen, one, scenes, target
from tests.unit.services.orchestrator.support import (
    EXPERTS,
    FEW,
    SECOND,
    Drive,
    Played,
    conditions,
    limit_sign,
    replace,
)

EXPERT = Expert(
    tool="roadworks",
    answers=("stale_fact", "speed_limit_change", "low_friction", "overspeed"),
    deadline_ms=40.0,
    effect=Effect(
        target_mps_field="target", speed_factor_field="factor", headway_factor_field="headway", text_field="text"
    ),
)

any_value = st.one_of(
    st.none(),
    st.floats(allow_nan=False),
    st.integers(),
    st.sampled_from([10**400, -(10**400)]),
    st.text(max_size=20),
    st.booleans(),
    st.lists(st.integers()),
)


@FEW
@given(
    drive=scenes(),
    result=st.fixed_dictionaries(
        {
            "target": any_value,
            "factor": any_value,
            "headway": any_value,
            "text": hostile | any_value,
            "confidence": any_value,
        }
    ),
)
def test_a_third_party_can_only_lower_and_widen(drive: Drive, result: dict[str, object]) -> None:
    news = limit_sign("limit:50", track_id=20)
    seen = next_seen(drive, news)
    before = one(drive, seen)
    table = {**drive.ask.table, "roadworks": lambda a: result}
    after = one(drive, replace(seen, experts=(EXPERT,)), Played(table, arbiter=arbiter()))
    assert target(after) <= target(before) + 1e-9
    assert after.fused.headway_factor >= before.fused.headway_factor - 1e-9
    assert acts(before) or not acts(after)


@pytest.mark.parametrize(
    "answer",
    [
        {"factor": 2.0},
        {"factor": 1e9},
        {"target": 99.0},
        {"headway": 0.1},
        {"headway": -5.0},
        {"factor": "2"},
        {"target": 10**400},
    ],
)
def test_a_third_partys_permission_is_none(answer: dict[str, object]) -> None:
    plain, told = Drive(), Drive(Played({**EXPERTS, "roadworks": lambda a: answer}), experts=(EXPERT,))
    for drive in (plain, told):
        drive.weather = conditions(mu=0.5, factor=0.8, following_factor=1.3)
        drive.tick(limit_sign("limit:30"))
        drive.ticks(3)
    assert told.target_mps == pytest.approx(plain.target_mps)
    assert told.history[-1][2].fused.headway_factor == plain.history[-1][2].fused.headway_factor
    assert "roadworks" in {call.tool for call in told.ask.calls}


def test_a_third_partys_word_joins_routing_fusion_and_message() -> None:
    answer = {"target": 8.0, "headway": 1.5, "text": "Lane narrows", "confidence": 0.8}
    drive = Drive(Played({**EXPERTS, "roadworks": lambda a: answer}), experts=(EXPERT,))
    drive.ticks(80)
    assert drive.target_mps == pytest.approx(8.0)
    assert drive.history[-1][2].fused.headway_factor == 1.5
    assert any("Slow to" in text for text in drive.spoken())


@pytest.mark.parametrize("gone", [False, True])
def test_an_expert_that_falls_silent_lifts_nothing_at_once(gone: bool) -> None:
    drive = Drive(Played({**EXPERTS, "roadworks": lambda a: {"target": 8.0, "confidence": 0.8}}), experts=(EXPERT,))
    drive.ticks(20)
    drive.ask.table = EXPERTS
    if gone:
        drive.base = replace(drive.base, experts=())
    for _ in range(300):
        drive.tick()
        assert drive.target_mps == pytest.approx(8.0)
    drive.base = replace(drive.base, experts=())
    drive.ticks(800)
    assert drive.target_mps > 8.0


def test_an_expert_that_sees_no_more_lifts_its_restriction() -> None:
    drive = Drive(Played({**EXPERTS, "roadworks": lambda a: {"target": 8.0, "confidence": 0.8}}), experts=(EXPERT,))
    drive.ticks(20)
    drive.ask.table = {**EXPERTS, "roadworks": lambda a: {}}
    drive.ticks(120)
    assert drive.target_mps > 8.0


@FEW
@given(st.floats(1.0, 1e6), st.integers(1, 12), st.booleans())
def test_a_clock_that_is_set_forward_lifts_no_restriction(forward_s: float, ticks: int, gone: bool) -> None:
    drive = Drive(Played({**EXPERTS, "roadworks": lambda a: {"target": 8.0, "confidence": 0.8}}), experts=(EXPERT,))
    drive.ticks(20)
    drive.ask.table = EXPERTS
    if gone:
        drive.base = replace(drive.base, experts=())
    drive.now_ns += round(forward_s * SECOND)
    for _ in range(ticks):
        drive.tick()
        assert drive.target_mps == pytest.approx(8.0)


@FEW
@given(st.floats(1.0, 1e6))
def test_an_expert_is_asked_again_after_the_clock_was_set_back(back_s: float) -> None:
    drive = Drive(Played({**EXPERTS, "roadworks": lambda a: {"target": 8.0, "confidence": 0.8}}), experts=(EXPERT,))
    drive.now_ns += 2 * round(back_s * SECOND)
    drive.ticks(20)
    drive.ask.table = {**EXPERTS, "roadworks": lambda a: {"target": 6.0, "confidence": 0.8}}
    drive.now_ns -= round(back_s * SECOND)
    drive.ticks(80)
    assert drive.target_mps == pytest.approx(6.0)

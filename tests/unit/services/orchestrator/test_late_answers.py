"""Answers that come late, fail or are old."""

import msgspec
import pytest

from proto.sensors import StopLine
from tests.unit.services.orchestrator.support import (
    EXPERTS,
    KMH,
    Drive,
    Played,
    actor,
    end_sign,
    limit_answer,
    limit_sign,
)


def test_a_late_answer_is_used_in_the_next_tick() -> None:
    drive = Drive()
    drive.ask.table = {tool: expert for tool, expert in drive.ask.table.items() if tool != "applicable_limit"}
    drive.tick(end_sign("town_exit"))
    held = drive.target_mps
    missed = next(o for o in drive.history[-1][2].outcomes if o.tool == "applicable_limit")
    answer = msgspec.to_builtins(limit_answer(100))
    late = msgspec.structs.replace(missed, status="ok", result=answer, late=True, age_ms=120.0)
    advisory = drive.tick(late=(late,)).advisory
    assert held == pytest.approx(50 * KMH)
    assert drive.target_mps == pytest.approx(100 * KMH)
    assert advisory.late_tools == ("applicable_limit",)


def test_a_late_answer_to_yesterdays_question_is_not() -> None:
    drive = Drive()
    question = next(o for o in drive.history[0][2].outcomes if o.tool == "applicable_limit")
    drive.tick(limit_sign("limit:30"))
    drive.tick(late=(msgspec.structs.replace(question, late=True, age_ms=200.0),))
    assert drive.target_mps == pytest.approx(30 * KMH)


def test_a_stale_weather_is_asked_for_again() -> None:
    drive = Drive()
    drive.ticks(5)
    drive.weather, drive.ask.calls[:] = None, []
    drive.ticks(60)
    assert "assess_weather" in {call.tool for call in drive.ask.calls}


def test_a_dead_service_does_not_cost_every_tick() -> None:
    drive = Drive(Played(experts={}))
    drive.ticks(50)
    assert sum(call.tool == "applicable_limit" for call in drive.ask.calls) <= 11


def test_a_tool_that_just_failed_counts_as_failed_while_it_is_left_in_peace() -> None:
    drive = Drive()
    drive.ticks(20)
    drive.ask.table = {tool: expert for tool, expert in EXPERTS.items() if tool != "right_of_way"}
    drive.tracks = (actor(25.0, closing_mps=12.0, kind="pedestrian"),)
    drive.lines = (StopLine(distance_m=30.0, kind="crossing"),)
    for _ in range(20):
        ticked = drive.tick()
        assert ticked.request.tool_timed_out
        assert "tool:right_of_way" in ticked.fused.degraded
        assert ticked.fused.confidence == pytest.approx(0.9 * 0.9)
    drive.ask.table = EXPERTS
    drive.ticks(6)
    assert not drive.tick().request.tool_timed_out


def test_without_the_arbiter_there_is_no_act() -> None:
    drive = Drive()
    drive.tracks, drive.lead = (actor(3.0, 12.0),), 5
    ticked = drive.tick()
    assert ticked.decision.profile == "local"
    assert ticked.decision.kind == "SPEAK"


def test_a_decision_on_another_tick_does_not_count() -> None:
    drive = Drive()
    other = drive.tick().decision
    drive.ask.decide = lambda request: msgspec.structs.replace(other, kind="ACT", profile="calibrated")
    assert drive.tick().decision.profile == "local"


def test_the_watchdogs_tick_is_degraded_and_no_less_careful() -> None:
    drive = Drive()
    drive.tick(limit_sign("limit:30"))
    before = drive.target_mps
    for _ in range(50):
        ticked = drive.tick(cause="watchdog", tracks=None, ego=None, road=None, unhealthy=("perception/tracks",))
    assert "snapshot" in ticked.advisory.degraded
    assert ticked.world.ego.speed_mps is None
    assert ticked.world.actors is None
    assert drive.target_mps <= before

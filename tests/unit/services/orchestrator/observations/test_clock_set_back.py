"""A wall clock that is set back makes nothing silent, and what had failed is asked again."""

from types import SimpleNamespace
from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.node import Node
from services.orchestrator.observations.clock_set_back import on_this_clock
from services.orchestrator.observations.inputs import Cause
from services.orchestrator.service import Orchestrator, OrchestratorConfig
from tests.unit.services.orchestrator.judge import arbiter
from tests.unit.services.orchestrator.support import (
    EXPERTS,
    FEW,
    SECOND,
    TICK,
    Drive,
    Played,
    actor,
    fact,
    limit_sign,
)


@FEW
@given(st.floats(10.0, 900.0))
def test_an_overspeed_that_begins_after_the_step_is_told_by_the_table_of_times(back: float) -> None:
    drive = Drive()
    drive.tick(limit_sign("limit:50"))
    drive.comes_to(18.0)
    drive.ticks(60)
    drive.comes_to(12.0)
    drive.ticks(30)
    drive.now_ns -= round(back * SECOND)
    drive.ticks(2)
    drive.comes_to(18.0)
    assert any(drive.tick().fused.first_notice for _ in range(45))


@FEW
@given(st.floats(2.0, 900.0))
def test_a_hazard_is_told_again_after_the_step_with_and_without_the_arbiter(back: float) -> None:
    for judge in (arbiter(), lambda request: None):
        drive = Drive(Played(arbiter=judge))
        drive.ticks(60)
        drive.tracks = (actor(25.0, closing_mps=12.0, kind="pedestrian", track_id=50, length_m=0.6),)
        drive.ticks(10)
        drive.now_ns -= round(back * SECOND)
        drive.ticks(3)
        assert any(ticked.advisory.kind != "SILENT" for _, _, ticked in drive.history[-3:])


@FEW
@given(st.floats(1.0, 900.0))
def test_a_lamp_that_turns_red_after_the_step_is_red(back: float) -> None:
    drive = Drive(speed_mps=5.0)
    drive.tick(fact("light", "light:green", track_id=4, distance_m=60.0))
    drive.now_ns -= round(back * SECOND)
    drive.ticks(3)
    drive.tick(fact("light", "light:red", track_id=4, distance_m=58.0))
    assert drive.state.light is not None
    assert drive.state.light.state == "red"


@FEW
@given(st.floats(0.2, 900.0))
def test_a_red_light_stands_over_the_step(back: float) -> None:
    drive = Drive(speed_mps=5.0)
    drive.tick(fact("light", "light:red", track_id=4, distance_m=60.0))
    drive.now_ns -= round(back * SECOND)
    drive.tick()
    assert drive.state.light is not None
    assert drive.state.light.state == "red"


@FEW
@given(st.floats(1.0, 900.0), st.integers(1, 40))
def test_an_overspeed_that_lasts_over_the_step_is_shown_and_sounded(back: float, before: int) -> None:
    drive = Drive()
    drive.tick(limit_sign("limit:50"))
    drive.comes_to(18.0)
    drive.ticks(before)
    drive.now_ns -= round(back * SECOND)
    shown = [drive.tick().assistance.warning for _ in range(60)]
    assert "none" not in shown[15:]
    assert "sounded" in shown


def test_a_tool_that_failed_before_the_step_is_asked_after_it() -> None:
    drive = Drive(Played({tool: expert for tool, expert in EXPERTS.items() if tool != "applicable_limit"}))
    drive.ticks(60)
    drive.ask.table = EXPERTS
    drive.now_ns -= 100 * SECOND
    drive.ask.calls.clear()
    drive.tick(limit_sign("limit:30"))
    assert "applicable_limit" in {call.tool for call in drive.ask.calls}


def test_a_clock_that_goes_on_changes_nothing() -> None:
    drive = Drive()
    drive.ticks(20)
    assert on_this_clock(drive.state, drive.now_ns) is drive.state


@pytest.mark.parametrize("ticked", [True, False])
def test_the_watchdog_ticks_whatever_the_clock_was_set_back_to(ticked: bool) -> None:
    clock = SimpleNamespace(time_ns=10**18)
    clock.now_ns = lambda: clock.time_ns
    node = cast(Node, SimpleNamespace(clock=clock, lockstep=False))
    orchestrator = Orchestrator(OrchestratorConfig(start_s=2.0), node)
    found: list[Cause] = []

    def tick(cause: Cause) -> None:
        found.append(cause)
        orchestrator._ticked_ns = clock.time_ns

    cast(Any, orchestrator).tick = tick
    orchestrator.watch()
    if ticked:
        orchestrator.tick("snapshot")
        found.clear()
    clock.time_ns -= 100 * SECOND
    for _ in range(40):
        clock.time_ns += TICK
        orchestrator.watch()
    assert len(found) >= 7, "four seconds without sensors"

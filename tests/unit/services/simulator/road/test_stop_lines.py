"""Traffic lights, gantries and stop lines."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.simulator.road.gantries import HOLDS_S, LEGIBLE_M, LEGIBLE_S, Comes, Shown, decide
from services.simulator.road.route import Route
from services.simulator.road.stop_lines import Cycle, Stood, build_lines, must_stop
from services.simulator.scenario.plan import GantryPlan, LightPlan, PanelStep
from tests.unit.services.simulator._scenes import scenario

PLAN = LightPlan(at_m=100, green_s=10, amber_s=3, red_s=8, red_amber_s=1, red_on_approach_m=60)


def test_a_light_waits_in_green_until_somebody_approaches_then_runs_its_cycle() -> None:
    light = Cycle(PLAN)
    assert light.state(500.0) == "green"
    assert light.approached(20.0, 80.0) is light
    begun = light.approached(20.0, 59.0)
    states = [begun.state(20.0 + at) for at in (0.0, 2.9, 3.1, 10.9, 11.5, 12.5, 21.0, 22.1)]
    assert states == ["amber", "amber", "red", "red", "red_amber", "green", "green", "amber"]


def test_both_directions_never_have_green_at_once_and_there_is_a_clearance() -> None:
    light = Cycle(LightPlan(at_m=100, red_s=20))
    for tenth in range(900):
        if light.opposing(tenth / 10) != "red":
            assert light.state(tenth / 10) == "red"


def test_amber_stops_who_can_stop() -> None:
    assert must_stop("amber", 14.0, 50.0)
    assert not must_stop("amber", 14.0, 20.0)
    assert must_stop("red", 14.0, 5.0)
    assert not must_stop("green", 14.0, 5.0)


def test_a_stop_sign_is_served_by_standing_before_it() -> None:
    line = build_lines(Route(scenario(rest="[[stops]]\nat_m = 200")))[0]
    rolling, standing = Stood(), Stood()
    for step in range(60):
        assert not rolling.watch(0, line, 2.0, 1.0, step * 0.05)
        done = standing.watch(0, line, 2.0, 0.0, step * 0.05)
    assert done


FAR = Comes(400.0, 30.0)
GANTRY = GantryPlan(at_m=500, steps=(PanelStep(at_s=0, code="led:120"), PanelStep(at_s=30, code="led:100")))


@pytest.mark.parametrize(
    ("time_s", "speeds", "code", "symbol"),
    [
        (10.0, (33.0, 30.0), "led:120", ""),
        (40.0, (33.0, 30.0), "led:100", ""),
        (10.0, (20.0, 30.0), "led:100", ""),
        (40.0, (14.0,), "led:80", ""),
        (10.0, (2.0, 30.0), "led:60", "led:congestion"),
        (10.0, (), "led:120", ""),
    ],
)
def test_a_gantry_shows_its_programme_or_less_where_traffic_is_slow(
    time_s: float, speeds: tuple[float, ...], code: str, symbol: str
) -> None:
    shown = decide(GANTRY, Shown("led:120"), time_s, speeds, FAR)
    assert (shown.code, shown.symbol) == (code, symbol)


def test_a_gantry_does_not_flicker() -> None:
    shown = decide(GANTRY, Shown("led:120"), 10.0, (2.0,), FAR)
    assert decide(GANTRY, shown, 10.0 + HOLDS_S - 0.1, (33.0,), FAR) is shown
    assert decide(GANTRY, shown, 10.0 + HOLDS_S + 0.1, (33.0,), FAR).code == "led:120"


@given(
    st.floats(-100.0, 400.0), st.floats(0.0, 50.0), st.floats(0.0, 100.0), st.lists(st.floats(0.0, 40.0), max_size=3)
)
def test_a_gantry_changes_only_while_the_ego_can_still_read_it_or_has_passed(
    room_m: float, speed_mps: float, time_s: float, downstream: list[float]
) -> None:
    before = Shown("led:120")
    after = decide(GANTRY, before, time_s, downstream, Comes(room_m, speed_mps))
    held = 0.0 <= room_m <= max(LEGIBLE_M, LEGIBLE_S * speed_mps)
    assert after is before if held else after == decide(GANTRY, before, time_s, downstream, FAR)

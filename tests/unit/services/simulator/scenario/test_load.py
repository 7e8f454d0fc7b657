"""Scenario files: what may stand in them, and how a mistake is named."""

import re

import pytest

from drivemcp.paths import data
from services.simulator.road.furniture import build_gantries, build_signs
from services.simulator.road.route import Route
from services.simulator.scenario.load import ScenarioError, load_scenario, parse_scenario, read_fault
from services.simulator.scenario.plan import FaultPlan
from tests.unit.services.simulator._scenes import scenario, scenario_text

SHIPPED = ("urb-rain", "cross-border", "dynamic-vsl")


@pytest.mark.parametrize("name", SHIPPED)
def test_a_shipped_scenario_is_valid_and_long_enough_for_three_minutes(name: str) -> None:
    found = load_scenario(data(f"scenarios/{name}.toml"))
    assert found.name == name
    assert found.length_m - found.ego.at_m >= 2000


@pytest.mark.parametrize("name", SHIPPED)
def test_every_sign_of_a_shipped_scenario_can_be_drawn(name: str) -> None:
    from services.simulator.signart import face_size_m

    route = Route(load_scenario(data(f"scenarios/{name}.toml")))
    for face in [face for post in build_signs(route, 1) for face in post.faces]:
        assert min(face_size_m(face.country, face.code)) > 0
    for panel in [panel for gantry in build_gantries(route) for panel in gantry.panels]:
        assert not panel.code or min(face_size_m(panel.country, panel.code)) > 0


@pytest.mark.parametrize(
    ("rest", "field"),
    [
        ('[[signs]]\nat_m = "far"\ncodes = ["stop"]', "signs[0].at_m"),
        ("[[signs]]\nat_m = 100\ncodes = []", "signs[0].codes"),
        ('[[signs]]\nat_m = 100\ncodes = ["limit:35"]', "signs[0].codes[0]"),
        ('[[signs]]\nat_m = 5000\ncodes = ["stop"]', "signs[0].at_m"),
        ('[[signs]]\nat_m = 100\ncodes = ["stop"]\ncolour = "red"', "signs[0]"),
        ("[[walkers]]\nfrom_m = 50\nto_m = 20\ncount = 1", "walkers[0].to_m"),
        ("[[weather]]\nat_s = 0\nrain_mm_h = 3", "weather[1].at_s"),
        ('[[gantries]]\nat_m = 100\nsteps = [{ at_s = 0, code = "led:55" }]', "gantries[0].steps[0].code"),
        ("[[vehicles]]\nat_m = 100\nspeed_kmh = 50\nlane = 2", "vehicles[0].lane"),
        ("[[water]]\nfrom_m = 50\nto_m = 20\nfilm_mm = 3", "water[0].to_m"),
        ("[[yields]]\nat_m = 5000", "yields[0].at_m"),
        ("[[faults]]\nat_s = 3\npreset = 'explode'", "faults[0].preset"),
        ("[[faults]]\nat_s = 3\npreset = 'low_tyre'\nseverity = 1.5", "faults[0].severity"),
    ],
)
def test_a_mistake_is_told_with_file_and_field(rest: str, field: str) -> None:
    with pytest.raises(ScenarioError, match=re.escape(f"mine.toml: {field}")):
        parse_scenario(scenario_text(rest=rest), "mine.toml")


def test_a_fault_is_read_with_its_severity_and_second() -> None:
    assert read_fault("low_tyre:0.5@12") == FaultPlan(preset="low_tyre", severity=0.5, at_s=12.0)
    assert read_fault("overheat") == FaultPlan(preset="overheat")
    for wrong in ("explode@3", "low_tyre@soon", "low_tyre:0@3", "low_tyre:2@3", "low_tyre@-1", "low_tyre:nan@3"):
        with pytest.raises(ValueError, match="fault"):
            read_fault(wrong)


def test_a_changeover_needs_a_road_with_one_lane_each_way() -> None:
    with pytest.raises(ScenarioError, match=r"road\.changeover_m"):
        scenario(lanes=2, road="changeover_m = 400")


def test_what_is_no_toml_and_what_is_absent_is_told_in_one_line() -> None:
    with pytest.raises(ScenarioError, match="not TOML"):
        parse_scenario("name = [", "mine.toml")
    with pytest.raises(ScenarioError, match="cannot be read"):
        load_scenario(data("scenarios") / "no-such.toml")

"""The page on the simulation: its example drives, and its numbers are the code's."""

import re
from itertools import product
from pathlib import Path

import pytest

from services.simulator.car import braking
from services.simulator.car.condition import SOUND
from services.simulator.car.faults import FAULTS, Active
from services.simulator.car.state import CarModel, Controls
from services.simulator.driver.driver import ADVICE_HOLDS_S, WARNING_HOLDS_S
from services.simulator.environment.weather import friction
from services.simulator.scenario.load import parse_scenario
from services.simulator.service import SimulatorConfig
from services.simulator.world import World
from tests.unit.services.simulator._braking import stopping_m

DOCS = Path(__file__).parents[4] / "docs"
PAGE = (DOCS / "explanation" / "simulation.md").read_text(encoding="utf-8")
MEASURED = (DOCS / "results" / "measured" / "weather.md").read_text(encoding="utf-8")


def test_the_example_of_the_page_drives() -> None:
    block = re.search(r"```toml\n(.*?)```", PAGE, re.S)
    assert block is not None
    world = World(parse_scenario(block.group(1), "docs/explanation/simulation.md"), 1)
    for _ in range(100):
        snapshot = world.step()
    assert snapshot.ego.s_m > 80
    assert not snapshot.fact.collision


def test_the_numbers_of_the_page_are_the_code_s() -> None:
    assert f"{SimulatorConfig().ahead_ms:.0f} ms ahead" in PAGE
    assert f"after {ADVICE_HOLDS_S:.0f} s" in PAGE
    assert f"after {WARNING_HOLDS_S:.0f} s" in PAGE
    assert friction(0.0) == pytest.approx(0.85)
    assert friction(0.5) == pytest.approx(0.48, abs=0.01)


def _after_a_minute(preset: str) -> braking.Ability:
    condition, model = SOUND if preset == "sound" else FAULTS[preset].breaks(SOUND, Active(1.0, 60.0)), CarModel()
    for _ in range(60):
        state = model.step(1.0, Controls(speed_mps=20.0), condition)
    return braking.ability(condition, state)


def test_the_measured_ways_to_stop_are_the_car_s() -> None:
    rows = re.findall(r"^\| `?(\w+)`? \| (\d+) \| (\d+) \| (\d+) \| (\d+) \|$", MEASURED, re.M)
    assert len(rows) == 7
    for preset, *told in rows:
        car = _after_a_minute(preset)
        ways = [stopping_m(car, film_mm=film, asked_mps2=asked) for film, asked in product((0.0, 0.5), (8.3, 4.0))]
        assert [float(way) for way in told] == pytest.approx(ways, abs=0.6)


def test_every_preset_without_a_sensor_stands_on_the_page() -> None:
    for preset, fault in FAULTS.items():
        if fault.routine < 0xF010:
            assert f"`{preset}`" in PAGE

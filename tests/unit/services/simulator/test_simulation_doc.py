"""The page on the simulation: its example drives, and its numbers are the code's."""

import re
from pathlib import Path

import pytest

from services.simulator.driver import ADVICE_HOLDS_S, WARNING_HOLDS_S
from services.simulator.realtime import AHEAD_NS
from services.simulator.scenario import parse_scenario
from services.simulator.weather import friction
from services.simulator.world import World

PAGE = (Path(__file__).parents[4] / "docs" / "simulation.md").read_text(encoding="utf-8")


def test_the_example_of_the_page_drives() -> None:
    block = re.search(r"```toml\n(.*?)```", PAGE, re.S)
    assert block is not None
    world = World(parse_scenario(block.group(1), "docs/simulation.md"), 1)
    for _ in range(100):
        moment = world.step()
    assert moment.ego.s_m > 80
    assert not moment.fact.collision


def test_the_numbers_of_the_page_are_the_code_s() -> None:
    assert f"{AHEAD_NS // 1_000_000} ms ahead" in PAGE
    assert f"after {ADVICE_HOLDS_S:.0f} s" in PAGE
    assert f"after {WARNING_HOLDS_S:.0f} s" in PAGE
    assert friction(0.0) == pytest.approx(0.85)
    assert friction(0.5) == pytest.approx(0.48, abs=0.01)

"""dynamic-vsl: a German motorway under gantries, in drizzle and rain, with a congestion tail behind one of them."""

from random import Random

from evaluation.scenarios.draft import Draft
from services.simulator.plan import GantryPlan, PanelStep, QueuePlan, Scenario

LANES = 3


def lay(chance: Random, name: str, turn: int) -> Scenario:
    """The layout; `turn` counts within a split and deals the hazards out."""
    draft = Draft(chance)
    draft.stretch("motorway", "fields")
    _gantry(draft, 330.0, (0.0, 120))
    draft.sign(560.0, "limit:100", "plate:when_wet:de", side="both")
    _gantry(draft, 800.0, (0.0, 120), (16.0, 100))
    _course(draft, 900.0)
    _gantry(draft, 220.0, (0.0, 100), (24.0, 80))
    _gantry(draft, 550.0, (0.0, 100), (20.0, 80))
    tail_m = draft.at_m + 740.0
    draft.queues.append(QueuePlan(tail_m=tail_m, rows=4, spacing_m=15.0, speed_kmh=8.0, dissolves_s=95.0))
    _course(draft, 1500.0)
    draft.stretch("motorway", "forest")
    _gantry(draft, 200.0, (0.0, 100), (120.0, 120))
    _gantry(draft, 900.0, None)
    _course(draft, 1500.0)
    about = "A German motorway: gantries that go down as traffic slows, a limit when wet, a congestion tail."
    road = {"lanes": LANES, "lane_width_m": 3.6, "median_m": 4.0}
    return draft.scenario(name=name, about=about, country="DEU", speed_kmh=118.0, road=road, ego={"lane": 1})


def _course(draft: Draft, length_m: float) -> None:
    """A straight, a wide bend, a straight."""
    end_m = draft.at_m + length_m
    draft.straight(draft.chance.uniform(0.2, 0.4) * length_m)
    draft.bend(draft.chance.choice((1500.0, 1800.0, 2200.0)), draft.chance.uniform(10.0, 16.0))
    draft.straight(max(50.0, end_m - draft.at_m))


def _gantry(draft: Draft, ahead_m: float, *steps: tuple[float, int] | None) -> None:
    panels = tuple(PanelStep(at_s=0.0, code="led:end") if step is None else _step(*step) for step in steps)
    draft.gantries.append(GantryPlan(at_m=draft.at_m + ahead_m, steps=panels, follow_traffic=steps != (None,)))


def _step(at_s: float, limit: int) -> PanelStep:
    return PanelStep(at_s=at_s, code=f"led:{limit}")

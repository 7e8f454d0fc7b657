"""cross-border: from one country into another, with other signs, other defaults, and often another side and unit."""

from random import Random

from evaluation.scenarios.draft import Draft
from services.simulator.plan import LightPlan, Scenario

PAIRS = (
    ("DEU", "GBR"), ("DEU", "NLD"), ("GBR", "FRA"), ("DEU", "AUT"), ("FRA", "GBR"), ("POL", "DEU"),
    ("GBR", "NLD"), ("FRA", "DEU"), ("NLD", "GBR"), ("DEU", "POL"), ("GBR", "DEU"), ("AUT", "DEU"),
)  # fmt: skip


def lay(chance: Random, name: str, turn: int) -> Scenario:
    """The layout; `turn` counts within a split and chooses the two countries."""
    here, there = PAIRS[turn % len(PAIRS)]
    draft = Draft(chance)
    _before(draft, here)
    changeover_m = _frontier(draft, here, there)
    _behind(draft, there)
    about = f"From {here} to {there}, {'changing sides' if changeover_m else 'on the same side'}."
    road = {"side": "left" if here == "GBR" else "right", "changeover_m": changeover_m}
    return draft.scenario(name=name, about=about, country=here, speed_kmh=75.0, road=road)


def _before(draft: Draft, here: str) -> None:
    draft.stretch("rural", "fields")
    fast, slow = ("50", "40") if here == "GBR" else ("70", "50")
    draft.sign(130.0, f"limit:{fast}")
    draft.straight(200.0)
    draft.bend(draft.chance.choice((300.0, 350.0)), draft.chance.uniform(15.0, 25.0))
    draft.straight(draft.chance.choice((160.0, 220.0)))
    draft.sign(-120.0, "national" if here == "GBR" else f"limit_end:{fast}")
    draft.sign(60.0, f"limit:{slow}")
    draft.straight(180.0)


def _frontier(draft: Draft, here: str, there: str) -> float | None:
    draft.stretch("rural", "harbour", lamps=True)
    draft.sign(10.0, "limit:20" if here == "GBR" else "limit:30")
    draft.sign(70.0, f"border:{there}")
    draft.sign(92.0, "limit:20" if there == "GBR" else "limit:30")
    changes = "GBR" in (here, there)
    if changes:
        draft.sign(112.0, "info:side")
        draft.lights.append(
            LightPlan(at_m=draft.at_m + 150.0, red_on_approach_m=45.0, red_s=7.0, green_s=25.0, side_road=False)
        )
    at_m = draft.at_m + 196.0 if changes else None
    draft.straight(300.0)
    return at_m


def _behind(draft: Draft, there: str) -> None:
    draft.stretch("rural", "fields")
    draft.sign(0.0, "info:units")
    draft.sign(40.0, "limit:40" if there == "GBR" else "limit:70", side="both")
    draft.straight(300.0)
    draft.sign(-60.0, "national" if there == "GBR" else "all_end")
    draft.bend(draft.chance.choice((300.0, 380.0)), draft.chance.uniform(15.0, 30.0))
    draft.straight(draft.chance.choice((220.0, 320.0)))
    _village(draft, there)
    draft.stretch("rural", "forest")
    draft.bend(300.0, 20.0)
    draft.straight(max(300.0, 2300.0 - draft.at_m))


def _village(draft: Draft, there: str) -> None:
    draft.stretch("urban", "houses", pavement=True, lamps=True, parked=4.0)
    if there == "GBR":
        draft.sign(2.0, "limit:30", side="both")
    else:
        draft.sign(2.0, "town_entry", text="Mildorf")
    draft.walk(20.0, 300.0, 7)
    draft.cross(draft.chance.uniform(150.0, 240.0), walk_mps=1.5, when_ego_within_m=52.0, hazard=True)
    draft.straight(330.0)
    draft.sign(2.0, "national" if there == "GBR" else "town_exit")

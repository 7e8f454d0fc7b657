"""cross-border: from one country into another, with other signs, other defaults, and often another side and unit."""

from collections.abc import Callable
from random import Random

from evaluation.scenarios.draft import Draft
from services.simulator.scenario.plan import HaltPlan, LightPlan, Scenario, StopPlan

PAIRS = (
    ("DEU", "GBR"), ("DEU", "NLD"), ("GBR", "FRA"), ("DEU", "AUT"), ("FRA", "GBR"), ("POL", "DEU"),
    ("GBR", "NLD"), ("FRA", "DEU"), ("NLD", "GBR"), ("DEU", "POL"), ("GBR", "DEU"), ("AUT", "DEU"),
)  # fmt: skip
VILLAGES = {
    "GBR": "Marden",
    "FRA": "Saint-Aubry",
    "NLD": "Oudveen",
    "POL": "Nowa Lipa",
    "AUT": "Waldau",
    "DEU": "Mildorf",
}
WET = {
    "FRA": ("70", "fr"),
    "NLD": ("70", "nl"),
    "POL": ("70", "pl"),
    "AUT": ("80", "de"),
    "DEU": ("80", "de"),
}
"""The limit when wet outside towns, and the plate's language; British law knows none."""
LEAST_M = 2300.0
Scene = Callable[[Draft, str], None]


def lay(chance: Random, name: str, turn: int) -> Scenario:
    """The layout; `turn` counts within a split and chooses the two countries and the hazards."""
    here, there = PAIRS[turn % len(PAIRS)]
    draft = Draft(chance)
    _before(draft, here, turn)
    changeover_m = _frontier(draft, here, there)
    _behind(draft, there)
    _village(draft, there, turn)
    _out(draft, there)
    about = f"From {here} to {there}, {'changing sides' if changeover_m else 'on the same side'}."
    road = {"side": "left" if here == "GBR" else "right", "changeover_m": changeover_m}
    return draft.scenario(name=name, about=about, country=here, speed_kmh=65.0, road=road)


def _before(draft: Draft, here: str, turn: int) -> None:
    """A limit with its end, and on every third route a vehicle that brakes."""
    draft.stretch("rural", "fields")
    fast, slow = ("50", "40") if here == "GBR" else ("70", "60")
    draft.sign(60.0, f"limit:{fast}")
    if turn % 3 == 0:
        halt = HaltPlan(at_m=draft.at_m + 260.0, hold_s=2.0, brake_mps2=3.0, hazard=True)
        draft.vehicle(80.0, kind="estate", speed_kmh=66.0, keeps_kmh=66.0, halts=(halt,))
    draft.straight(300.0)
    draft.bend(draft.chance.choice((300.0, 350.0)), draft.chance.uniform(15.0, 25.0))
    draft.straight(draft.chance.choice((160.0, 220.0)))
    draft.sign(-120.0, *_ends(here, fast))
    draft.sign(60.0, f"limit:{slow}")
    draft.straight(180.0)


def _ends(country: str, limit: str) -> tuple[str, ...]:
    """What ends a limit there."""
    return ("national",) if country == "GBR" else (f"limit_end:{limit}",)


def _frontier(draft: Draft, here: str, there: str) -> float | None:
    """Down to 30 at the border, over it, and where the side changes, to the other side behind lights."""
    draft.stretch("rural", "harbour", lamps=True)
    draft.sign(10.0, "limit:20" if here == "GBR" else "limit:30")
    draft.sign(70.0, f"border:{there}")
    draft.sign(92.0, "limit:20" if there == "GBR" else "limit:30")
    if "GBR" not in (here, there):
        draft.straight(200.0)
        return None
    draft.sign(112.0, "info:side")
    light = LightPlan(at_m=draft.at_m + 150.0, red_on_approach_m=45.0, red_s=7.0, green_s=25.0, side_road=False)
    draft.lights.append(light)
    at_m = draft.at_m + 196.0
    draft.straight(290.0)
    return at_m


def _behind(draft: Draft, there: str) -> None:
    """The new country's numbers, its end signs, its default and its limit when wet, if it has any."""
    draft.stretch("rural", "fields")
    draft.sign(10.0, "info:units")
    fast = "40" if there == "GBR" else "70"
    draft.sign(50.0, f"limit:{fast}", side="both")
    draft.straight(260.0)
    draft.sign(-20.0, *(("national",) if there == "GBR" else ("all_end",)))
    if there in WET:
        number, tongue = WET[there]
        draft.sign(90.0, f"limit:{number}", f"plate:when_wet:{tongue}")
    else:
        draft.sign(90.0, "limit:50")
    draft.bend(draft.chance.choice((300.0, 380.0)), draft.chance.uniform(15.0, 30.0))
    draft.straight(draft.chance.choice((220.0, 320.0)))
    draft.sign(-110.0, "limit:40" if there == "GBR" else "limit:70")


def _village(draft: Draft, there: str, turn: int) -> None:
    draft.stretch("urban", "houses", pavement=True, lamps=True, parked=4.0)
    if there == "GBR":
        draft.sign(2.0, "limit:30", side="both")
    else:
        draft.sign(2.0, "town_entry", text=VILLAGES[there])
    draft.walk(20.0, 110.0, 5)
    draft.straight(90.0)
    SCENES[turn % len(SCENES)](draft, there)
    SCENES[(turn // len(SCENES) + turn + 1) % len(SCENES)](draft, there)
    draft.stretch("urban", "houses", pavement=True, lamps=True)
    draft.straight(40.0)


def _out(draft: Draft, there: str) -> None:
    draft.sign(
        2.0, "national" if there == "GBR" else "town_exit", **({} if there == "GBR" else {"text": VILLAGES[there]})
    )
    draft.stretch("rural", "forest")
    draft.straight(80.0)
    draft.bend(300.0, draft.chance.uniform(15.0, 25.0))
    draft.straight(max(260.0, LEAST_M - draft.at_m))


# In the village --------------------------------------------------------------------------------------------------------


def steps_out(draft: Draft, there: str) -> None:
    """A person steps out."""
    draft.cross(draft.chance.uniform(60.0, 110.0), walk_mps=1.5, when_ego_within_m=48.0, hazard=True)
    draft.straight(170.0)


def stop_sign(draft: Draft, there: str) -> None:
    """A stop sign."""
    draft.stops.append(StopPlan(at_m=draft.at_m + 100.0))
    draft.straight(170.0)


def junction(draft: Draft, there: str) -> None:
    """A car from the right has priority: without a sign, or by a give-way sign where the country has no such rule."""
    draft.give_way(110.0, 48.0, from_side="right", sign=there == "GBR")
    draft.straight(180.0)


def blind_bend(draft: Draft, there: str) -> None:
    """A vehicle stands behind a bend that houses hide."""
    draft.stretch("urban", "houses", pavement=True, lamps=True)
    draft.straight(50.0)
    draft.bend(draft.chance.choice((60.0, 70.0, 80.0)), draft.chance.uniform(45.0, 60.0))
    draft.stands(draft.chance.uniform(0.0, 12.0), kind="van")
    draft.straight(90.0)


SCENES: tuple[Scene, ...] = (steps_out, junction, blind_bend, stop_sign)

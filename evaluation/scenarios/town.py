"""urb-rain: a German country road into a town and out of it again. Each function lays one block of the route."""

from collections.abc import Callable
from random import Random

from evaluation.scenarios.draft import Draft
from services.simulator.plan import HaltPlan, LightPlan, Scenario, StopPlan, ZebraPlan

Block = Callable[[Draft], None]
WET_60, WET_70 = ("limit:60", "plate:when_wet:de"), ("limit:70", "plate:when_wet:de")
LEAST_M = 2200.0


def lay(chance: Random, name: str, turn: int) -> Scenario:
    """The layout; `turn` counts within a split and deals the hazards out, so that every split has all of them."""
    draft = Draft(chance)
    _approach(draft)
    _enter(draft)
    for block in _inside(chance, turn):
        block(draft)
    _leave(draft)
    _outside(draft, turn)
    about = f"Germany, rain: {len(draft.signs)} signs over {draft.at_m:.0f} m of country road and town."
    return draft.scenario(name=name, about=about, country="DEU", speed_kmh=78.0)


def _inside(chance: Random, turn: int) -> list[Block]:
    """The town's blocks: three that are this layout's turn and two more, in any order; no block twice in a row."""
    own = [BLOCKS[(turn + step) % len(BLOCKS)] for step in (0, 2, 5)]
    rest = [block for block in BLOCKS if block not in own]
    chosen = own + chance.sample(rest, 2)
    chance.shuffle(chosen)
    return chosen


# Outside the town ------------------------------------------------------------------------------------------------------


def _approach(draft: Draft) -> None:
    draft.stretch("rural", "fields")
    draft.sign(115.0, *WET_70)
    draft.straight(draft.chance.choice((240.0, 280.0, 320.0)))
    draft.bend(draft.chance.choice((220.0, 260.0, 320.0)), draft.chance.uniform(18.0, 30.0))
    draft.straight(60.0)


def _leave(draft: Draft) -> None:
    draft.sign(0.0, "town_exit", text="Neuenau\nOberwald 3 km")
    draft.stretch("rural", "forest")


def _outside(draft: Draft, turn: int) -> None:
    """Out again: a slippery stretch with a limit when wet, and what the length still asks for."""
    draft.straight(140.0)
    draft.sign(20.0, "slippery", *(WET_60 if turn % 2 else WET_70))
    if turn % 3 == 1:
        lead_brakes(draft)
    draft.straight(draft.chance.choice((200.0, 260.0)))
    draft.bend(draft.chance.choice((260.0, 320.0)), draft.chance.uniform(15.0, 30.0))
    draft.straight(120.0)
    draft.sign(0.0, "all_end")
    draft.stretch("rural", "fields")
    draft.straight(max(220.0, LEAST_M - draft.at_m))


def lead_brakes(draft: Draft) -> None:
    """A vehicle that brakes and stands for a moment."""
    at_m = draft.at_m + 190.0
    halt = HaltPlan(at_m=at_m, hold_s=2.0, brake_mps2=3.0, hazard=True)
    draft.vehicle(70.0, kind="van", speed_kmh=66.0, keeps_kmh=64.0, halts=(halt,))


# In the town -----------------------------------------------------------------------------------------------------------


def _enter(draft: Draft) -> None:
    draft.sign(0.0, "town_entry", text="Neuenau\nKreis Auental")
    draft.stretch("urban", "houses", pavement=True, lamps=True, parked=5.0)
    draft.walk(15.0, 90.0, 4)
    draft.straight(100.0)


def _houses(draft: Draft, parked: float = 5.0) -> None:
    draft.stretch("urban", "houses", pavement=True, lamps=True, parked=parked)


def _town(draft: Draft) -> None:
    draft.stretch("urban", "town", pavement=True, lamps=True)


def school(draft: Draft) -> None:
    """30 at a school, with people at the kerb, one of whom steps out."""
    _houses(draft, 6.0)
    draft.sign(30.0, "children", "limit:30")
    draft.walk(50.0, 200.0, 6)
    draft.walk(110.0, 128.0, 2, side="far", mode="waiting")
    draft.cross(draft.chance.uniform(110.0, 150.0), walk_mps=1.5, when_ego_within_m=32.0, hazard=True)
    draft.sign(190.0, "limit_end:30")
    draft.straight(220.0)


def lights(draft: Draft) -> None:
    """Lights that turn red on approach, with people who cross before them."""
    _town(draft)
    draft.straight(60.0)
    draft.lights.append(LightPlan(at_m=draft.at_m, red_on_approach_m=62.0, red_s=9.0, green_s=22.0))
    draft.cross(5.0, side="far", waits_for_light=True)
    draft.cross(6.0, walk_mps=1.2, waits_for_light=True)
    draft.walk(-20.0, 110.0, 4)
    draft.straight(130.0)


def zone(draft: Draft) -> None:
    """A 30 zone."""
    _houses(draft)
    draft.sign(20.0, "zone:30", side="both")
    draft.walk(40.0, 230.0, 5)
    draft.straight(130.0)
    draft.bend(90.0, 25.0)
    draft.straight(90.0)
    draft.sign(0.0, "zone_end:30")
    draft.straight(30.0)


def stop_sign(draft: Draft) -> None:
    """A stop sign at a side road with right of way."""
    _houses(draft, 3.0)
    draft.stops.append(StopPlan(at_m=draft.at_m + 100.0))
    draft.walk(20.0, 80.0, 3)
    draft.straight(190.0)


def zebra(draft: Draft) -> None:
    """A pedestrian crossing with somebody on it."""
    _town(draft)
    draft.zebras.append(ZebraPlan(at_m=draft.at_m + 110.0))
    draft.cross(110.0, when_ego_within_m=60.0)
    draft.walk(30.0, 200.0, 5)
    draft.straight(210.0)


def steps_out(draft: Draft) -> None:
    """Somebody who steps out between parked cars at 50."""
    _houses(draft, 6.0)
    draft.cross(draft.chance.uniform(110.0, 150.0), walk_mps=1.4, when_ego_within_m=52.0, hazard=True)
    draft.walk(20.0, 180.0, 5)
    draft.straight(200.0)


BLOCKS: tuple[Block, ...] = (school, lights, zone, stop_sign, zebra, steps_out)

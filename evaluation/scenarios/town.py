"""urb-rain: a German country road into a town and out of it again. Each function lays one block of the route."""

from collections.abc import Callable
from random import Random

from evaluation.scenarios.draft import Draft
from services.simulator.scenario.plan import HaltPlan, LightPlan, Scenario, StopPlan, WaterPlan, YieldPlan, ZebraPlan

Block = Callable[[Draft], None]
PLATES = ("plate:when_wet:de", "plate:when_wet:de", "plate:when_wet:drawn")
LEAST_M = 2200.0
TOWNS = ("Neuenau", "Birkfeld", "Altenbruck", "Sandhofen")


def lay(chance: Random, name: str, turn: int) -> Scenario:
    """The layout; `turn` counts within a split and deals the hazards out, so that every split has all of them."""
    draft = Draft(chance)
    _approach(draft, turn)
    _enter(draft, TOWNS[turn % len(TOWNS)])
    for block in _inside(chance, turn):
        block(draft)
    _leave(draft, TOWNS[turn % len(TOWNS)])
    OUTSIDE[turn % len(OUTSIDE)](draft)
    _home(draft)
    about = f"Germany, rain: {len(draft.signs)} signs over {draft.at_m:.0f} m of country road and town."
    return draft.scenario(name=name, about=about, country="DEU", speed_kmh=70.0)


def _inside(chance: Random, turn: int) -> list[Block]:
    """The town's blocks: three that are this layout's turn and two more, in any order; none twice."""
    own = [BLOCKS[(turn + step) % len(BLOCKS)] for step in (0, 3, 6)]
    rest = [block for block in BLOCKS if block not in own]
    chosen = own + chance.sample(rest, 2)
    chance.shuffle(chosen)
    return chosen


# Outside the town ------------------------------------------------------------------------------------------------------


def _approach(draft: Draft, turn: int) -> None:
    draft.stretch("rural", "fields")
    draft.sign(115.0, "limit:70", draft.chance.choice(PLATES))
    if turn % 4 == 1:
        _lead_brakes(draft, 260.0)
    draft.straight(draft.chance.choice((240.0, 280.0, 320.0)))
    draft.bend(draft.chance.choice((220.0, 260.0, 320.0)), draft.chance.uniform(18.0, 30.0))
    draft.straight(100.0)
    draft.sign(-60.0, "limit:70")


def _leave(draft: Draft, town: str) -> None:
    draft.sign(0.0, "town_exit", text=f"{town}\nOberwald 3 km")
    draft.stretch("rural", draft.chance.choice(("forest", "fields")))
    draft.straight(140.0)


def _lead_brakes(draft: Draft, at_m: float) -> None:
    """A vehicle that brakes and stands for a moment."""
    halt = HaltPlan(at_m=draft.at_m + at_m, hold_s=2.0, brake_mps2=3.0, hazard=True)
    draft.vehicle(at_m - 185.0, kind="van", speed_kmh=66.0, keeps_kmh=66.0, halts=(halt,))


def slippery(draft: Draft) -> None:
    """A limit when wet, and a bend."""
    draft.sign(20.0, "slippery", "limit:70", draft.chance.choice(PLATES))
    draft.straight(draft.chance.choice((200.0, 260.0)))
    draft.bend(draft.chance.choice((260.0, 320.0)), draft.chance.uniform(15.0, 30.0))
    draft.straight(120.0)


def deep_water(draft: Draft) -> None:
    """A limit when wet, and behind it ruts in which the rain stands."""
    draft.sign(20.0, "slippery", "limit:60", draft.chance.choice(PLATES))
    film_mm = round(draft.chance.uniform(4.0, 6.0), 1)
    from_m = draft.at_m + draft.chance.uniform(160.0, 220.0)
    draft.water.append(WaterPlan(from_m=from_m, to_m=from_m + draft.chance.uniform(40.0, 90.0), film_mm=film_mm))
    draft.straight(360.0)


def lead_outside(draft: Draft) -> None:
    """A fixed 70, under which a vehicle brakes."""
    draft.sign(20.0, "limit:70")
    draft.straight(150.0)
    _lead_brakes(draft, 200.0)
    draft.straight(260.0)


OUTSIDE: tuple[Block, ...] = (deep_water, slippery, lead_outside)


def _home(draft: Draft) -> None:
    """The end of all limits, and what the length still asks for."""
    draft.sign(0.0, "all_end")
    draft.stretch("rural", "fields")
    draft.straight(max(220.0, LEAST_M - draft.at_m))


# In the town -----------------------------------------------------------------------------------------------------------


def _enter(draft: Draft, town: str) -> None:
    draft.sign(0.0, "town_entry", text=f"{town}\nKreis Auental")
    _houses(draft)
    draft.walk(15.0, 90.0, 4)
    draft.straight(100.0)


def _houses(draft: Draft, parked: float = 5.0) -> None:
    draft.stretch("urban", "houses", pavement=True, lamps=True, parked=parked)


def _town(draft: Draft) -> None:
    draft.stretch("urban", "town", pavement=True, lamps=True)


def school(draft: Draft) -> None:
    """30 at a school, with people at the kerb, one of whom steps out."""
    _houses(draft, 6.0)
    draft.sign(40.0, "children", "limit:30")
    draft.walk(60.0, 210.0, 6)
    draft.walk(120.0, 138.0, 2, side="far", mode="waiting")
    draft.cross(draft.chance.uniform(120.0, 160.0), walk_mps=1.5, when_ego_within_m=32.0, hazard=True)
    draft.sign(200.0, "limit_end:30")
    draft.straight(230.0)


def lights(draft: Draft) -> None:
    """Lights that turn red on approach, with people who cross before them."""
    _town(draft)
    at_m = draft.chance.uniform(80.0, 120.0)
    draft.lights.append(LightPlan(at_m=draft.at_m + at_m, red_on_approach_m=62.0, red_s=9.0, green_s=22.0))
    draft.cross(at_m + 5.0, side="far", waits_for_light=True)
    draft.cross(at_m + 6.0, walk_mps=1.2, waits_for_light=True)
    draft.walk(at_m - 20.0, at_m + 70.0, 4)
    draft.straight(at_m + 90.0)


def zone(draft: Draft) -> None:
    """A 30 zone with a bend; a car from the right has priority."""
    _houses(draft)
    draft.sign(20.0, "zone:30", side="both")
    draft.walk(40.0, 110.0, 4)
    draft.give_way(110.0, 30.0, from_side="right")
    draft.straight(160.0)
    draft.bend(90.0, draft.chance.uniform(20.0, 30.0))
    draft.straight(60.0)
    draft.sign(0.0, "zone_end:30")
    draft.straight(40.0)


def right_before_left(draft: Draft) -> None:
    """Two junctions without signs at 50: at the first a car comes from the right, at the second no car."""
    _houses(draft, 3.0)
    draft.give_way(120.0, 50.0, from_side="right")
    draft.yields.append(YieldPlan(at_m=draft.at_m + 205.0))
    draft.straight(260.0)


def give_way(draft: Draft) -> None:
    """A give-way sign; a car comes."""
    _houses(draft, 3.0)
    side = draft.chance.choice(("right", "left"))
    draft.give_way(120.0, 50.0, from_side="right" if side == "right" else "left", sign=True)
    draft.straight(220.0)


def stop_sign(draft: Draft) -> None:
    """A stop sign at a side road with right of way."""
    _houses(draft, 3.0)
    draft.stops.append(StopPlan(at_m=draft.at_m + 110.0))
    draft.walk(20.0, 80.0, 3)
    draft.straight(190.0)


def zebra(draft: Draft) -> None:
    """A pedestrian crossing with a person on it."""
    _town(draft)
    draft.zebras.append(ZebraPlan(at_m=draft.at_m + 110.0))
    draft.cross(110.0, when_ego_within_m=60.0)
    draft.walk(30.0, 200.0, 5)
    draft.straight(210.0)


def steps_out(draft: Draft) -> None:
    """A person who steps out between parked cars at 50."""
    _houses(draft, 6.0)
    side = draft.chance.choice(("near", "far"))
    draft.cross(draft.chance.uniform(110.0, 150.0), side=side, walk_mps=1.5, when_ego_within_m=48.0, hazard=True)
    draft.walk(20.0, 180.0, 5)
    draft.straight(200.0)


def blind_bend(draft: Draft) -> None:
    """A vehicle stands behind a bend that houses hide."""
    _houses(draft, 0.0)
    draft.straight(60.0)
    draft.bend(draft.chance.choice((60.0, 70.0, 80.0)), draft.chance.uniform(45.0, 60.0))
    draft.stands(draft.chance.uniform(0.0, 12.0), kind="van")
    draft.straight(110.0)


BLOCKS: tuple[Block, ...] = (
    school, lights, zone, blind_bend, stop_sign, steps_out, right_before_left, zebra, give_way,
)  # fmt: skip

"""dynamic-vsl: a German motorway under gantries, in drizzle and rain. Each function lays one block of the route."""

import math
from collections.abc import Callable
from random import Random

from evaluation.scenarios.draft import Draft
from services.simulator.scenario.plan import GantryPlan, LaneChangePlan, PanelStep, QueuePlan, Scenario, WaterPlan

LANES, EGO_LANE = 3, 1
START_KMH = 112.0
Block = Callable[[Draft], None]


def lay(chance: Random, name: str, turn: int) -> Scenario:
    """The layout; `turn` counts within a split and deals the hazards out."""
    draft = Draft(chance)
    draft.stretch("motorway", "fields")
    FIRST[turn % len(FIRST)](draft)
    for block in _later(chance, turn):
        draft.stretch("motorway", chance.choice(("fields", "forest")))
        block(draft)
    _end(draft)
    about = f"A German motorway of {draft.at_m / 1000:.1f} km under {len(draft.gantries)} gantries."
    road = {"lanes": LANES, "lane_width_m": 3.6, "median_m": 4.0}
    return draft.scenario(name=name, about=about, country="DEU", speed_kmh=START_KMH, road=road, ego={"lane": EGO_LANE})


def _later(chance: Random, turn: int) -> list[Block]:
    """Two that are this layout's turn and one more, in any order."""
    own = [BLOCKS[turn % len(BLOCKS)], BLOCKS[(turn + 2) % len(BLOCKS)]]
    chosen = own + chance.sample([block for block in BLOCKS if block not in own], 1)
    chance.shuffle(chosen)
    return chosen


# Road and gantries -----------------------------------------------------------------------------------------------------


def _course(draft: Draft, length_m: float) -> None:
    """A straight, a wide bend, a straight."""
    end_m = draft.at_m + length_m
    draft.straight(draft.chance.uniform(0.2, 0.4) * length_m)
    radius_m, degrees = draft.chance.choice((1500.0, 1800.0, 2200.0)), draft.chance.uniform(4.0, 9.0)
    most_m = end_m - draft.at_m - LEAST_STRAIGHT_M
    draft.bend(radius_m, min(degrees, math.degrees(most_m / radius_m)))
    draft.straight(end_m - draft.at_m)


LEAST_STRAIGHT_M = 1.0
"""A bend that is as long as its block leaves so much."""


def _gantry(draft: Draft, ahead_m: float, *steps: tuple[float, int], lanes: tuple[str, ...] = ()) -> None:
    panels = tuple(PanelStep(at_s=at_s, code=f"led:{limit}", lanes=lanes) for at_s, limit in steps)
    draft.gantries.append(GantryPlan(at_m=draft.at_m + ahead_m, steps=panels))


def _arrives_s(draft: Draft, ahead_m: float) -> float:
    """About when the ego comes by."""
    return round((draft.at_m + ahead_m) / 27.0, 1)


# First blocks: what needs to know where the ego is -----------------------------------------------------------------------


def cut_in(draft: Draft) -> None:
    """A vehicle beside the ego cuts in and is slower."""
    _gantry(draft, 330.0, (0.0, 120))
    at_m = round(draft.chance.uniform(480.0, 820.0))
    lane, then_kmh, gap_m = draft.chance.choice(((0, 90.0, 28.5), (2, 84.0, 35.0), (2, 90.0, 28.5)))
    change = LaneChangePlan(
        to_lane=EGO_LANE, when_ego_at_m=at_m, paces_m=gap_m + 36.0, then_kmh=then_kmh, at_gap_m=gap_m, hazard=True
    )
    draft.vehicle(gap_m + 50.0, lane=lane, speed_kmh=START_KMH, heeds_limits=False, lane_change=change)
    _course(draft, 1000.0)


def cut_out(draft: Draft) -> None:
    """A lorry ahead leaves the lane and lays bare a car that stands in it."""
    _gantry(draft, 330.0, (0.0, 100))
    at_m = round(draft.chance.uniform(620.0, 760.0))
    change = LaneChangePlan(to_lane=2, when_ego_at_m=at_m)
    draft.vehicle(100.0, kind="lorry", lane=EGO_LANE, speed_kmh=82.0, keeps_kmh=82.0, lane_change=change)
    draft.stands(at_m + 170.0, lane=EGO_LANE, kind="saloon")
    _course(draft, 1100.0)


def free(draft: Draft) -> None:
    """Gantries that go down while one comes to them."""
    _gantry(draft, 330.0, (0.0, 120))
    draft.sign(520.0, "limit:100", "plate:when_wet:de", side="both")
    _gantry(draft, 800.0, (0.0, 120), (_arrives_s(draft, 640.0), 100))
    _course(draft, 950.0)


FIRST: tuple[Block, ...] = (cut_in, cut_out, free, cut_in)


# Later blocks ------------------------------------------------------------------------------------------------------------


def congestion(draft: Draft) -> None:
    """Down to 80, and behind the second gantry the tail of a congestion."""
    _gantry(draft, 150.0, (0.0, 100))
    behind_m = draft.chance.uniform(180.0, 320.0)
    _gantry(draft, 550.0, (0.0, 100), (_arrives_s(draft, 200.0), 80))
    tail_m = draft.at_m + 550.0 + behind_m
    dissolves_s = tail_m / 20.0 + 25.0
    rows = draft.chance.randint(3, 5)
    draft.queues.append(QueuePlan(tail_m=tail_m, rows=rows, spacing_m=15.0, speed_kmh=8.0, dissolves_s=dissolves_s))
    _course(draft, 1250.0)


def lane_closed(draft: Draft) -> None:
    """Signals over the lanes: one beside the ego's is closed, behind it all are open."""
    shut = draft.chance.choice(("left", "right"))
    closed = ("led:lane_closed", "", "") if shut == "left" else ("", "", "led:lane_closed")
    opened = ("led:lane_open", "", "") if shut == "left" else ("", "", "led:lane_open")
    _gantry(draft, 120.0, (0.0, 100))
    _gantry(draft, 450.0, (0.0, 80), lanes=closed)
    _gantry(draft, 850.0, (0.0, 100), lanes=opened)
    _course(draft, 950.0)


def works(draft: Draft) -> None:
    """Signs at the road alone: roadworks, 100, 80, and the end of all."""
    draft.gantries.append(
        GantryPlan(at_m=draft.at_m + 80.0, steps=(PanelStep(at_s=0.0, code="led:end"),), follow_traffic=False)
    )
    draft.sign(200.0, "roadworks", side="both")
    draft.sign(300.0, "limit:100", side="both")
    draft.sign(500.0, "limit:80", "no_overtaking", "plate:lorries", side="both")
    draft.sign(800.0, "all_end", side="both")
    _course(draft, 950.0)


def standing_water(draft: Draft) -> None:
    """A limit when wet, and behind it ruts in which the rain stands."""
    _gantry(draft, 100.0, (0.0, 120))
    draft.sign(300.0, "slippery", "limit:80", "plate:when_wet:de", side="both")
    from_m = draft.at_m + draft.chance.uniform(520.0, 600.0)
    film_mm = round(draft.chance.uniform(1.6, 2.0), 2)
    draft.water.append(WaterPlan(from_m=from_m, to_m=from_m + draft.chance.uniform(60.0, 120.0), film_mm=film_mm))
    draft.sign(760.0, "all_end", side="both")
    _course(draft, 900.0)


def lorries_only(draft: Draft) -> None:
    """What holds for lorries alone, and a gantry that holds for all."""
    draft.sign(150.0, "no_overtaking", "plate:lorries", side="both")
    draft.sign(350.0, "limit:80", "plate:lorries", side="both")
    _gantry(draft, 600.0, (0.0, 120), (_arrives_s(draft, 420.0), 100))
    _course(draft, 900.0)


BLOCKS: tuple[Block, ...] = (congestion, lane_closed, standing_water, works, lorries_only)


def _end(draft: Draft) -> None:
    """The gantry lifts its limit."""
    draft.stretch("motorway", "fields")
    draft.gantries.append(
        GantryPlan(at_m=draft.at_m + 150.0, steps=(PanelStep(at_s=0.0, code="led:end"),), follow_traffic=False)
    )
    _course(draft, 500.0)

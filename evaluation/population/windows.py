"""Windows: a generated route begun shortly before one of its hazards, where a driver who does nothing would hit a road user."""

from collections.abc import Iterator
from typing import NamedTuple

import msgspec

from evaluation.campaign.plan import TEST_SEED
from evaluation.scenarios import FAMILIES, Place, generate
from services.simulator.scenario.law import build_law
from services.simulator.scenario.plan import Scenario, VehiclePlan
from services.simulator.world import World

BEFORE_S = 6.0
"""So long before the hazard the drive begins: time to see, to be warned and to brake."""
HITS_WITHIN_S, AFTER_S = 18.0, 6.0
"""Longer a driver who does nothing is not watched; so long after that contact the window ends."""
FASTEST_MPS = 120 / 3.6
LENGTH_M = 5.0


class Window(NamedTuple):
    """The hazard of that ordinal on a place's route."""

    place: Place
    hazard: int

    def __str__(self) -> str:
        return f"{str(self.place).replace('/', '-')}-hazard-{self.hazard}"


def seed_of(place: Place) -> int:
    """The simulator's seed, that of the place's run in the paper's tables."""
    return place.world_seed(TEST_SEED + place.number)


def scenario_of(window: Window) -> Scenario:
    """The route, begun shortly before the window's hazard."""
    return _begun_before(window.place)[window.hazard]


def windows(count: int) -> Iterator[tuple[Window, float]]:
    """So many windows of the test split, family by family in turn, each with when it ends (s)."""
    found, number = 0, 0
    while True:
        for family in FAMILIES:
            place = Place(family, "test", number)
            for hazard, plan in enumerate(_begun_before(place)):
                hit_s = _hit_s(plan, seed_of(place))
                if hit_s is None:
                    continue
                yield Window(place, hazard), round(hit_s + AFTER_S, 2)
                found += 1
                if found == count:
                    return
        number += 1


def _hit_s(scenario: Scenario, seed: int) -> float | None:
    """When a driver who does nothing hits a road user (s); `None`: not within `HITS_WITHIN_S`."""
    world = World(scenario, seed, "absent")
    while world.time_s < HITS_WITHIN_S:
        snapshot = world.step()
        if snapshot.fact.collision:
            return snapshot.time_s
        if snapshot.ended:
            return None
    return None


def _begun_before(place: Place) -> list[Scenario]:
    """The route once for each hazard: people, cars out of side roads, queues, leads that brake, stand or cut in."""
    plan = generate(place.family, place.number, place.split)
    found = [
        _from(plan, crosser.at_m - crosser.when_ego_within_m)
        for crosser in plan.crossers
        if crosser.hazard and crosser.when_ego_within_m is not None
    ]
    found += [_from(plan, line.at_m - car.when_ego_within_m) for line in plan.yields for car in line.cars]
    found += [_from(plan, queue.tail_m - 2.0 * BEFORE_S * _speed_mps(plan, queue.tail_m)) for queue in plan.queues]
    for ordinal, vehicle in enumerate(plan.vehicles):
        found += _before_vehicle(plan, ordinal, vehicle)
    return found


def _before_vehicle(plan: Scenario, ordinal: int, vehicle: VehiclePlan) -> list[Scenario]:
    """What stands is come to; of what moves the part is brought forward, together with the ego."""
    halts = [halt for halt in vehicle.halts if halt.hazard]
    change = vehicle.lane_change
    if vehicle.stands_s is not None:
        return [_from(plan, vehicle.at_m - LENGTH_M - _speed_mps(plan, vehicle.at_m))]
    if halts:
        by_m = halts[0].at_m - vehicle.at_m - BEFORE_S * vehicle.speed_kmh / 3.6
    elif change is not None and change.hazard:
        by_m = change.when_ego_at_m - plan.ego.at_m - BEFORE_S * plan.ego.speed_kmh / 3.6
    else:
        return []
    by_m = max(0.0, by_m)
    moved = msgspec.structs.replace(vehicle, at_m=vehicle.at_m + by_m)
    vehicles = (*plan.vehicles[:ordinal], moved, *plan.vehicles[ordinal + 1 :])
    ego = msgspec.structs.replace(plan.ego, at_m=plan.ego.at_m + by_m)
    return [msgspec.structs.replace(plan, vehicles=vehicles, ego=ego)]


def _from(plan: Scenario, trigger_m: float) -> Scenario:
    """Begun so that the ego's front comes to `trigger_m` after `BEFORE_S`, at the limit there."""
    speed_mps = _speed_mps(plan, trigger_m)
    at_m = max(plan.ego.at_m, trigger_m - LENGTH_M / 2.0 - BEFORE_S * speed_mps)
    ego = msgspec.structs.replace(plan.ego, at_m=round(at_m, 2), speed_kmh=round(speed_mps * 3.6, 1))
    return msgspec.structs.replace(plan, ego=ego)


def _speed_mps(plan: Scenario, at_m: float) -> float:
    return min(FASTEST_MPS, build_law(plan).at(at_m, {}).limit_mps(False) or FASTEST_MPS)

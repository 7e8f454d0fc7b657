"""Scenery beside the road: trees, houses, lamps, posts; and parked cars. All drawn from the seed."""

import math
from collections.abc import Callable, Iterator

import numpy as np

from services.simulator.road.layout import PAVEMENT_M
from services.simulator.road.route import PARKING_M, Route
from services.simulator.scenario.plan import PlacedPlan, StretchPlan, Surroundings
from services.simulator.scene.scene import Actor, ActorKind, Scenery, SceneryKind
from services.simulator.traffic.cars import body

PARKED_IDS = 700
LAMP_EVERY_M, POST_EVERY_M = 36.0, 50.0
CLEAR_OF_JUNCTION_M = 7.0
SIGHT_BEFORE_SIGN_M = 70.0
OPEN_CORNER_M = 55.0
"""Nothing is built or parked so far before a junction where one gives way: a driver must be able to see the cars that come."""
PARKED_KINDS: tuple[ActorKind, ...] = ("saloon", "estate", "saloon", "van")
Chance = np.random.Generator


def build_scenery(route: Route, seed: int) -> tuple[Scenery, ...]:
    """Everything beside the road, stretch by stretch."""
    things: list[Scenery] = []
    for index, (stretch, start, end) in enumerate(route.stretch_ends()):
        chance = np.random.default_rng([seed, 31, index])
        things += _SURROUNDINGS[stretch.surroundings](route, start, end, chance)
        things += _lamps(route, start, end) if stretch.lamps else []
        things += _delineators(route, start, end) if stretch.road_class != "urban" else []
    return tuple(thing for thing in things if _clear(route, thing))


def build_parked(route: Route, seed: int) -> tuple[Actor, ...]:
    """Cars at the near kerb and some at the far one."""
    chance = np.random.default_rng([seed, 32])
    cars: list[Actor] = []
    for stretch, start, end in route.stretch_ends():
        for s in _parking_places(route, stretch, start, end, chance):
            side = route.near(s) * (1.0 if chance.random() < 0.65 else -1.0)
            cars.append(_parked(route, s, side, PARKED_IDS + len(cars), chance))
    return tuple(cars)


def _parking_places(route: Route, stretch: StretchPlan, start: float, end: float, chance: Chance) -> Iterator[float]:
    if stretch.parked <= 0:
        return
    s = start + 8.0
    while s < end - 8.0:
        if not route.at_junction(s, 14.0) and not _kept_free(route, s):
            yield s
        s += max(7.5, float(chance.exponential(100.0 / stretch.parked)))


def _kept_free(route: Route, s_m: float) -> bool:
    """No parking before lights, crossings and signs, nor where a person will step out (drivers must be able to see the person)."""
    plan = route.scenario
    lines: tuple[PlacedPlan, ...] = (*plan.lights, *plan.stops, *plan.zebras)
    places = [(line.at_m, 22.0) for line in lines] + [(each.at_m, OPEN_CORNER_M) for each in plan.yields]
    places += [(each.at_m, 11.0) for each in plan.crossers] + [(sign.at_m, 12.0) for sign in plan.signs]
    return any(-5.0 <= at_m - s_m <= free for at_m, free in places)


def _parked(route: Route, s_m: float, side: float, number: int, chance: Chance) -> Actor:
    kind = PARKED_KINDS[int(chance.integers(len(PARKED_KINDS)))]
    shape = body(kind, int(chance.integers(1, 10_000)))
    d = side * (route.reach_m(s_m) + PARKING_M / 2 + 0.05)
    turn = 0.0 if side == route.near(s_m) else math.pi
    return Actor(
        id=number,
        kind=kind,
        pose=route.pose(s_m, d, turn),
        length_m=shape.length_m,
        width_m=shape.width_m,
        height_m=shape.height_m,
        look_seed=shape.look_seed,
        mesh_family=shape.mesh_family,
    )


# Surroundings ----------------------------------------------------------------------------------------------------------


def _scatter(
    route: Route, span: tuple[float, float], per_100_m: float, out_m: tuple[float, float], chance: Chance
) -> Iterator[tuple[float, float]]:
    """Places at random on both sides, `out_m` beyond the kerb."""
    for _ in range(round((span[1] - span[0]) / 100.0 * per_100_m)):
        s = float(chance.uniform(*span))
        yield s, float(chance.choice([-1.0, 1.0])) * (route.kerb_m(s) + float(chance.uniform(*out_m)))


def _thing(
    route: Route, kind: SceneryKind, s_m: float, d_m: float, turn_rad: float, chance: Chance, height_m: float = 0.0
) -> Scenery:
    look = int(chance.integers(1, 10_000))
    return Scenery(kind=kind, pose=route.pose(s_m, d_m, turn_rad), height_m=height_m, look_seed=look)


def _fields(route: Route, start: float, end: float, chance: Chance) -> list[Scenery]:
    span = (start, end)
    trees = [_thing(route, "tree", s, d, 0.0, chance) for s, d in _scatter(route, span, 4.0, (5.0, 60.0), chance)]
    hedges = [_thing(route, "hedge", s, d, 0.0, chance) for s, d in _scatter(route, span, 1.2, (4.0, 14.0), chance)]
    return trees + hedges + _row(route, span, chance, "house", (120.0, 260.0), (30.0, 70.0))


def _forest(route: Route, start: float, end: float, chance: Chance) -> list[Scenery]:
    span = (start, end)
    conifers = [_thing(route, "conifer", s, d, 0.0, chance) for s, d in _scatter(route, span, 9.0, (5.0, 26.0), chance)]
    return conifers + [
        _thing(route, "tree", s, d, 0.0, chance) for s, d in _scatter(route, span, 5.0, (4.5, 22.0), chance)
    ]


def _houses(route: Route, start: float, end: float, chance: Chance) -> list[Scenery]:
    houses = _row(route, (start, end), chance, "house", (17.0, 26.0), (PAVEMENT_M + 7.0, PAVEMENT_M + 11.0))
    places = _scatter(route, (start, end), 3.0, (PAVEMENT_M + 1.0, PAVEMENT_M + 3.0), chance)
    return houses + [_thing(route, "tree", s, d, 0.0, chance, height_m=5.0) for s, d in places]


def _town(route: Route, start: float, end: float, chance: Chance) -> list[Scenery]:
    towers = _row(route, (start, end), chance, "tower", (24.0, 34.0), (PAVEMENT_M + 9.0, PAVEMENT_M + 13.0))
    places = _scatter(route, (start, end), 1.5, (PAVEMENT_M - 0.6, PAVEMENT_M - 0.2), chance)
    return towers + [_thing(route, "tree", s, d, 0.0, chance, height_m=6.0) for s, d in places]


def _harbour(route: Route, start: float, end: float, chance: Chance) -> list[Scenery]:
    return _row(route, (start, end), chance, "tower", (50.0, 90.0), (24.0, 50.0))


def _row(
    route: Route,
    span: tuple[float, float],
    chance: Chance,
    kind: SceneryKind,
    every_m: tuple[float, float],
    out_m: tuple[float, float],
) -> list[Scenery]:
    """Buildings in a row on both sides, fronts to the road."""
    buildings = []
    for side in (1.0, -1.0):
        s = span[0] + float(chance.uniform(0.0, every_m[0]))
        while s < span[1]:
            d = side * (route.kerb_m(s) + float(chance.uniform(*out_m)))
            buildings.append(_thing(route, kind, s, d, -side * math.pi / 2, chance))
            s += float(chance.uniform(*every_m))
    return buildings


_SURROUNDINGS: dict[Surroundings, Callable[[Route, float, float, Chance], list[Scenery]]] = {
    "fields": _fields,
    "forest": _forest,
    "houses": _houses,
    "town": _town,
    "harbour": _harbour,
}


def _lamps(route: Route, start: float, end: float) -> list[Scenery]:
    places = np.arange(start + 10.0, end, LAMP_EVERY_M)
    sides = [(1.0, -1.0)[index % 2] for index in range(len(places))]
    return [
        Scenery(
            kind="lamp",
            pose=route.pose(float(s), side * (route.kerb_m(float(s)) + 0.8), -side * math.pi / 2),
            look_seed=1,
        )
        for s, side in zip(places, sides, strict=True)
    ]


def _delineators(route: Route, start: float, end: float) -> list[Scenery]:
    return [
        Scenery(kind="post", pose=route.pose(float(s), side * (route.kerb_m(float(s)) + 0.7)), look_seed=1)
        for s in np.arange(start + 15.0, end, POST_EVERY_M)
        for side in (1.0, -1.0)
    ]


def _clear(route: Route, thing: Scenery) -> bool:
    """Not in a side road, and not on another part of the road that bends this way."""
    s, d = route.section.spine.project(thing.pose.x_m, thing.pose.y_m)
    deep = {"house": 4.0, "tower": 6.0}.get(thing.kind, 0.4)
    margin = CLEAR_OF_JUNCTION_M if thing.kind in ("house", "tower") else 1.0
    on_the_road = abs(d) <= route.kerb_m(s) + deep * 0.9
    if thing.kind in ("house", "tower") and any(-5.0 < each.at_m - s < OPEN_CORNER_M for each in route.scenario.yields):
        return False
    return not on_the_road and not route.at_junction(s, margin + deep) and not _hides_a_sign(route, thing, s, d)


def _hides_a_sign(route: Route, thing: Scenery, s_m: float, d_m: float) -> bool:
    """Whether leaves would stand between a sign and the drivers that come towards it, which no road keeper allows."""
    plan, crown = route.scenario, {"tree": 4.5, "conifer": 4.0, "hedge": 1.5}.get(thing.kind)
    if crown is None or abs(d_m) > route.kerb_m(s_m) + crown:
        return False
    kept: tuple[PlacedPlan, ...] = (*plan.signs, *plan.stops, *plan.yields, *plan.zebras, *plan.lights)
    return any(-4.0 < each.at_m - s_m < SIGHT_BEFORE_SIGN_M for each in kept)

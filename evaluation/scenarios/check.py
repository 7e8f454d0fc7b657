"""Whether a generated scenario is sane: lawful all along, consistent in its signs, and every hazard avoidable.

Pure and fast; the same rules for all families. What it cannot know (does a driver get through?) a drive shows.
"""

import itertools
import math
from collections.abc import Callable, Iterator

import numpy as np

from evaluation.scenarios.reach import HEADWAY_S, behind_m, sight_in_bend_m, stop_m
from services.simulator.car.tyres import aquaplaning_mps
from services.simulator.road.route import Route
from services.simulator.scenario.law import Law, Post, build_law
from services.simulator.scenario.load import complaints
from services.simulator.scenario.plan import PlacedPlan, Scenario

LEAST_M = 2000.0
EVERY_M = 10.0
UNLIMITED_MPS = 130 / 3.6
"""What is taken for the speed where no law limits it."""
LINE_SEEN_M, QUEUE_SEEN_M = 90.0, 200.0
HARDEST_MPS2 = 4.5
"""To come down to a posted limit from where its sign can be read."""
SIGN_READ_M = 80.0
APART_M, POSTS_APART_M = 70.0, 12.0
HOUSES_BESIDE_M = 6.7
"""From the middle of the outer lane to the nearest house front on the inner side of a bend to the near side."""
CUT_IN_S = 0.7
"""From the beginning of a change of lane until it shows in the ego's way."""
LANE_CHANGE_M = 75.0
"""What a lorry needs to leave its lane."""
_NUMBERED_ENDS = {"limit_end": "limit", "zone_end": "zone"}


def faults(scenario: Scenario) -> Iterator[str]:
    """What is wrong with a scenario, one line each; nothing if it is sane."""
    route, law = Route(scenario), build_law(scenario)
    yield from (f"{field}: {reason}" for field, reason in complaints(scenario))
    for rule in _RULES:
        yield from rule(scenario, route, law)


def limit_mps(scenario: Scenario, law: Law, at_m: float, wet: bool = False) -> float:
    """The highest limit that can be in force at a place: gantries at the most they show."""
    highest = {number: _highest([step.code for step in plan.steps]) for number, plan in enumerate(scenario.gantries)}
    limit = law.at(at_m, highest).limit_mps(wet)
    return UNLIMITED_MPS if limit is None else limit


def _highest(codes: list[str]) -> str:
    return max(codes, key=lambda code: math.inf if code == "led:end" else float(code.removeprefix("led:")))


# The route and its law -------------------------------------------------------------------------------------------------


def _long_enough(scenario: Scenario, route: Route, law: Law) -> Iterator[str]:
    if scenario.length_m < LEAST_M:
        yield f"only {scenario.length_m:.0f} m long"


def _never_meets_itself(scenario: Scenario, route: Route, law: Law) -> Iterator[str]:
    spine = route.section.spine
    places = np.stack([spine.x_m, spine.y_m], axis=1)[::20]
    apart = np.hypot(*(places[:, None, :] - places[None, :, :]).transpose(2, 0, 1))
    along = np.abs(np.subtract.outer(np.arange(len(places)), np.arange(len(places)))) * 20.0
    if (apart[along > 200.0] < APART_M).any():
        yield "the route comes near itself"


def _law_is_known(scenario: Scenario, route: Route, law: Law) -> Iterator[str]:
    for at_m in np.arange(0.0, route.length_m, EVERY_M):
        legal, stretch = law.at(float(at_m), {}), route.stretch_at(float(at_m))
        free = legal.country == "DEU" and legal.road_class == "motorway"
        if legal.limit_mps(False) is None and not free:
            yield f"{at_m:.0f} m: no limit in force"
        if (
            stretch.road_class == "urban"
            and limit_mps(scenario, law, float(at_m)) > 52 / 3.6
            and at_m > stretch.from_m + 5
        ):
            yield f"{at_m:.0f} m: houses, and faster than a town's limit"


def _limits_can_be_kept(scenario: Scenario, route: Route, law: Law) -> Iterator[str]:
    """From each limit to the next with no more than firm braking; what holds when wet, too."""
    for post in law.posts:
        before, after = (limit_mps(scenario, law, post.at_m + step) for step in (-0.1, 0.1))
        needed = (min(before, _wanted(scenario)) ** 2 - after**2) / (2.0 * SIGN_READ_M)
        if needed > HARDEST_MPS2:
            yield f"{post.at_m:.0f} m: from {before * 3.6:.0f} to {after * 3.6:.0f} km/h at once"


def _wanted(scenario: Scenario) -> float:
    return UNLIMITED_MPS if scenario.road.median_m > 0 else 100 / 3.6


# Signs ---------------------------------------------------------------------------------------------------------------------


def _ends_end_something(scenario: Scenario, route: Route, law: Law) -> Iterator[str]:
    for post in law.posts:
        for code in post.codes:
            word, _, number = code.partition(":")
            before = [earlier for earlier in law.posts if earlier.at_m < post.at_m]
            if word in _NUMBERED_ENDS and f"{_NUMBERED_ENDS[word]}:{number}" not in _last(before, _NUMBERED_ENDS[word]):
                yield f"{post.at_m:.0f} m: {code} ends nothing"
            if word == "town_exit" and not any("town_entry" in earlier.codes for earlier in before):
                yield f"{post.at_m:.0f} m: a town ends that never began"
            if word == "zone" and _open(before, "zone", "zone_end"):
                yield f"{post.at_m:.0f} m: a zone within a zone"


def _last(posts: list[Post], word: str) -> tuple[str, ...]:
    """The codes of the last post with that word and without a plate."""
    found = [each for each in posts if any(code.startswith(f"{word}:") for code in each.codes)]
    return found[-1].codes if found else ()


def _open(posts: list[Post], begins: str, ends: str) -> bool:
    words = [code.partition(":")[0] for post in posts for code in post.codes]
    return words.count(begins) > words.count(ends)


def _posts_stand_apart(scenario: Scenario, route: Route, law: Law) -> Iterator[str]:
    for one, other in itertools.pairwise(sorted(scenario.signs, key=lambda sign: sign.at_m)):
        if other.at_m - one.at_m < POSTS_APART_M:
            yield f"{other.at_m:.0f} m: {other.codes} stands too near {one.codes}"
    for sign in scenario.signs:
        if route.at_junction(sign.at_m):
            yield f"{sign.at_m:.0f} m: {sign.codes} stands in a side road"


def _conditions_say_less(scenario: Scenario, route: Route, law: Law) -> Iterator[str]:
    """A limit when wet is below what holds when dry."""
    for post in law.posts:
        conditional = any(code.startswith("plate:when_wet") for code in post.codes)
        if conditional and limit_mps(scenario, law, post.at_m, wet=True) >= limit_mps(scenario, law, post.at_m):
            yield f"{post.at_m:.0f} m: {post.codes} asks for nothing more when wet"


def _places_are_free(scenario: Scenario, route: Route, law: Law) -> Iterator[str]:
    """Lines and crossings keep apart; nothing lies within the last metres."""
    groups: tuple[tuple[PlacedPlan, ...], ...] = (scenario.lights, scenario.stops, scenario.yields, scenario.zebras)
    places = sorted(each.at_m for group in groups for each in group)
    for one, other in itertools.pairwise(places):
        if other - one < 60.0:
            yield f"{other:.0f} m: {other - one:.0f} m behind another line or crossing"
    for at_m in places:
        if at_m > route.length_m - 120.0:
            yield f"{at_m:.0f} m: too near the end"
        if _curvature(route, at_m) > 1e-6:
            yield f"{at_m:.0f} m: a line or crossing in a bend"


def _curvature(route: Route, at_m: float) -> float:
    return float(np.interp(at_m, route.section.spine.s_m, np.abs(route.section.spine.curvature)))


# Hazards -----------------------------------------------------------------------------------------------------------------


def _people_can_be_spared(scenario: Scenario, route: Route, law: Law) -> Iterator[str]:
    for each in scenario.crossers:
        need = stop_m(limit_mps(scenario, law, each.at_m))
        if each.when_ego_within_m is not None and each.when_ego_within_m < need:
            yield f"{each.at_m:.0f} m: steps out {each.when_ego_within_m:.0f} m ahead, {need:.0f} m are needed"


def _lines_can_be_kept(scenario: Scenario, route: Route, law: Law) -> Iterator[str]:
    for each in (*scenario.lights, *scenario.stops, *scenario.yields):
        need = stop_m(limit_mps(scenario, law, each.at_m))
        if need > LINE_SEEN_M:
            yield f"{each.at_m:.0f} m: a line is seen {LINE_SEEN_M:.0f} m ahead, {need:.0f} m are needed"


def _vehicles_can_be_spared(scenario: Scenario, route: Route, law: Law) -> Iterator[str]:
    for each in scenario.vehicles:
        for halt in each.halts:
            speed = min((each.keeps_kmh or 130.0) / 3.6, UNLIMITED_MPS)
            if behind_m(speed, halt.brake_mps2) > HEADWAY_S * speed:
                yield f"{halt.at_m:.0f} m: brakes too hard for one who follows"
        change = each.lane_change
        if change is not None and change.hazard and change.then_kmh is not None:
            closing = max(0.0, limit_mps(scenario, law, change.when_ego_at_m) - change.then_kmh / 3.6)
            gap = (change.at_gap_m or change.paces_m or 0.0) - CUT_IN_S * closing
            if stop_m(closing) > gap:
                yield f"{change.when_ego_at_m:.0f} m: cuts in {gap:.0f} m ahead, {stop_m(closing):.0f} m are needed"
        if each.stands_s is not None:
            yield from _can_stop_behind(scenario, route, law, each.at_m)


def _can_stop_behind(scenario: Scenario, route: Route, law: Law, at_m: float) -> Iterator[str]:
    """Sight to a vehicle that stands: along the bend before it, or from where the lorry ahead has left the lane."""
    bare = [each for each in scenario.vehicles if each.lane_change is not None and not each.lane_change.hazard]
    before = [float(1.0 / radius) for back in range(0, 40, 5) if (radius := _curvature(route, at_m - back)) > 1e-6]
    if bare:
        change, speed = bare[0].lane_change, (bare[0].keeps_kmh or 0.0) / 3.6
        sight = at_m - (change.when_ego_at_m if change else 0.0) - LANE_CHANGE_M / 2
    elif before:
        speed = min(limit_mps(scenario, law, at_m), math.sqrt(2.2 * before[0]))
        sight = sight_in_bend_m(before[0], HOUSES_BESIDE_M)
    else:
        speed, sight = limit_mps(scenario, law, at_m), LINE_SEEN_M
    if stop_m(speed) > sight:
        yield f"{at_m:.0f} m: stands {sight:.0f} m within sight, {stop_m(speed):.0f} m are needed"


def _queues_can_be_met(scenario: Scenario, route: Route, law: Law) -> Iterator[str]:
    for queue in scenario.queues:
        sight = min([QUEUE_SEEN_M, *(key.visibility_m for key in scenario.weather)])
        speed = limit_mps(scenario, law, queue.tail_m)
        if stop_m(speed) > sight:
            yield f"{queue.tail_m:.0f} m: a queue {sight:.0f} m within sight, {stop_m(speed):.0f} m are needed"
        if not any(0.0 < queue.tail_m - gantry.at_m < 600.0 for gantry in scenario.gantries):
            yield f"{queue.tail_m:.0f} m: a queue behind no gantry"


def _water_can_be_kept_out_of(scenario: Scenario, route: Route, law: Law) -> Iterator[str]:
    for water in scenario.water:
        legal = limit_mps(scenario, law, water.from_m, wet=True)
        if aquaplaning_mps(water.film_mm) < legal:
            yield f"{water.from_m:.0f} m: one floats on {water.film_mm} mm below the limit when wet"
        if not any(0.0 < water.from_m - sign.at_m < 400.0 for sign in scenario.signs if "slippery" in sign.codes):
            yield f"{water.from_m:.0f} m: water without a sign"


Rule = Callable[[Scenario, Route, Law], Iterator[str]]
_RULES: tuple[Rule, ...] = (
    _long_enough,
    _never_meets_itself,
    _law_is_known,
    _limits_can_be_kept,
    _ends_end_something,
    _posts_stand_apart,
    _conditions_say_less,
    _places_are_free,
    _people_can_be_spared,
    _lines_can_be_kept,
    _vehicles_can_be_spared,
    _queues_can_be_met,
    _water_can_be_kept_out_of,
)

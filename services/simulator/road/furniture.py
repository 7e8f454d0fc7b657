"""Road furniture for drivers: sign posts, gantries and traffic lights, on the side on which one drives."""

import math
from collections.abc import Iterator

from services.simulator.road.layout import opposite_line_m
from services.simulator.road.route import Route
from services.simulator.scenario.load import country_at, sign_country
from services.simulator.scenario.plan import GantryPlan, SignPlan
from services.simulator.scene.scene import Gantry, GantryPanel, SignFace, SignPost, TrafficLight

SIGN_IDS, GANTRY_IDS, PANEL_IDS, LIGHT_IDS = 1000, 2000, 2100, 3000
PANELS_PER_GANTRY = 10
AUX_PANEL = 8
"""Index of the small panel for a danger symbol."""
MOTORWAY_DISC_M = 0.75
POST_FROM_KERB_M = 0.55


def build_signs(route: Route, seed: int) -> tuple[SignPost, ...]:
    """Every post, facing the traffic that drives forward."""
    plans = list(route.scenario.signs)
    plans += [SignPlan(at_m=stop.at_m - 0.5, codes=("stop",)) for stop in route.scenario.stops]
    plans += [SignPlan(at_m=each.at_m - 0.5, codes=("yield",)) for each in route.scenario.yields if each.sign]
    plans += [SignPlan(at_m=zebra.at_m - 2.5, codes=("crossing",), side="both") for zebra in route.scenario.zebras]
    places = [(plan, d) for plan in plans for d in _post_offsets(route, plan)]
    return tuple(_post(route, plan, d, SIGN_IDS + index, seed) for index, (plan, d) in enumerate(places))


def _post_offsets(route: Route, plan: SignPlan) -> Iterator[float]:
    near = route.near(plan.at_m)
    if plan.side in ("near", "both"):
        yield near * (route.kerb_m(plan.at_m) + POST_FROM_KERB_M)
    if plan.side in ("far", "both"):
        median = route.section.median_m
        yield near * (median / 2 - 0.9) if median > 2.0 else -near * (route.kerb_m(plan.at_m) + POST_FROM_KERB_M)


def _post(route: Route, plan: SignPlan, d_m: float, number: int, seed: int) -> SignPost:
    country = sign_country(route.scenario, plan.at_m, plan.country)
    motorway = route.stretch_at(plan.at_m).road_class == "motorway"
    faces = tuple(
        SignFace(
            country=country,
            code=code,
            text=plan.text,
            size_m=MOTORWAY_DISC_M if motorway and code.startswith(("limit", "plate", "all_end")) else 0.0,
            look_seed=1 + (seed * 31 + number) % 97,
        )
        for code in plan.codes
    )
    height = 2.75 if motorway else 2.45
    return SignPost(id=number, pose=route.pose(plan.at_m, d_m, math.pi), faces=faces, height_m=height)


def build_gantries(route: Route) -> tuple[Gantry, ...]:
    """A gantry over the forward lanes, a panel over each and a small one beside for danger symbols."""
    return tuple(_gantry(route, plan, ordinal) for ordinal, plan in enumerate(route.scenario.gantries))


def _gantry(route: Route, plan: GantryPlan, ordinal: int) -> Gantry:
    section, country = route.section, country_at(route.scenario, plan.at_m)
    middle = route.near(plan.at_m) * (section.median_m / 2 + section.lanes * section.lane_width_m / 2)
    code, laterals = plan.steps[0].code, [lane_lateral_m(route, plan.at_m, lane) for lane in range(section.lanes)]
    panels = [
        GantryPanel(id=panel_id(ordinal, lane), lateral_m=lateral_m, country=country, code=code)
        for lane, lateral_m in enumerate(laterals)
    ]
    if section.lanes > 1:
        between = (laterals[0] + laterals[1]) / 2
        panels.append(GantryPanel(id=panel_id(ordinal, AUX_PANEL), lateral_m=between, country=country, size_m=0.9))
    return Gantry(
        id=GANTRY_IDS + ordinal,
        pose=route.pose(plan.at_m, middle, math.pi),
        span_m=section.lanes * section.lane_width_m + 7.0,
        panels=tuple(panels),
    )


def lane_lateral_m(route: Route, s_m: float, lane: int) -> float:
    """Left of the carriageway's middle as the driver sees it; lane 0 is next to the median."""
    section = route.section
    from_median = (lane + 0.5 - section.lanes / 2) * section.lane_width_m
    return from_median * route.near(s_m)


def panel_id(ordinal: int, lane: int) -> int:
    """The id of a gantry's panel over a lane."""
    return PANEL_IDS + ordinal * PANELS_PER_GANTRY + lane


def build_lights(route: Route) -> tuple[TrafficLight, ...]:
    """Per lights: one head at the near side, one beyond the junction, and one for oncoming traffic."""
    heads: list[TrafficLight] = []
    for ordinal, plan in enumerate(route.scenario.lights):
        near, at_m = route.near(plan.at_m - 5.0), plan.at_m
        aside = route.kerb_m(at_m) + 0.6
        back = opposite_line_m(route, at_m)
        poses = (
            route.pose(at_m + 1.0, near * aside, math.pi),
            route.pose(at_m + 1.0, -near * aside, math.pi),
            route.pose(back - 1.0, -route.near(back + 5.0) * (route.kerb_m(back) + 0.6)),
        )
        heads += [TrafficLight(id=light_id(ordinal, head), pose=pose) for head, pose in enumerate(poses)]
    return tuple(heads)


def light_id(ordinal: int, head: int) -> int:
    """The id of a head; 2 is the one for oncoming traffic."""
    return LIGHT_IDS + ordinal * 4 + head

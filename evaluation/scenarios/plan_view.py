"""A scenario's plan: as lines of text in driving order, or seen from above as an SVG."""

from collections.abc import Iterator
from typing import NamedTuple

from evaluation.scenarios.check import limit_mps
from services.simulator.road.route import Route
from services.simulator.scenario.law import build_law
from services.simulator.scenario.load import country_at
from services.simulator.scenario.plan import Scenario

MARGIN_M, EVERY_M = 40.0, 5.0
_COLOURS = {"urban": "#b08968", "rural": "#7a9e7e", "motorway": "#6c8ebf"}


class Thing(NamedTuple):
    """Something on the route: where, what, and how it is drawn (hazards in red)."""

    at_m: float
    what: str
    colour: str


def things(scenario: Scenario) -> list[Thing]:
    """All of them in driving order."""
    return sorted(_things(scenario))


def _things(plan: Scenario) -> Iterator[Thing]:
    for stretch in plan.road.stretches:
        yield Thing(stretch.from_m, f"{stretch.road_class} road, {stretch.surroundings}", "#444")
    for sign in plan.signs:
        yield Thing(sign.at_m, f"sign {' + '.join(sign.codes)}", "#111")
    for gantry in plan.gantries:
        steps = ", ".join(f"{'|'.join(each.lanes) or each.code} from {each.at_s:.0f} s" for each in gantry.steps)
        yield Thing(gantry.at_m, f"gantry {steps}", "#1d4ed8")
    yield from (Thing(each.at_m, "traffic lights", "#b45309") for each in plan.lights)
    yield from (Thing(each.at_m, "stop sign", "#b45309") for each in plan.stops)
    yield from (Thing(each.at_m, "zebra crossing", "#b45309") for each in plan.zebras)
    for junction in plan.yields:
        comes = ", ".join(f"a car from the {car.from_side}" for car in junction.cars) or "no car comes"
        rule = "give-way sign" if junction.sign else "priority to the right"
        yield Thing(junction.at_m, f"{rule}: {comes}", "#c00" if junction.cars else "#b45309")
    yield from _hazards(plan)


def _hazards(plan: Scenario) -> Iterator[Thing]:
    for each in plan.crossers:
        if each.hazard:
            yield Thing(each.at_m, f"pedestrian steps out {each.when_ego_within_m:.0f} m ahead", "#c00")
    for car in plan.vehicles:
        yield from (Thing(halt.at_m, f"{car.kind} ahead brakes to a halt", "#c00") for halt in car.halts if halt.hazard)
        if car.stands_s is not None:
            yield Thing(car.at_m, f"{car.kind} stands in the lane", "#c00")
        if car.lane_change is not None:
            does = "cuts in" if car.lane_change.hazard else "leaves the lane"
            yield Thing(car.lane_change.when_ego_at_m, f"{car.kind} {does}", "#c00")
    yield from (Thing(each.tail_m, "tail of a congestion", "#c00") for each in plan.queues)
    yield from (
        Thing(each.from_m, f"{each.film_mm} mm of water for {each.to_m - each.from_m:.0f} m", "#c00")
        for each in plan.water
    )


def as_text(scenario: Scenario) -> str:
    """One line a thing: place, country, the limit behind it when dry (gantries at their highest), what it is; hazards
    are marked.
    """
    law, first = build_law(scenario), scenario.weather[0]
    night = "night" if scenario.daylight.sun_elevation_deg < -2.0 else "day"
    lines = [
        f"{scenario.name}: {scenario.about}",
        f"{scenario.length_m:.0f} m, {night}, rain {first.rain_mm_h:g} mm/h, the driver reads {scenario.driver_language}",
    ]
    for each in things(scenario):
        limit_kmh = limit_mps(scenario, law, each.at_m + 0.1) * 3.6
        mark = "!" if each.colour == "#c00" else " "
        lines.append(f"{each.at_m:6.0f} m {country_at(scenario, each.at_m)} {limit_kmh:4.0f} {mark} {each.what}")
    return "\n".join(lines)


def as_svg(scenario: Scenario) -> str:
    """From above, true to scale: one pixel is two metres."""
    route = Route(scenario)
    spine = route.section.spine
    low_x, high_y = float(spine.x_m.min()) - MARGIN_M, float(spine.y_m.max()) + MARGIN_M
    size = float(spine.x_m.max()) - low_x + 6 * MARGIN_M, high_y - float(spine.y_m.min()) + 4 * MARGIN_M

    def at(s_m: float, d_m: float = 0.0) -> str:
        x, y = spine.place(s_m, d_m)
        return f"{x - low_x:.1f},{high_y - y:.1f}"

    body = []
    for stretch, start, end in route.stretch_ends():
        count = max(2, int((end - start) / EVERY_M))
        points = " ".join(at(start + (end - start) * step / count) for step in range(count + 1))
        colour, width = _COLOURS[stretch.road_class], 4 * scenario.road.lanes + 4
        body.append(f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="{width}"/>')
    for number, each in enumerate(things(scenario)):
        out = (14.0, 34.0, 54.0)[number % 3] * (1.0 if number % 2 else -1.0)
        (x, y), (from_x, from_y) = at(each.at_m, out).split(","), at(each.at_m).split(",")
        body.append(f'<line x1="{from_x}" y1="{from_y}" x2="{x}" y2="{y}" stroke="{each.colour}"/>')
        body.append(f'<text x="{x}" y="{y}" fill="{each.colour}" font-size="9">{each.at_m:.0f} m {each.what}</text>')
    box = f'viewBox="0 0 {size[0]:.0f} {size[1]:.0f}" width="{size[0] / 2:.0f}" height="{size[1] / 2:.0f}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {box} font-family="sans-serif">\n' + "\n".join(body) + "\n</svg>\n"

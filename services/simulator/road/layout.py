"""All that lies flat: lanes and their markings, pavements, shoulders, side roads, stop lines, crossings."""

import itertools
import math
from collections.abc import Iterator

import numpy as np

from services.simulator.road.cross_section import CROSSING_M, Direction
from services.simulator.road.route import JUNCTION_HALF_M, PARKING_M, SHOULDER_M, Route
from services.simulator.scenario.plan import PlacedPlan
from services.simulator.scene.scene import Lane, Marking, Patch, Polyline, Pose, Road, StopLine, Strip, Zebra

SAMPLE_M = 4.0
PAVEMENT_M = 2.6
SIDE_ROAD_M = 60.0
SOLID_BEFORE_LINE_M = 30.0
Piece = tuple[float, float]


def build_flat(route: Route) -> Road:
    """The road of a route."""
    return Road(
        lanes=(*_lanes(route), *_side_lanes(route)),
        strips=tuple(_strips(route)),
        patches=tuple(_patches(route)),
        stop_lines=tuple(_stop_lines(route)),
        zebras=tuple(_zebras(route)),
    )


def _samples(piece: Piece) -> Polyline:
    count = max(2, int((piece[1] - piece[0]) / SAMPLE_M) + 1)
    return np.linspace(piece[0], piece[1], count)


def _line(route: Route, piece: Piece, offset_m: float) -> Polyline:
    s = _samples(piece)
    return route.section.spine.places(s, np.full_like(s, offset_m))


# Lanes -----------------------------------------------------------------------------------------------------------------


def _lanes(route: Route) -> Iterator[Lane]:
    for piece in _pieces(route):
        for lane in range(route.section.lanes):
            yield _lane(route, piece, "forward", lane)
            yield _lane(route, piece, "oncoming", lane)


def _lane(route: Route, piece: Piece, direction: Direction, lane: int) -> Lane:
    s = _samples(piece)
    centre = route.section.spine.places(s, route.section.offset_m(s, direction, lane))
    inner, outer = _markings(route, piece, direction, lane)
    keeps_left = route.section.keeps((piece[0] + piece[1]) / 2) == "left"
    left, right = (outer, inner) if keeps_left else (inner, outer)
    return Lane(
        centre_m=centre if direction == "forward" else centre[::-1].copy(),
        width_m=route.section.lane_width_m,
        left=left,
        right=right,
    )


def _markings(route: Route, piece: Piece, direction: Direction, lane: int) -> tuple[Marking, Marking]:
    """The markings towards the median and away from it."""
    section, middle = route.section, (piece[0] + piece[1]) / 2
    if route.at_junction(middle):
        return "none", "none"
    span = section.span()
    if span is not None and span[0] <= middle <= span[1]:
        inside = abs(middle - (span[0] + span[1]) / 2) < CROSSING_M / 2
        return ("none", "none") if inside else ("edge", "edge")
    outermost = lane == section.lanes - 1
    outer: Marking = ("none" if route.stretch_at(middle).pavement else "edge") if outermost else "dashed"
    if lane > 0:
        return "none", outer
    if section.median_m > 0.5:
        return "edge", outer
    if direction == "oncoming":
        return "none", outer
    return ("solid" if _before_line(route, middle) else "dashed"), outer


def _before_line(route: Route, s_m: float) -> bool:
    lines = [light.at_m for light in route.scenario.lights] + [stop.at_m for stop in route.scenario.stops]
    return any(line - SOLID_BEFORE_LINE_M <= s_m <= line for line in lines)


def _pieces(route: Route) -> list[Piece]:
    """The route cut where markings change."""
    cuts = {0.0, route.length_m, *(stretch.from_m for stretch in route.scenario.road.stretches)}
    for middle in route.junctions():
        cuts |= {middle - JUNCTION_HALF_M, middle + JUNCTION_HALF_M}
    lines: tuple[PlacedPlan, ...] = (*route.scenario.lights, *route.scenario.stops)
    for line in lines:
        cuts |= {line.at_m - SOLID_BEFORE_LINE_M, line.at_m}
    span = route.section.span()
    if span is not None:
        middle = (span[0] + span[1]) / 2
        cuts |= {span[0], middle - CROSSING_M / 2, middle, middle + CROSSING_M / 2, span[1]}
    inside = sorted(cut for cut in cuts if 0.0 <= cut <= route.length_m)
    return [(low, high) for low, high in itertools.pairwise(inside) if high - low > 0.5]


def _side_lanes(route: Route) -> Iterator[Lane]:
    """A road across at every junction: one lane in each direction, on both sides."""
    width = 3.2
    for middle in route.junctions():
        for side in (1.0, -1.0):
            start = route.kerb_m(middle) - 0.5
            out = np.linspace(start, start + SIDE_ROAD_M, 8)
            for half, marking in ((0.5, "dashed"), (-0.5, "none")):
                s = np.full_like(out, middle + half * width)
                centre = route.section.spine.places(s, side * out)
                # The first lane's inner border is on its left exactly when it leads away to the left, and mirrored.
                inward = (half > 0) == (side > 0)
                left: Marking = "none"
                right: Marking = "none"
                if marking == "dashed":
                    left, right = ("none", "dashed") if not inward else ("dashed", "none")
                yield Lane(centre_m=centre, width_m=width, left=left, right=right)


# Beside the lanes ---------------------------------------------------------------------------------------------------------


def _strips(route: Route) -> Iterator[Strip]:
    for stretch, start, end in route.stretch_ends():
        for piece in _whole(route, (start, end)):
            for side in (1.0, -1.0):
                yield from _beside(route, piece, side, stretch.pavement, stretch.parked > 0)
        if stretch.road_class == "motorway":
            yield from _shoulders(route, (start, end))
    span = route.section.span()
    if span is not None:
        widest = 2 * route.reach_m((span[0] + span[1]) / 2) + 1.0
        yield Strip(surface="asphalt", centre_m=_line(route, (span[0] - 5, span[1] + 5), 0.0), width_m=widest)


def _beside(route: Route, piece: Piece, side: float, pavement: bool, parking: bool) -> Iterator[Strip]:
    edge = route.section.half_width_m
    if parking:
        centre = _line(route, piece, side * (edge + PARKING_M / 2))
        yield Strip(surface="asphalt", centre_m=centre, width_m=PARKING_M)
        edge += PARKING_M
    if pavement:
        centre = _line(route, piece, side * (edge + PAVEMENT_M / 2))
        yield Strip(surface="pavement", centre_m=centre, width_m=PAVEMENT_M)


def _shoulders(route: Route, piece: Piece) -> Iterator[Strip]:
    edge, median = route.section.half_width_m, route.section.median_m
    for side in (1.0, -1.0):
        yield Strip(surface="asphalt", centre_m=_line(route, piece, side * (edge + SHOULDER_M / 2)), width_m=SHOULDER_M)
        if median > 2.0:
            inner = side * (median / 2 - 0.4)
            yield Strip(surface="asphalt", centre_m=_line(route, piece, inner), width_m=0.8)
    if median > 2.0:
        yield Strip(surface="verge", centre_m=_line(route, piece, 0.0), width_m=median - 1.6)


def _whole(route: Route, piece: Piece) -> list[Piece]:
    """A piece without the mouths of side roads and without a changeover."""
    holes = [(middle - JUNCTION_HALF_M, middle + JUNCTION_HALF_M) for middle in route.junctions()]
    span = route.section.span()
    holes += [span] if span is not None else []
    left = [piece]
    for low, high in sorted(holes):
        left = [part for old in left for part in ((old[0], min(old[1], low)), (max(old[0], high), old[1]))]
        left = [part for part in left if part[1] - part[0] > 1.0]
    return left


def _patches(route: Route) -> Iterator[Patch]:
    for middle in route.junctions():
        reach = route.kerb_m(middle) + 0.6
        corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
        outline = [route.section.spine.place(middle + a * JUNCTION_HALF_M, b * reach) for a, b in corners]
        yield Patch(surface="asphalt", outline_m=np.array(outline))


# Across the lanes ------------------------------------------------------------------------------------------------------------


def _stop_lines(route: Route) -> Iterator[StopLine]:
    lines: tuple[PlacedPlan, ...] = (*route.scenario.lights, *route.scenario.stops)
    for line in lines:
        for lane in range(route.section.lanes):
            yield StopLine(pose=_lane_pose(route, line.at_m, "forward", lane), width_m=route.section.lane_width_m - 0.2)
    for light in route.scenario.lights:
        at_m = opposite_line_m(route, light.at_m)
        for lane in range(route.section.lanes):
            yield StopLine(pose=_lane_pose(route, at_m, "oncoming", lane), width_m=route.section.lane_width_m - 0.2)


def opposite_line_m(route: Route, at_m: float) -> float:
    """Where oncoming traffic stops at the same lights: mirrored at the junction, or at the changeover."""
    span = route.section.span()
    if span is not None and span[0] - 20.0 <= at_m <= span[1]:
        return span[0] + span[1] - at_m
    return at_m + 22.0


def _lane_pose(route: Route, s_m: float, direction: Direction, lane: int) -> Pose:
    offset = float(route.section.offset_m(np.array([s_m]), direction, lane)[0])
    return route.pose(s_m, offset, 0.0 if direction == "forward" else math.pi)


def _zebras(route: Route) -> Iterator[Zebra]:
    for zebra in route.scenario.zebras:
        yield Zebra(pose=route.pose(zebra.at_m, 0.0), span_m=2 * route.kerb_m(zebra.at_m))

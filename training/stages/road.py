"""A stage's lanes, pavements, crossings and junction."""

from __future__ import annotations

import numpy as np

from services.simulator.scene.scene import Lane, Marking, Patch, Road, StopLine, Strip, Zebra
from training.stages.road_course import ROAD_M, Place


def road(place: Place, rng: np.random.Generator, junction: float) -> Road:
    """The road of a place, with another across it ``junction`` metres on (0: none)."""
    lanes, strips = [], [Strip(surface="asphalt", centre_m=place.line(0.0), width_m=2 * place.edge_m)]
    middle: Marking = "solid" if rng.uniform() < 0.3 else ("double" if place.lanes > 1 else "dashed")
    border: Marking = "edge" if not place.town or rng.uniform() < 0.6 else "none"
    for sense in (1.0, -1.0):
        for k in range(place.lanes):
            lateral = sense * place.lane_m * (k + 0.5)
            inner: Marking = (middle if sense < 0 else "none") if k == 0 else "dashed"
            outer: Marking = border if k == place.lanes - 1 else "none"
            left, right = (inner, outer) if sense < 0 else (outer, inner)
            lanes.append(Lane(centre_m=place.line(lateral), width_m=place.lane_m, left=left, right=right))
        if place.town:
            offset = sense * (place.edge_m + place.verge_m + place.pavement_m / 2)
            for start, end in _around(junction, place):
                strips.append(
                    Strip(surface="pavement", centre_m=place.line(offset, start, end), width_m=place.pavement_m)
                )
    zebras = (
        [Zebra(pose=place.at(float(rng.uniform(12, 60)), 0.0), span_m=2 * place.edge_m)]
        if place.town and rng.uniform() < 0.3
        else []
    )
    if not junction:
        return Road(lanes=tuple(lanes), strips=tuple(strips), zebras=tuple(zebras))
    return _crossed(place, junction, lanes, strips, zebras)


def _around(junction: float, place: Place) -> list[tuple[float, float]]:
    gap = 5.0 + place.verge_m
    return [(-60.0, junction - gap), (junction + gap, ROAD_M)] if junction else [(-60.0, ROAD_M)]


def _crossed(place: Place, junction: float, lanes: list[Lane], strips: list[Strip], zebras: list[Zebra]) -> Road:
    """The same road with another one across it."""
    half, reach = 3.4, 120.0
    for sense in (1.0, -1.0):
        laterals = np.linspace(place.edge_m - 0.3, place.edge_m + reach, 20) * sense
        points = np.array([(p.x_m, p.y_m) for p in (place.at(junction, lat) for lat in laterals)])
        strips.append(Strip(surface="asphalt", centre_m=points, width_m=2 * half))
        lanes.append(Lane(centre_m=points[2:], width_m=2 * half - 0.2, left="edge", right="edge"))
    corners = [
        (junction - half, -place.edge_m),
        (junction + half, -place.edge_m),
        (junction + half, place.edge_m),
        (junction - half, place.edge_m),
    ]
    outline = np.array([(p.x_m, p.y_m) for p in (place.at(s, lat) for s, lat in corners)])
    width = place.lane_m * place.lanes - 0.2
    stop = StopLine(pose=place.at(junction - half - 1.5, -place.side * place.lane_m * place.lanes / 2), width_m=width)
    return Road(
        lanes=tuple(lanes),
        strips=tuple(strips),
        patches=(Patch(surface="asphalt", outline_m=outline),),
        stop_lines=(stop,),
        zebras=tuple(zebras),
    )

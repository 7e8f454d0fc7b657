"""Pictograms, drawn with a few strokes and polygons inside a unit box (x and y from 0 to 1) placed on the face."""

import math
from collections.abc import Callable, Sequence

from services.simulator.signart.glyphs import arc
from services.simulator.signart.lettering import Box
from services.simulator.signart.painter import Colour, Painter, Point

Symbol = Callable[[Painter, Box, Colour], None]


def _at(box: Box, points: Sequence[Point]) -> list[Point]:
    return [(box.x + x * box.width, box.y + y * box.height) for x, y in points]


def _fill(painter: Painter, box: Box, points: Sequence[Point], colour: Colour) -> None:
    painter.polygon(_at(box, points), colour)


def _line(painter: Painter, box: Box, points: Sequence[Point], width: float, colour: Colour) -> None:
    painter.stroke(_at(box, points), width * min(box.width, box.height), colour)


def _head(painter: Painter, box: Box, x: float, y: float, radius: float, colour: Colour) -> None:
    painter.disc((box.x + x * box.width, box.y + y * box.height), radius * box.height, colour)


def _part(box: Box, x: float, y: float, width: float, height: float) -> Box:
    return Box(box.x + x * box.width, box.y + y * box.height, width * box.width, height * box.height)


def walker(painter: Painter, box: Box, colour: Colour) -> None:
    """A person walking."""
    _head(painter, box, 0.5, 0.1, 0.095, colour)
    _line(painter, box, [(0.5, 0.27), (0.5, 0.58)], 0.17, colour)
    _line(painter, box, [(0.5, 0.58), (0.68, 0.96)], 0.12, colour)
    _line(painter, box, [(0.48, 0.58), (0.42, 0.78), (0.22, 0.95)], 0.12, colour)
    _line(painter, box, [(0.5, 0.28), (0.74, 0.5)], 0.09, colour)
    _line(painter, box, [(0.5, 0.28), (0.26, 0.52)], 0.09, colour)


def zebra(painter: Painter, box: Box, colour: Colour) -> None:
    """A person walking over stripes."""
    for left in (0.02, 0.24, 0.46, 0.68):
        _fill(painter, box, [(left + 0.1, 0.8), (left + 0.2, 0.8), (left + 0.22, 1.0), (left, 1.0)], colour)
    walker(painter, _part(box, 0.18, 0.0, 0.64, 0.84), colour)


def children(painter: Painter, box: Box, colour: Colour) -> None:
    """Two children running, one smaller."""
    walker(painter, _part(box, -0.02, 0.02, 0.62, 0.96), colour)
    walker(painter, _part(box, 0.5, 0.26, 0.5, 0.72), colour)
    _line(painter, box, [(0.42, 0.42), (0.62, 0.5)], 0.07, colour)


def digger(painter: Painter, box: Box, colour: Colour) -> None:
    """A worker with a shovel at a heap."""
    _head(painter, box, 0.42, 0.12, 0.09, colour)
    _line(painter, box, [(0.4, 0.28), (0.3, 0.58)], 0.15, colour)
    _line(painter, box, [(0.3, 0.58), (0.4, 0.94)], 0.11, colour)
    _line(painter, box, [(0.3, 0.58), (0.12, 0.94)], 0.11, colour)
    _line(painter, box, [(0.4, 0.3), (0.6, 0.46)], 0.08, colour)
    _line(painter, box, [(0.36, 0.5), (0.72, 0.84)], 0.06, colour)
    _fill(painter, box, [(0.58, 0.96), (0.8, 0.66), (1.0, 0.96)], colour)


def skid(painter: Painter, box: Box, colour: Colour) -> None:
    """A car from behind above two wavy tracks."""
    car(painter, _part(box, 0.2, 0.0, 0.6, 0.48), colour)
    for left in (0.3, 0.66):
        wave = [(left + 0.1 * math.sin(step * 0.75), 0.52 + step * 0.048) for step in range(11)]
        _line(painter, box, wave, 0.08, colour)


def car(painter: Painter, box: Box, colour: Colour) -> None:
    """A car from behind."""
    _fill(painter, box, [(0.22, 0.1), (0.78, 0.1), (0.92, 0.5), (0.92, 0.82), (0.08, 0.82), (0.08, 0.5)], colour)
    _fill(painter, box, [(0.12, 0.8), (0.3, 0.8), (0.3, 1.0), (0.12, 1.0)], colour)
    _fill(painter, box, [(0.7, 0.8), (0.88, 0.8), (0.88, 1.0), (0.7, 1.0)], colour)


def car_pair(painter: Painter, box: Box, left: Colour, right: Colour, glass: Colour) -> None:
    """Two cars side by side, as on the signs about overtaking."""
    for start, colour in ((0.0, left), (0.52, right)):
        place = _part(box, start, 0.0, 0.48, 1.0)
        car(painter, place, colour)
        _fill(painter, place, [(0.3, 0.2), (0.7, 0.2), (0.78, 0.46), (0.22, 0.46)], glass)


def lorry(painter: Painter, box: Box, colour: Colour) -> None:
    """A lorry from the side."""
    _fill(painter, box, [(0.0, 0.12), (0.64, 0.12), (0.64, 0.78), (0.0, 0.78)], colour)
    _fill(painter, box, [(0.68, 0.3), (0.88, 0.3), (1.0, 0.52), (1.0, 0.78), (0.68, 0.78)], colour)
    for x in (0.16, 0.34, 0.84):
        painter.disc((box.x + x * box.width, box.y + 0.82 * box.height), 0.14 * box.height, colour)


def arrow_up(painter: Painter, box: Box, colour: Colour) -> None:
    """A straight arrow."""
    shape = [(0.5, 0.0), (0.92, 0.42), (0.64, 0.42), (0.64, 1.0), (0.36, 1.0), (0.36, 0.42), (0.08, 0.42)]
    _fill(painter, box, shape, colour)


def arrow(painter: Painter, box: Box, colour: Colour, turn_deg: float) -> None:
    """A straight arrow turned clockwise from up."""
    shape = [(0.5, 0.0), (0.9, 0.42), (0.62, 0.42), (0.62, 1.0), (0.38, 1.0), (0.38, 0.42), (0.1, 0.42)]
    sine, cosine = math.sin(math.radians(turn_deg)), math.cos(math.radians(turn_deg))
    arms = [(x - 0.5, y - 0.5) for x, y in shape]
    _fill(painter, box, [(0.5 + x * cosine - y * sine, 0.5 + x * sine + y * cosine) for x, y in arms], colour)


def motorway(painter: Painter, box: Box, colour: Colour, ground: Colour) -> None:
    """Two carriageways running away under a bridge."""
    _fill(painter, box, [(0.36, 0.1), (0.47, 0.1), (0.45, 1.0), (0.1, 1.0)], colour)
    _fill(painter, box, [(0.53, 0.1), (0.64, 0.1), (0.9, 1.0), (0.55, 1.0)], colour)
    _fill(painter, box, [(0.04, 0.22), (0.96, 0.22), (0.96, 0.4), (0.04, 0.4)], ground)
    _fill(painter, box, [(0.08, 0.26), (0.92, 0.26), (0.92, 0.36), (0.08, 0.36)], colour)


def star_ring(painter: Painter, centre: Point, radius: float, colour: Colour) -> None:
    """Twelve stars in a circle."""
    for hour in range(12):
        angle = math.radians(30 * hour)
        middle = (centre[0] + radius * math.sin(angle), centre[1] - radius * math.cos(angle))
        star(painter, middle, radius * 0.16, colour)


def star(painter: Painter, centre: Point, radius: float, colour: Colour) -> None:
    """A five-pointed star."""
    points = []
    for step in range(10):
        reach = radius if step % 2 == 0 else radius * 0.42
        angle = math.radians(36 * step)
        points.append((centre[0] + reach * math.sin(angle), centre[1] - reach * math.cos(angle)))
    painter.polygon(points, colour)


def rain_cloud(painter: Painter, box: Box, colour: Colour) -> None:
    """A cloud with three drops, for plates about rain."""
    for x, y, radius in ((0.3, 0.36, 0.2), (0.55, 0.28, 0.24), (0.75, 0.4, 0.17)):
        _head(painter, box, x, y, radius, colour)
    _fill(painter, box, [(0.16, 0.36), (0.86, 0.36), (0.86, 0.56), (0.16, 0.56)], colour)
    for x in (0.3, 0.5, 0.7):
        _line(painter, box, [(x, 0.68), (x - 0.1, 0.98)], 0.08, colour)


def town(painter: Painter, box: Box, colour: Colour) -> None:
    """The skyline of a small town."""
    _fill(painter, box, [(0.0, 1.0), (0.0, 0.5), (0.16, 0.34), (0.32, 0.5), (0.32, 1.0)], colour)
    _fill(painter, box, [(0.36, 1.0), (0.36, 0.4), (0.45, 0.0), (0.54, 0.4), (0.54, 1.0)], colour)
    _fill(painter, box, [(0.58, 1.0), (0.58, 0.56), (0.8, 0.36), (1.0, 0.56), (1.0, 1.0)], colour)


def queue(painter: Painter, box: Box, colour: Colour) -> None:
    """Cars standing one behind the other."""
    for left, top, size in ((0.28, 0.56, 0.44), (0.32, 0.24, 0.36), (0.36, 0.0, 0.28)):
        place = _part(box, left, top, size, size)
        car(painter, place._replace(height=place.height * 0.9), colour)


def curve(centre: Point, radius: float, start_deg: float, end_deg: float) -> list[Point]:
    """A circular arc as points on the face."""
    return arc(centre[0], centre[1], radius, radius, start_deg, end_deg)

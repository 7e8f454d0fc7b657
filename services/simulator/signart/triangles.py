"""Pointed faces: warnings, give way, stop, priority. Face units are metres."""

import math

from services.simulator.signart import symbols
from services.simulator.signart.lettering import Box, write_centred
from services.simulator.signart.painter import Colour, Painter, Point
from services.simulator.signart.sheet import Sheet

SIDE_M = 0.9
HEIGHT_M = 0.79
STOP_M = 0.75
DIAMOND_M = 0.85
# Countries whose warning triangles have a yellow ground.
_YELLOW_GROUND = {"POL", "SWE"}


def _inset(points: list[Point], amount: float) -> list[Point]:
    cx = sum(x for x, _ in points) / len(points)
    cy = sum(y for _, y in points) / len(points)
    return [(cx + (x - cx) * (1 - amount), cy + (y - cy) * (1 - amount)) for x, y in points]


def _rounded(painter: Painter, points: list[Point], radius: float, colour: Colour) -> None:
    painter.polygon(points, colour)
    painter.stroke([*points, points[0]], 2 * radius, colour)


def _triangle(painter: Painter, sheet: Sheet, down: bool) -> None:
    corners = [(0.45, 0.035), (0.865, 0.755), (0.035, 0.755)]
    if down:
        corners = [(x, HEIGHT_M - y) for x, y in corners]
    ground = sheet.paint.yellow if sheet.country in _YELLOW_GROUND else sheet.paint.white
    _rounded(painter, corners, 0.034, sheet.paint.white)
    _rounded(painter, corners, 0.028, sheet.paint.red)
    painter.polygon(_inset(corners, 0.30), ground)


def yield_(painter: Painter, sheet: Sheet, _: str) -> None:
    """Triangle standing on its tip; British ones say so in words."""
    _triangle(painter, sheet, down=True)
    if sheet.country == "GBR":
        write_centred(painter, sheet.letters, "GIVE", Box(0.31, 0.17, 0.28, 0.085), sheet.paint.black)
        write_centred(painter, sheet.letters, "WAY", Box(0.34, 0.29, 0.22, 0.085), sheet.paint.black)


_PICTURES: dict[str, symbols.Symbol] = {
    "children": symbols.children, "roadworks": symbols.digger, "slippery": symbols.skid, "crossing": symbols.zebra,
}  # fmt: skip


def warning(painter: Painter, sheet: Sheet, name: str) -> None:
    """A warning with a picture: children, works, a slippery road, a pedestrian crossing (Britain)."""
    _triangle(painter, sheet, down=False)
    _PICTURES[name](painter, Box(0.285, 0.30, 0.33, 0.36), sheet.paint.black)


def danger(painter: Painter, sheet: Sheet, _: str) -> None:
    """A danger without a sign of its own: an exclamation mark."""
    _triangle(painter, sheet, down=False)
    painter.polygon([(0.405, 0.30), (0.495, 0.30), (0.47, 0.55), (0.43, 0.55)], sheet.paint.black)
    painter.disc((0.45, 0.615), 0.038, sheet.paint.black)


def priority_here(painter: Painter, sheet: Sheet, _: str) -> None:
    """Priority at the next crossing only."""
    _triangle(painter, sheet, down=False)
    symbols.arrow_up(painter, Box(0.365, 0.28, 0.17, 0.4), sheet.paint.black)
    painter.stroke([(0.31, 0.545), (0.59, 0.545)], 0.05, sheet.paint.black, flat=True)


def stop(painter: Painter, sheet: Sheet, _: str) -> None:
    """Red octagon with the word."""
    centre, radius = STOP_M / 2, STOP_M / 2 / math.cos(math.pi / 8)
    angles = [math.pi / 8 * (2 * k + 1) for k in range(8)]
    corners = [(centre + radius * math.cos(angle), centre + radius * math.sin(angle)) for angle in angles]
    painter.polygon(corners, sheet.paint.white)
    painter.polygon(_inset(corners, 0.06), sheet.paint.red)
    write_centred(painter, sheet.letters, "STOP", Box(0.09, 0.25, STOP_M - 0.18, 0.25), sheet.paint.white)


def priority_road(painter: Painter, sheet: Sheet, _: str) -> None:
    """Yellow diamond in white."""
    half = DIAMOND_M / 2
    corners = [(half, 0.02), (DIAMOND_M - 0.02, half), (half, DIAMOND_M - 0.02), (0.02, half)]
    _rounded(painter, corners, 0.018, sheet.paint.black)
    _rounded(painter, corners, 0.012, sheet.paint.white)
    painter.polygon(_inset(corners, 0.3), sheet.paint.yellow)


def priority_road_end(painter: Painter, sheet: Sheet, _: str) -> None:
    """Yellow diamond struck through."""
    priority_road(painter, sheet, "")
    for offset in (-0.05, 0.0, 0.05):
        ends = [(0.62 + offset, 0.23 + offset), (0.23 + offset, 0.62 + offset)]
        painter.stroke(ends, 0.022, sheet.paint.black, flat=True)

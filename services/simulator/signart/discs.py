"""Round faces: limits, their ends, prohibitions and orders. Face units are metres; the disc is 0.6 m."""

import math

from services.simulator.signart import symbols
from services.simulator.signart.lettering import Box, write_centred
from services.simulator.signart.painter import Colour, Painter, Point
from services.simulator.signart.sheet import Sheet

DISC_M = 0.6
_C: Point = (DISC_M / 2, DISC_M / 2)
_R = DISC_M / 2
_REACH = _R * 0.93 * math.sqrt(0.5)
_DIAGONAL = [(_C[0] + _REACH, _C[1] - _REACH), (_C[0] - _REACH, _C[1] + _REACH)]
_PAIR = Box(_C[0] - _R * 0.58, _C[1] - _R * 0.3, _R * 1.16, _R * 0.6)
"""Where the two cars of the signs about overtaking stand."""


def ring(painter: Painter, sheet: Sheet, centre: Point = _C, radius: float = _R) -> None:
    """White disc with a red ring and a thin light rim."""
    painter.disc(centre, radius, sheet.paint.white)
    painter.disc(centre, radius * 0.97, sheet.paint.red)
    painter.disc(centre, radius * (0.76 if sheet.country == "GBR" else 0.74), sheet.paint.white)


def number_box(text: str, centre: Point, radius: float) -> Box:
    """The box of the digits inside a ring."""
    width, height = (1.12, 0.70) if len(text) < 3 else (1.24, 0.60)
    return Box(centre[0] - radius * width / 2, centre[1] - radius * height / 2, radius * width, radius * height)


def limit(painter: Painter, sheet: Sheet, value: str) -> None:
    """A speed limit; an empty value is an empty ring (no vehicles)."""
    limit_at(painter, sheet, value, _C, _R)


def limit_at(painter: Painter, sheet: Sheet, value: str, centre: Point, radius: float) -> None:
    """A speed limit anywhere on a larger face."""
    ring(painter, sheet, centre, radius)
    if value:
        write_centred(painter, sheet.letters, value, number_box(value, centre, radius), sheet.paint.black)


def limit_end(painter: Painter, sheet: Sheet, value: str) -> None:
    """End of one limit: the number in grey, struck through; in France by a single bar."""
    grey_disc(painter, sheet)
    write_centred(painter, sheet.letters, value, number_box(value, _C, _R), sheet.paint.grey)
    if sheet.country == "FRA":
        painter.stroke(_DIAGONAL, _R * 0.16, sheet.paint.black, flat=True)
        return
    strike(painter, sheet.paint.black, _C, _R, lines=5)


def all_end(painter: Painter, sheet: Sheet, _: str) -> None:
    """End of all stretch limits."""
    grey_disc(painter, sheet)
    strike(painter, sheet.paint.black, _C, _R, lines=5)


def national(painter: Painter, sheet: Sheet, _: str) -> None:
    """The national limit applies: white disc, one broad black diagonal."""
    painter.disc(_C, _R, sheet.paint.black)
    painter.disc(_C, _R * 0.95, sheet.paint.white)
    painter.stroke(_DIAGONAL, _R * 0.26, sheet.paint.black, flat=True)


def grey_disc(painter: Painter, sheet: Sheet) -> None:
    """White disc with a thin dark rim."""
    painter.disc(_C, _R, sheet.paint.white)
    painter.disc(_C, _R * 0.96, sheet.paint.black)
    painter.disc(_C, _R * 0.92, sheet.paint.white)


def strike(painter: Painter, colour: Colour, centre: Point, radius: float, lines: int) -> None:
    """Narrow parallel lines from top right to bottom left, inside a disc."""
    for index in range(lines):
        offset = (index - (lines - 1) / 2) * radius * 0.115
        half = math.sqrt((radius * 0.92) ** 2 - offset**2)
        cx, cy, part = centre[0] + offset * math.sqrt(0.5), centre[1] + offset * math.sqrt(0.5), half * math.sqrt(0.5)
        painter.stroke([(cx + part, cy - part), (cx - part, cy + part)], radius * 0.06, colour, flat=True)


def no_entry(painter: Painter, sheet: Sheet, _: str) -> None:
    """Red disc with a white bar."""
    painter.disc(_C, _R, sheet.paint.white)
    painter.disc(_C, _R * 0.97, sheet.paint.red)
    painter.rounded(_C[0] - _R * 0.74, _C[1] - _R * 0.17, _R * 1.48, _R * 0.34, 0.01, sheet.paint.white)


def no_overtaking(painter: Painter, sheet: Sheet, _: str) -> None:
    """Two cars in a red ring; the overtaking one is red."""
    ring(painter, sheet)
    inks = sheet.paint.red, sheet.paint.black
    left, right = reversed(inks) if sheet.country == "GBR" else inks
    symbols.car_pair(painter, _PAIR, left, right, sheet.paint.white)


def no_overtaking_end(painter: Painter, sheet: Sheet, _: str) -> None:
    """Two grey cars struck through."""
    grey_disc(painter, sheet)
    symbols.car_pair(painter, _PAIR, sheet.paint.grey, sheet.paint.grey, sheet.paint.white)
    strike(painter, sheet.paint.black, _C, _R, lines=5)


_TURN_DEG = {"left": 225, "right": 135, "ahead": 0}


def order(painter: Painter, sheet: Sheet, way: str) -> None:
    """Blue disc, white arrow: keep left (down left), keep right (down right) or ahead only (up)."""
    _blue(painter, sheet)
    box = Box(_C[0] - _R * 0.62, _C[1] - _R * 0.62, _R * 1.24, _R * 1.24)
    symbols.arrow(painter, box, sheet.paint.white, _TURN_DEG[way])


def roundabout(painter: Painter, sheet: Sheet, _: str) -> None:
    """Blue disc, three arrows round; clockwise where traffic keeps left."""
    _blue(painter, sheet)
    way = 1 if sheet.country == "GBR" else -1
    for start in (0, 120, 240):
        painter.stroke(symbols.curve(_C, _R * 0.5, start, start + way * 72), _R * 0.15, sheet.paint.white)
        tip, side = math.radians(start + way * 100), math.radians(start + way * 66)
        ends = [(_C[0] + reach * math.cos(side), _C[1] + reach * math.sin(side)) for reach in (_R * 0.28, _R * 0.72)]
        point = (_C[0] + _R * 0.5 * math.cos(tip), _C[1] + _R * 0.5 * math.sin(tip))
        painter.polygon([*ends, point], sheet.paint.white)


def _blue(painter: Painter, sheet: Sheet) -> None:
    painter.disc(_C, _R, sheet.paint.white)
    painter.disc(_C, _R * 0.95, sheet.paint.blue)

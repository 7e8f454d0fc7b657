"""Faces of the United States: numbers and words on boards, yellow diamonds, a pentagon for schools. Units are metres.

Sizes and proportions follow the public plates of the MUTCD (R1-1 to R6-1, S1-1 to S5-2, W-series); drawn by this code.
"""

import math

from services.simulator.signart import symbols
from services.simulator.signart.lettering import Box, write_centred
from services.simulator.signart.painter import Colour, Painter, Point
from services.simulator.signart.panels import board
from services.simulator.signart.sheet import Sheet

BOARD_M = (0.61, 0.76)
SCHOOL_BOARD_M = (0.61, 1.07)
DIAMOND_M = (0.95, 0.95)
SQUARE_M = (0.76, 0.76)
ONE_WAY_M = (0.91, 0.31)
SCHOOL_M = (0.76, 0.76)
SHIELD_M = (0.76, 0.76)
YIELD_M = (0.9, 0.79)
ADVISORY_M = (0.46, 0.46)


def _lines(painter: Painter, sheet: Sheet, words: tuple[str, ...], top: float, height: float, ink: Colour) -> None:
    width = painter.width
    for index, word in enumerate(words):
        box = Box(0.09 * width, top + index * height * 1.35, 0.82 * width, height)
        write_centred(painter, sheet.letters, word, box, ink)


def limit(painter: Painter, sheet: Sheet, value: str) -> None:
    """SPEED LIMIT over the number, black on white."""
    board(painter, sheet.paint.white, sheet.paint.black)
    _limit(painter, sheet, value, 0.0)


def _limit(painter: Painter, sheet: Sheet, value: str, top: float) -> None:
    _lines(painter, sheet, ("SPEED", "LIMIT"), top + 0.075, 0.095, sheet.paint.black)
    write_centred(painter, sheet.letters, value, Box(0.08, top + 0.36, 0.45, 0.31), sheet.paint.black)


def school_limit(painter: Painter, sheet: Sheet, value: str) -> None:
    """A limit of school hours: SCHOOL on yellow above, when it holds below."""
    board(painter, sheet.paint.white, sheet.paint.black)
    painter.rounded(0.02, 0.02, 0.57, 0.15, 0.02, sheet.paint.yellow)
    write_centred(painter, sheet.letters, "SCHOOL", Box(0.06, 0.05, 0.49, 0.09), sheet.paint.black)
    _limit(painter, sheet, value, 0.14)
    painter.rounded(0.02, 0.84, 0.57, 0.21, 0.02, sheet.paint.white)
    _lines(painter, sheet, tuple((sheet.text or "WHEN\nFLASHING").split("\n")), 0.86, 0.065, sheet.paint.black)


def worded(painter: Painter, sheet: Sheet, words: str) -> None:
    """A white board with an order in words; ``|`` parts its lines."""
    board(painter, sheet.paint.white, sheet.paint.black)
    lines = tuple(words.split("|"))
    height = 0.62 * painter.height / (1.35 * len(lines))
    _lines(painter, sheet, lines, 0.5 * painter.height - 0.66 * len(lines) * height, height, sheet.paint.black)


def keep_right(painter: Painter, sheet: Sheet, _: str) -> None:
    """Keep right of an island: a curved arrow beside a bar."""
    board(painter, sheet.paint.white, sheet.paint.black)
    painter.stroke([(0.16, 0.68), (0.16, 0.5)], 0.1, sheet.paint.black, flat=True)
    painter.stroke([(0.29, 0.68), (0.29, 0.56), (0.41, 0.4), (0.41, 0.24)], 0.07, sheet.paint.black)
    painter.polygon([(0.41, 0.08), (0.53, 0.26), (0.29, 0.26)], sheet.paint.black)


def ahead_only(painter: Painter, sheet: Sheet, _: str) -> None:
    """Straight on only."""
    board(painter, sheet.paint.white, sheet.paint.black)
    symbols.arrow_up(painter, Box(0.16, 0.08, 0.29, 0.42), sheet.paint.black)
    write_centred(painter, sheet.letters, "ONLY", Box(0.08, 0.56, 0.45, 0.12), sheet.paint.black)


def no_entry(painter: Painter, sheet: Sheet, _: str) -> None:
    """A white square with a red disc, a white bar and DO NOT ENTER."""
    board(painter, sheet.paint.white, sheet.paint.white)
    painter.disc((0.38, 0.38), 0.355, sheet.paint.red)
    painter.rounded(0.11, 0.335, 0.54, 0.09, 0.01, sheet.paint.white)
    write_centred(painter, sheet.letters, "DO NOT", Box(0.18, 0.18, 0.4, 0.09), sheet.paint.white)
    write_centred(painter, sheet.letters, "ENTER", Box(0.19, 0.49, 0.38, 0.09), sheet.paint.white)


def one_way(painter: Painter, sheet: Sheet, _: str) -> None:
    """A white arrow with words on black."""
    board(painter, sheet.paint.black, sheet.paint.white, sheet.paint.black)
    arrow = [(0.05, 0.1), (0.66, 0.1), (0.66, 0.05), (0.86, 0.155), (0.66, 0.26), (0.66, 0.21), (0.05, 0.21)]
    painter.polygon(arrow, sheet.paint.white)
    write_centred(painter, sheet.letters, "ONE WAY", Box(0.12, 0.125, 0.52, 0.06), sheet.paint.black)


def yield_(painter: Painter, sheet: Sheet, _: str) -> None:
    """A triangle on its tip with a broad red edge and YIELD."""
    outer, inner = [(0.03, 0.03), (0.87, 0.03), (0.45, 0.76)], [(0.24, 0.16), (0.66, 0.16), (0.45, 0.53)]
    painter.polygon(outer, sheet.paint.white)
    painter.stroke([*outer, outer[0]], 0.05, sheet.paint.white)
    painter.polygon(outer, sheet.paint.red)
    painter.polygon(inner, sheet.paint.white)
    write_centred(painter, sheet.letters, "YIELD", Box(0.3, 0.2, 0.3, 0.08), sheet.paint.red)


def _diamond(painter: Painter, ground: Colour, ink: Colour) -> None:
    half = DIAMOND_M[0] / 2
    for reach, colour in ((half - 0.01, ground), (half - 0.03, ink), (half - 0.05, ground)):
        corners = [(half, half - reach), (half + reach, half), (half, half + reach), (half - reach, half)]
        painter.polygon(corners, colour)


def warning(painter: Painter, sheet: Sheet, name: str) -> None:
    """A yellow diamond with a picture; for works it is orange."""
    _diamond(painter, sheet.paint.orange if name == "roadworks" else sheet.paint.yellow, sheet.paint.black)
    _PICTURES[name](painter, Box(0.275, 0.265, 0.4, 0.42), sheet.paint.black)


def _circling(painter: Painter, box: Box, colour: Colour) -> None:
    centre: Point = (box.x + box.width / 2, box.y + box.height / 2)
    for start in (0, 120, 240):
        painter.stroke(symbols.curve(centre, 0.15, start, start - 70), 0.05, colour)
        tip, side = math.radians(start - 105), math.radians(start - 64)
        ends = [(centre[0] + r * math.cos(side), centre[1] + r * math.sin(side)) for r in (0.08, 0.22)]
        painter.polygon([*ends, (centre[0] + 0.15 * math.cos(tip), centre[1] + 0.15 * math.sin(tip))], colour)


_PICTURES = {
    "crossing": symbols.walker,
    "children": symbols.children,
    "roadworks": symbols.digger,
    "slippery": symbols.skid,
    "roundabout": _circling,
}


def school(painter: Painter, sheet: Sheet, _: str) -> None:
    """A pentagon with a pair walking: a school is near."""
    lime = (max(0, sheet.paint.yellow[0] - 45), min(255, sheet.paint.yellow[1] + 30), sheet.paint.yellow[2])
    for inset, colour in ((0.0, lime), (0.02, sheet.paint.black), (0.035, lime)):
        near, far = 0.01 + inset, 0.75 - inset
        points = [(0.38, near), (far, 0.34), (far, far), (near, far), (near, 0.34)]
        painter.polygon(points, colour)
    symbols.children(painter, Box(0.2, 0.24, 0.38, 0.42), sheet.paint.black)


def interstate(painter: Painter, sheet: Sheet, _: str) -> None:
    """The number of an interstate road on a shield: which road it is, not where it starts."""
    for grow, colour in ((0.0, sheet.paint.white), (0.025, sheet.paint.blue)):
        painter.polygon(_shield(grow), colour)
    painter.polygon([(0.09, 0.075), (0.67, 0.075), (0.71, 0.22), (0.05, 0.22)], sheet.paint.red)
    painter.stroke([(0.04, 0.225), (0.72, 0.225)], 0.02, sheet.paint.white, flat=True)
    write_centred(painter, sheet.letters, "INTERSTATE", Box(0.14, 0.11, 0.48, 0.065), sheet.paint.white)
    write_centred(painter, sheet.letters, sheet.text or "95", Box(0.12, 0.29, 0.52, 0.25), sheet.paint.white)


def _shield(inset: float) -> list[Point]:
    right = [(0.38, 0.06), (0.55, 0.045), (0.69, 0.05), (0.745, 0.24), (0.73, 0.42), (0.64, 0.6), (0.38, 0.745)]
    left = [(0.76 - x, y) for x, y in right[-2:0:-1]]
    middle = (0.38, 0.38)
    return [(x + (middle[0] - x) * inset / 0.38, y + (middle[1] - y) * inset / 0.38) for x, y in (*right, *left)]


def advisory(painter: Painter, sheet: Sheet, value: str) -> None:
    """An advised speed below a warning: black on a yellow square."""
    board(painter, sheet.paint.yellow, sheet.paint.black, sheet.paint.yellow)
    write_centred(painter, sheet.letters, sheet.text or value, Box(0.07, 0.08, 0.32, 0.19), sheet.paint.black)
    write_centred(painter, sheet.letters, "MPH", Box(0.1, 0.32, 0.26, 0.075), sheet.paint.black)

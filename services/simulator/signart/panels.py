"""Rectangular faces: zones, towns, motorways, borders, one-way streets. Face units are metres."""

from typing import NamedTuple

from services.simulator.signart import discs, symbols
from services.simulator.signart.lettering import Box, write_centred
from services.simulator.signart.painter import Colour, Painter
from services.simulator.signart.sheet import Palette, Sheet

ZONE_M = (0.84, 0.84)
TOWN_M = (1.0, 0.65)
MOTORWAY_M = (0.84, 0.84)
BORDER_M = (1.2, 0.9)
INFO_M = (1.0, 0.75)
ONE_WAY_M = {"DEU": (0.8, 0.3), "GBR": (0.45, 0.6)}


class TownStyle(NamedTuple):
    """Names of the paints of a country's town sign."""

    ground: str
    ink: str
    edge: str


TOWN_STYLES = {
    "DEU": TownStyle("yellow", "black", "black"),
    "GBR": TownStyle("white", "black", "black"),
    "AUT": TownStyle("white", "black", "blue"),
    "FRA": TownStyle("white", "black", "red"),
    "NLD": TownStyle("blue", "white", "white"),
    "POL": TownStyle("green", "white", "white"),
    "CHE": TownStyle("blue", "white", "white"),
}
COUNTRY_NAMES = {
    "DEU": "Bundesrepublik Deutschland", "GBR": "United Kingdom", "AUT": "Republik Österreich", "FRA": "France",
    "NLD": "Nederland", "POL": "Polska", "CHE": "Schweiz Suisse Svizzera",
}  # fmt: skip
_GREEN_MOTORWAYS = {"CHE"}


def _paint(palette: Palette, name: str) -> Colour:
    colour: Colour = getattr(palette, name)
    return colour


def board(painter: Painter, ground: Colour, edge: Colour, rim: Colour | None = None) -> None:
    """A whole rounded board with an edge line set in from the rim."""
    width, height = painter.width, painter.height
    line = 0.02 * max(width, height)
    painter.rounded(0, 0, width, height, 0.05 * max(width, height), rim or ground)
    painter.rounded(line * 0.6, line * 0.6, width - line * 1.2, height - line * 1.2, 0.045 * max(width, height), edge)
    painter.rounded(line * 1.6, line * 1.6, width - line * 3.2, height - line * 3.2, 0.035 * max(width, height), ground)


def zone(painter: Painter, sheet: Sheet, value: str) -> None:
    """A limit that holds in a whole zone."""
    board(painter, sheet.paint.white, sheet.paint.black)
    if sheet.country == "GBR":
        discs.limit_at(painter, sheet, value, (0.42, 0.34), 0.28)
        write_centred(painter, sheet.letters, "ZONE", Box(0.2, 0.67, 0.44, 0.1), sheet.paint.black)
        return
    discs.limit_at(painter, sheet, value, (0.42, 0.33), 0.26)
    write_centred(painter, sheet.letters, "ZONE", Box(0.12, 0.65, 0.6, 0.12), sheet.paint.black)


def zone_end(painter: Painter, sheet: Sheet, value: str) -> None:
    """The zone ends: grey, struck through."""
    pale = sheet.paint._replace(black=sheet.paint.grey, red=sheet.paint.grey)
    zone(painter, sheet._replace(paint=pale), value)
    for index in range(5):
        offset = (index - 2) * 0.035
        ends = [(0.72 + offset, 0.08 + offset), (0.08 + offset, 0.72 + offset)]
        painter.stroke(ends, 0.018, sheet.paint.black, flat=True)


def general(painter: Painter, sheet: Sheet, value: str) -> None:
    """The general limit of built-up areas (Switzerland): a ring over a word on a white board."""
    board(painter, sheet.paint.white, sheet.paint.black)
    discs.limit_at(painter, sheet, value, (0.42, 0.34), 0.28)
    words = sheet.text or "generell"
    write_centred(painter, sheet.letters, words, Box(0.1, 0.68, 0.64, 0.09), sheet.paint.black)


def general_end(painter: Painter, sheet: Sheet, value: str) -> None:
    """The general limit ends: grey, struck through."""
    pale = sheet.paint._replace(black=sheet.paint.grey, red=sheet.paint.grey)
    general(painter, sheet._replace(paint=pale), value)
    discs.strike(painter, sheet.paint.black, (0.42, 0.34), 0.3, lines=5)


def town_entry(painter: Painter, sheet: Sheet, _: str) -> None:
    """A built-up area starts; its name is on the board."""
    style = TOWN_STYLES.get(sheet.country, TOWN_STYLES["DEU"])
    board(painter, _paint(sheet.paint, style.ground), _paint(sheet.paint, style.edge))
    ink = _paint(sheet.paint, style.ink)
    first, _, second = (sheet.text or "Ort").partition("\n")
    write_centred(painter, sheet.letters, first, Box(0.08, 0.19 if second else 0.24, 0.84, 0.17), ink)
    write_centred(painter, sheet.letters, second, Box(0.15, 0.45, 0.7, 0.09), ink)


def town_exit(painter: Painter, sheet: Sheet, _: str) -> None:
    """The built-up area ends: the name struck through in red."""
    if sheet.country == "DEU":
        board(painter, sheet.paint.yellow, sheet.paint.black)
        painter.stroke([(0.03, 0.33), (0.97, 0.33)], 0.018, sheet.paint.black, flat=True)
        name = (sheet.text or "Ort").partition("\n")[0]
        write_centred(painter, sheet.letters, name, Box(0.1, 0.41, 0.8, 0.14), sheet.paint.black)
        painter.stroke([(0.05, 0.59), (0.95, 0.37)], 0.035, sheet.paint.red, flat=True)
        return
    town_entry(painter, sheet, "")
    painter.stroke([(0.06, 0.58), (0.94, 0.07)], 0.05, sheet.paint.red, flat=True)


def motorway(painter: Painter, sheet: Sheet, _: str) -> None:
    """A motorway starts."""
    ground = sheet.paint.green if sheet.country in _GREEN_MOTORWAYS else sheet.paint.blue
    board(painter, ground, sheet.paint.white, ground)
    symbols.motorway(painter, Box(0.12, 0.1, 0.6, 0.64), sheet.paint.white, ground)


def motorway_end(painter: Painter, sheet: Sheet, _: str) -> None:
    """The motorway ends."""
    motorway(painter, sheet, "")
    painter.stroke([(0.74, 0.08), (0.1, 0.76)], 0.07, sheet.paint.red, flat=True)


def border(painter: Painter, sheet: Sheet, country: str) -> None:
    """A state border: ring of stars (where in the union) and the country's name on blue."""
    board(painter, sheet.paint.blue, sheet.paint.blue)
    if country == "GBR":
        _cross_flag(painter, sheet)
    elif country == "CHE":
        _white_cross(painter, sheet)
    else:
        symbols.star_ring(painter, (0.6, 0.34), 0.24, sheet.paint.yellow)
    name = sheet.text or COUNTRY_NAMES.get(country, country)
    first, _, second = name.partition(" ")
    top = 0.66 if second else 0.68
    write_centred(painter, sheet.letters, first, Box(0.08, top, 1.04, 0.085), sheet.paint.white)
    write_centred(painter, sheet.letters, second, Box(0.08, 0.775, 1.04, 0.085), sheet.paint.white)


def _cross_flag(painter: Painter, sheet: Sheet) -> None:
    left, top, width, height = 0.3, 0.1, 0.6, 0.46
    middle_x, middle_y = left + width / 2, top + height / 2
    for thick, colour in ((0.10, sheet.paint.white), (0.035, sheet.paint.red)):
        painter.stroke([(left, top), (left + width, top + height)], thick, colour, flat=True)
        painter.stroke([(left + width, top), (left, top + height)], thick, colour, flat=True)
    for thick, colour in ((0.16, sheet.paint.white), (0.09, sheet.paint.red)):
        painter.stroke([(middle_x, top), (middle_x, top + height)], thick, colour, flat=True)
        painter.stroke([(left, middle_y), (left + width, middle_y)], thick, colour, flat=True)


def _white_cross(painter: Painter, sheet: Sheet) -> None:
    painter.rounded(0.36, 0.08, 0.48, 0.48, 0.02, sheet.paint.red)
    painter.stroke([(0.6, 0.16), (0.6, 0.48)], 0.1, sheet.paint.white, flat=True)
    painter.stroke([(0.44, 0.32), (0.76, 0.32)], 0.1, sheet.paint.white, flat=True)


def info_units(painter: Painter, sheet: Sheet, _: str) -> None:
    """Board behind a border: in which unit signs speak."""
    board(painter, sheet.paint.blue, sheet.paint.white, sheet.paint.blue)
    discs.limit_at(painter, sheet, "", (0.5, 0.27), 0.19)
    unit = "mph" if sheet.country == "GBR" else "km/h"
    write_centred(painter, sheet.letters, unit, Box(0.36, 0.23, 0.28, 0.085), sheet.paint.black)
    words = "speeds in mph" if sheet.country == "GBR" else "km/h"
    write_centred(painter, sheet.letters, words, Box(0.1, 0.53, 0.8, 0.11), sheet.paint.white)


def info_side(painter: Painter, sheet: Sheet, _: str) -> None:
    """Board behind a border: on which side to drive."""
    left = sheet.country == "GBR"
    board(painter, sheet.paint.blue, sheet.paint.white, sheet.paint.blue)
    symbols.arrow_up(painter, Box(0.2 if left else 0.6, 0.09, 0.2, 0.34), sheet.paint.white)
    painter.stroke([(0.5, 0.09), (0.5, 0.43)], 0.03, sheet.paint.white, flat=True)
    words = "drive on left" if left else "drive on right"
    write_centred(painter, sheet.letters, words, Box(0.1, 0.53, 0.8, 0.11), sheet.paint.white)


def one_way(painter: Painter, sheet: Sheet, _: str) -> None:
    """One-way street: a broad arrow on blue."""
    board(painter, sheet.paint.blue, sheet.paint.white, sheet.paint.blue)
    if sheet.country == "GBR":
        symbols.arrow_up(painter, Box(0.1, 0.08, 0.25, 0.44), sheet.paint.white)
        return
    arrow = [(0.06, 0.08), (0.56, 0.08), (0.56, 0.05), (0.75, 0.15), (0.56, 0.25), (0.56, 0.22), (0.06, 0.22)]
    painter.polygon(arrow, sheet.paint.white)
    write_centred(painter, sheet.letters, "Einbahnstraße", Box(0.09, 0.115, 0.5, 0.07), sheet.paint.black)


def crossing(painter: Painter, sheet: Sheet, _: str) -> None:
    """A pedestrian crossing is here: walker in a white triangle on blue."""
    board(painter, sheet.paint.blue, sheet.paint.white, sheet.paint.blue)
    painter.polygon([(0.3, 0.07), (0.55, 0.52), (0.05, 0.52)], sheet.paint.white)
    symbols.zebra(painter, Box(0.18, 0.2, 0.24, 0.3), sheet.paint.black)


def calm_street(painter: Painter, sheet: Sheet, _: str) -> None:
    """Traffic-calmed area: child, adult and house on blue, seen from afar as white shapes."""
    board(painter, sheet.paint.blue, sheet.paint.white, sheet.paint.blue)
    symbols.walker(painter, Box(0.06, 0.16, 0.28, 0.42), sheet.paint.white)
    symbols.walker(painter, Box(0.34, 0.3, 0.2, 0.28), sheet.paint.white)
    symbols.town(painter, Box(0.6, 0.1, 0.34, 0.42), sheet.paint.white)

"""Plates below a sign, and the LED faces of gantries. Face units are metres."""

from itertools import pairwise

import numpy as np

from services.simulator.signart import symbols
from services.simulator.signart.lettering import Box, write_centred
from services.simulator.signart.painter import Image, Painter
from services.simulator.signart.panels import board
from services.simulator.signart.sheet import Sheet

PLATE_M = (0.6, 0.33)
LED_M = (1.1, 1.1)
WET_WORDS = {
    "de": "bei Nässe", "en": "when wet", "fr": "par temps\nde pluie", "nl": "bij nat\nwegdek",
    "pl": "podczas\nopadów",
}  # fmt: skip
_END_WORDS = {"DEU": "Ende", "AUT": "Ende", "GBR": "End", "FRA": "Fin", "NLD": "Einde", "POL": "Koniec",
              "CHE": "Ende", "USA": "END"}  # fmt: skip


def _plate(painter: Painter, sheet: Sheet, words: str) -> None:
    board(painter, sheet.paint.white, sheet.paint.black)
    lines = words.split("\n")
    height = 0.17 if len(lines) == 1 else 0.24 / len(lines) * 0.8
    for index, line in enumerate(lines):
        middle = PLATE_M[1] * (index + 1) / (len(lines) + 1)
        write_centred(painter, sheet.letters, line, Box(0.04, middle - height / 2, 0.52, height), sheet.paint.black)


def when_wet(painter: Painter, sheet: Sheet, language: str) -> None:
    """Only when the road is wet, in the words of a language, or in those of the order."""
    _plate(painter, sheet, sheet.text or WET_WORDS.get(language, WET_WORDS["en"]))


def when_wet_drawn(painter: Painter, sheet: Sheet, _: str) -> None:
    """Only in rain, as a picture."""
    board(painter, sheet.paint.white, sheet.paint.black)
    symbols.rain_cloud(painter, Box(0.15, 0.04, 0.3, 0.25), sheet.paint.black)


def words(painter: Painter, sheet: Sheet, default: str) -> None:
    """A plate with the text of the order (a distance, a time)."""
    _plate(painter, sheet, sheet.text or default)


def length(painter: Painter, sheet: Sheet, default: str) -> None:
    """For how far the sign above holds: a length between two arrows ahead."""
    board(painter, sheet.paint.white, sheet.paint.black)
    for left in (0.02, 0.44):
        symbols.arrow(painter, Box(left, 0.06, 0.14, 0.21), sheet.paint.black, 0)
    write_centred(painter, sheet.letters, sheet.text or default, Box(0.16, 0.1, 0.28, 0.13), sheet.paint.black)


def arrow(painter: Painter, sheet: Sheet, way: str) -> None:
    """Which way or lane the sign above is for; the order's text ``bent`` draws an arrow that turns off."""
    board(painter, sheet.paint.white, sheet.paint.black)
    side = {"left": -1.0, "right": 1.0}.get(way, 0.0)
    if not side:
        symbols.arrow(painter, Box(0.16, 0.035, 0.28, 0.26), sheet.paint.black, 0)
        return
    bent = sheet.text == "bent"
    tail = [(-0.17, 0.28), (-0.17, 0.15), (0.08, 0.15)] if bent else [(-0.23, 0.165), (0.08, 0.165)]
    middle = tail[-1][1]
    points = [(0.3 + side * x, y) for x, y in tail]
    for start, stop in pairwise(points):
        painter.stroke([start, stop], 0.065, sheet.paint.black, flat=not bent)
    head = [(0.06, middle - 0.11), (0.25, middle), (0.06, middle + 0.11)]
    painter.polygon([(0.3 + side * x, y) for x, y in head], sheet.paint.black)


def lorries(painter: Painter, sheet: Sheet, _: str) -> None:
    """Only for lorries: a picture, or the words of the order."""
    if sheet.text:
        _plate(painter, sheet, sheet.text)
        return
    board(painter, sheet.paint.white, sheet.paint.black)
    symbols.lorry(painter, Box(0.1, 0.07, 0.4, 0.19), sheet.paint.black)


def end(painter: Painter, sheet: Sheet, _: str) -> None:
    """What the sign above says ends here."""
    _plate(painter, sheet, _END_WORDS.get(sheet.country, "End"))


def led(painter: Painter, sheet: Sheet, value: str) -> None:
    """A gantry face: lamps on black. Known words have pictures, anything else is a limit in a red ring."""
    painter.rounded(0, 0, *LED_M, 0.03, (16, 16, 18))
    _LED_PICTURES.get(value, _led_limit)(painter, sheet, value)


_LAMP_WHITE, _LAMP_RED, _LAMP_GREEN = (255, 250, 235), (255, 40, 30), (40, 255, 120)
_CENTRE = LED_M[0] / 2


def _led_limit(painter: Painter, sheet: Sheet, value: str) -> None:
    painter.stroke(symbols.curve((_CENTRE, _CENTRE), 0.455, 0, 360), 0.1, _LAMP_RED)
    width, height = (0.56, 0.38) if len(value) < 3 else (0.66, 0.34)
    box = Box(_CENTRE - width / 2, _CENTRE - height / 2, width, height)
    write_centred(painter, sheet.letters, value, box, _LAMP_WHITE)


def _led_blank(painter: Painter, sheet: Sheet, value: str) -> None:
    """Switched off: nothing lit."""


def _led_closed(painter: Painter, sheet: Sheet, value: str) -> None:
    for ends in ([(0.25, 0.25), (0.85, 0.85)], [(0.85, 0.25), (0.25, 0.85)]):
        painter.stroke(ends, 0.13, _LAMP_RED, flat=True)


def _led_open(painter: Painter, sheet: Sheet, value: str) -> None:
    symbols.arrow(painter, Box(0.22, 0.2, 0.66, 0.7), _LAMP_GREEN, 180)


def _led_end(painter: Painter, sheet: Sheet, value: str) -> None:
    painter.stroke(symbols.curve((_CENTRE, _CENTRE), 0.455, 0, 360), 0.05, _LAMP_WHITE)
    for offset in (-0.09, 0.0, 0.09):
        painter.stroke([(0.83 + offset, 0.27 + offset), (0.27 + offset, 0.83 + offset)], 0.045, _LAMP_WHITE, flat=True)


def _led_symbol(painter: Painter, sheet: Sheet, value: str) -> None:
    painter.stroke([(_CENTRE, 0.12), (1.0, 0.92), (0.1, 0.92), (_CENTRE, 0.12)], 0.08, _LAMP_RED)
    _LED_SYMBOLS[value](painter, Box(0.34, 0.4, 0.42, 0.44), _LAMP_WHITE)


_LED_SYMBOLS = {"congestion": symbols.queue, "slippery": symbols.skid}
_LED_PICTURES = {
    "blank": _led_blank,
    "lane_closed": _led_closed,
    "lane_open": _led_open,
    "end": _led_end,
    **dict.fromkeys(_LED_SYMBOLS, _led_symbol),
}


def lamp_grid(picture: Image, lamps: int) -> Image:
    """Turn a drawn LED face into points of light: ``lamps`` across, dark between; small pictures stay smooth."""
    height, width = picture.shape[:2]
    pitch = width / lamps
    if pitch < 3:
        return picture
    rows, columns = np.mgrid[0:height, 0:width]
    distance = np.hypot((columns % pitch) / pitch - 0.5, (rows % pitch) / pitch - 0.5)
    glow = np.clip(1.25 - 1.6 * distance, 0.25, 1.0)[..., None]
    lit = picture.copy()
    lit[..., :3] = (picture[..., :3] * glow).astype(np.uint8)
    return lit

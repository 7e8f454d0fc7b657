"""Our own single-stroke letters: digits, capitals, small letters and the few marks that signs need.

A glyph is an advance width and strokes on a grid whose cap height is 10 units (y down, baseline at 10, x-height at 3,
descenders to 13). A stroke is a list of points; ``arc`` samples one. The table is ``glyphs.toml``. Weight, width and
slant come from the style (see ``lettering``), so one table serves every face and no font file is needed.
"""

import math
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

Point = tuple[float, float]
Stroke = list[Point]


class Glyph(NamedTuple):
    """One character: advance width and strokes, in grid units."""

    width: float
    strokes: list[Stroke]


def arc(cx: float, cy: float, rx: float, ry: float, start_deg: float, end_deg: float) -> Stroke:
    """Points of an elliptic arc; 0 degrees points right, 90 down."""
    count = max(3, int(abs(end_deg - start_deg) / 15))
    angles = [math.radians(start_deg + (end_deg - start_deg) * i / count) for i in range(count + 1)]
    return [(cx + rx * math.cos(a), cy + ry * math.sin(a)) for a in angles]


def _glyph(row: list[Any]) -> Glyph:
    """A glyph from its row in the table: width, then strokes of points and arcs."""
    width, *strokes = row
    return Glyph(width, [_stroke(parts) for parts in strokes])


def _stroke(parts: list[list[float]]) -> Stroke:
    points: Stroke = []
    for part in parts:
        points += arc(*part) if len(part) == 6 else [(part[0], part[1])]
    return points


def _with_marks_above(table: dict[str, Glyph]) -> dict[str, Glyph]:
    """Umlauts and acute vowels, built from their base letter."""
    built: dict[str, Glyph] = {}
    for letter, base in {"ä": "a", "ö": "o", "ü": "u", "Ä": "A", "Ö": "O", "Ü": "U"}.items():
        glyph, top = table[base], 0.6 if base.islower() else -1.8
        middle = glyph.width / 2
        dots = [[(middle + side, top), (middle + side, top + 0.1)] for side in (-1.3, 1.3)]
        built[letter] = Glyph(glyph.width, [*glyph.strokes, *dots])
    for letter, base in {"é": "e", "è": "e", "à": "a", "ó": "o", "ń": "n", "ś": "s", "ć": "c"}.items():
        lean = -1.0 if letter in "èà" else 1.0
        glyph, middle = table[base], table[base].width / 2
        built[letter] = Glyph(glyph.width, [*glyph.strokes, [(middle - lean, 2.0), (middle + lean, 0.4)]])
    return built


def _turned(glyph: Glyph) -> Glyph:
    """A glyph turned upside down: a 6 becomes a 9."""
    return Glyph(glyph.width, [[(6 - x, 10 - y) for x, y in stroke] for stroke in glyph.strokes])


def _table() -> dict[str, Glyph]:
    table = {char: _glyph(row) for char, row in _ROWS["glyphs"].items()}
    table["9"] = _turned(table["6"])
    return {**table, **_with_marks_above(table)}


_ROWS = tomllib.loads(Path(__file__).with_name("glyphs.toml").read_text(encoding="utf-8"))
GLYPHS: dict[str, Glyph] = _table()
ALTERNATES: dict[str, Glyph] = {char: _glyph(row) for char, row in _ROWS["alternates"].items()}
"""Other shapes in which some digits are written."""

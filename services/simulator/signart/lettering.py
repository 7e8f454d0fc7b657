"""Writing on a face: twelve stroke styles of our own; training adds others through the same protocol."""

from typing import NamedTuple, Protocol

from services.simulator.signart.glyphs import ALTERNATES, GLYPHS, Glyph
from services.simulator.signart.painter import Colour, Painter


class Lettering(Protocol):
    """Something that can write a line of text into a box."""

    def aspect(self, text: str) -> float:
        """Width of the text divided by its cap height."""

    def write(self, painter: Painter, text: str, box: "Box", colour: Colour) -> None:
        """Write the text so that its capitals fill the box."""


class Box(NamedTuple):
    """Where capitals stand: left, top, width, height in face units."""

    x: float
    y: float
    width: float
    height: float


class StrokeStyle(NamedTuple):
    """How our strokes become letters: stroke weight (share of cap height), width factor, gap between letters, slant.

    ``alternates`` names the characters that take their other shape.
    """

    weight: float
    width: float
    gap: float
    slant: float = 0.0
    alternates: str = ""


class StrokeLettering:
    """Letters drawn from the glyph table in one style."""

    def __init__(self, style: StrokeStyle) -> None:
        self.style = style

    def aspect(self, text: str) -> float:
        """Width over cap height, stroke thickness included."""
        inner = sum(self._advance(char) for char in text) - self.style.gap
        return (inner + self.style.weight * 10) / (10 + self.style.weight * 10)

    def write(self, painter: Painter, text: str, box: Box, colour: Colour) -> None:
        """Write the text into the box; characters without a glyph are left out."""
        thick_units = self.style.weight * 10
        scale_y = box.height / (10 + thick_units)
        width_units = sum(self._advance(char) for char in text) - self.style.gap + thick_units
        scale_x = box.width / max(width_units, 1e-6)
        thickness, x = self.style.weight * 10 * min(scale_x, scale_y), thick_units / 2
        for char in text:
            for stroke in self._glyph(char).strokes:
                across = [x + px * self.style.width + self.style.slant * (10 - py) for px, py in stroke]
                down = [py + thick_units / 2 for _, py in stroke]
                points = [(box.x + scale_x * u, box.y + scale_y * v) for u, v in zip(across, down, strict=True)]
                painter.stroke(points, thickness, colour)
            x += self._advance(char)

    def _advance(self, char: str) -> float:
        return self._glyph(char).width * self.style.width + self.style.weight * 10 + self.style.gap

    def _glyph(self, char: str) -> Glyph:
        if char in self.style.alternates:
            return ALTERNATES.get(char, GLYPHS[" "])
        return GLYPHS.get(char, GLYPHS[" "])


# The first stands in for DIN-like letters, the second for the rounder ones of British signs; the rest is variety.
STYLES: tuple[StrokeStyle, ...] = (
    StrokeStyle(0.150, 0.92, 0.75),
    StrokeStyle(0.165, 1.05, 0.70),
    StrokeStyle(0.135, 0.78, 0.70),
    StrokeStyle(0.185, 0.95, 0.60),
    StrokeStyle(0.120, 0.95, 0.95),
    StrokeStyle(0.165, 0.82, 0.50),
    StrokeStyle(0.205, 1.00, 0.50),
    StrokeStyle(0.140, 1.12, 0.90),
    StrokeStyle(0.155, 0.90, 0.70, 0.04),
    StrokeStyle(0.175, 0.88, 0.80),
    StrokeStyle(0.130, 0.86, 1.05),
    StrokeStyle(0.190, 0.80, 0.60),
)


def lettering(font: int, country: str) -> Lettering:
    """The style of a font number; 0 is the country's own."""
    home = 1 if country == "GBR" else 0
    return StrokeLettering(STYLES[home if font == 0 else font % len(STYLES)])


def write_centred(painter: Painter, letters: Lettering, text: str, box: Box, colour: Colour) -> None:
    """Write one line as large as fits, centred in the box; text is squeezed rather than cut."""
    if not text.strip():
        return
    aspect = max(letters.aspect(text), 1e-3)
    height = min(box.height, box.width / aspect)
    if height < 0.6 * box.height:  # long words: narrower letters before tiny ones
        height = min(box.height, 1.25 * height)
    width = min(box.width, height * aspect)
    inner = Box(box.x + (box.width - width) / 2, box.y + (box.height - height) / 2, width, height)
    letters.write(painter, text, inner, colour)

"""Upright things at the roadside that a detector takes for people: bollards, marker posts, bins, boards, cones, meters, columns."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from services.simulator.render.models.mesh import Builder, Colour, Material

STYLES = 10
"""How many styles there are; the look seed modulo this is the style."""
PALE: Colour = (0.93, 0.93, 0.92)
DARK: Colour = (0.08, 0.08, 0.09)
GREY: Colour = (0.5, 0.51, 0.52)
Chance = np.random.Generator


def street_furniture(builder: Builder, height: float, seed: int) -> None:
    """One thing at the origin, its front along x; a height (m) of zero is drawn by the seed."""
    rng = np.random.default_rng((84, seed))
    draw, low, high = _STYLES[seed % STYLES]
    draw(builder, height or float(rng.uniform(low, high)), rng)


def _paint(rng: Chance) -> Colour:
    """A colour that such things have: white, grey, dark, or a bright one."""
    if rng.uniform() < 0.5:
        return (PALE, GREY, DARK, (0.35, 0.27, 0.2))[int(rng.integers(4))]
    bright = rng.uniform(0.05, 1.0, size=3)
    return (float(bright[0]), float(bright[1]), float(bright[2]))


def _bollard(builder: Builder, height: float, rng: Chance) -> None:
    radius, paint = float(rng.uniform(0.04, 0.16)), _paint(rng)
    builder.tube((0, 0, 0), (0, 0, height), radius, paint, radius * float(rng.uniform(0.7, 1.0)))
    builder.ball((0, 0, height), radius * float(rng.uniform(0.7, 1.2)), paint)
    low = height * float(rng.uniform(0.5, 0.85))
    builder.tube((0, 0, low), (0, 0, low + 0.12), radius * 1.03, _paint(rng), material=Material.RETRO)


def _marker(builder: Builder, height: float, rng: Chance) -> None:
    wide, plate = float(rng.uniform(0.08, 0.5)), float(rng.uniform(0.3, 0.9)) * height
    builder.tube((-0.03, 0, 0), (-0.03, 0, height), 0.03, GREY)
    middle, cells = height - plate / 2, int(rng.integers(1, 5))
    builder.box((0, 0, middle), (0.02, wide, plate), _paint(rng))
    paint, step = _paint(rng), plate / cells
    for cell in range(cells):
        z0 = height - plate + cell * step
        corners = [(0.012, y, z) for y, z in ((-wide / 2, z0), (wide / 2, z0), (wide / 2, z0 + step / 2))]
        builder.quad([*corners, (0.012, -wide / 2, z0 + step / 2)], paint, 0, Material.RETRO)


def _bin(builder: Builder, height: float, rng: Chance) -> None:
    radius, paint = float(rng.uniform(0.18, 0.35)), _paint(rng)
    if rng.uniform() < 0.5:
        builder.tube((0, 0, 0), (0, 0, height * 0.85), radius * 0.85, paint, radius, 12)
        builder.ball((0, 0, height * 0.85), (radius, radius, height * 0.15), _paint(rng))
    else:
        builder.box((0, 0, height * 0.45), (radius * 1.7, radius * 1.7, height * 0.9), paint)
        builder.box((0, 0, height * 0.95), (radius * 1.9, radius * 1.9, height * 0.1), _paint(rng))


def _board(builder: Builder, height: float, rng: Chance) -> None:
    wide = float(rng.uniform(0.45, 0.9))
    for sense in (1.0, -1.0):
        feet, paint = sense * 0.3, _paint(rng)
        corners = [(feet, -wide / 2, 0.04), (feet, wide / 2, 0.04), (0, wide / 2, height), (0, -wide / 2, height)]
        builder.quad(corners, paint)
    lines = int(rng.integers(0, 5))
    for line in range(lines):
        z = height * (0.3 + 0.6 * line / max(lines, 1))
        builder.box((0.31 * (1 - z / height), 0, z), (0.02, wide * float(rng.uniform(0.3, 0.8)), 0.06), _paint(rng))


def _cabinet(builder: Builder, height: float, rng: Chance) -> None:
    deep, wide = float(rng.uniform(0.25, 0.5)), float(rng.uniform(0.35, 1.2))
    builder.box((0, 0, height / 2), (deep, wide, height), _paint(rng))
    builder.box((0, 0, height), (deep + 0.06, wide + 0.06, 0.05), GREY)


def _meter(builder: Builder, height: float, rng: Chance) -> None:
    builder.tube((0, 0, 0), (0, 0, height), float(rng.uniform(0.03, 0.07)), _paint(rng))
    head = (float(rng.uniform(0.1, 0.3)), float(rng.uniform(0.15, 0.4)), float(rng.uniform(0.2, 0.5)))
    builder.box((0, 0, height - head[2] / 2), head, _paint(rng))


def _cone(builder: Builder, height: float, rng: Chance) -> None:
    paint = (0.95, 0.35, 0.08) if rng.uniform() < 0.7 else _paint(rng)
    builder.box((0, 0, 0.02), (height * 0.55, height * 0.55, 0.04), DARK)
    for low, high, colour in ((0.0, 0.35, paint), (0.35, 0.6, PALE), (0.6, 1.0, paint)):
        radii = (0.2 * height * (1 - 0.8 * low), 0.2 * height * (1 - 0.8 * high))
        builder.tube((0, 0, low * height), (0, 0, high * height), radii[0], colour, radii[1])


def _column(builder: Builder, height: float, rng: Chance) -> None:
    radius = float(rng.uniform(0.25, 0.7))
    bands = int(rng.integers(1, 5))
    for band in range(bands):
        low, high = height * band / bands, height * (band + 1) / bands
        builder.tube((0, 0, low), (0, 0, high), radius, _paint(rng), sides=14)
    builder.ball((0, 0, height), (radius * 1.1, radius * 1.1, 0.2), _paint(rng))


def _flag(builder: Builder, height: float, rng: Chance) -> None:
    wide, low = float(rng.uniform(0.4, 0.8)), float(rng.uniform(0.2, 0.8))
    builder.tube((0, 0, 0), (0, 0, height), 0.02, DARK)
    middle = low + (height - low) * float(rng.uniform(0.3, 0.7))
    for z0, z1 in ((low, middle), (middle, height)):
        builder.box((0, wide / 2, (z0 + z1) / 2), (0.01, wide, z1 - z0), _paint(rng))


def _hydrant(builder: Builder, height: float, rng: Chance) -> None:
    paint, radius = _paint(rng), float(rng.uniform(0.1, 0.18))
    builder.tube((0, 0, 0), (0, 0, height * 0.75), radius, paint, sides=10)
    builder.ball((0, 0, height * 0.75), (radius, radius, height * 0.25), _paint(rng))
    builder.tube((0, -radius * 1.8, height * 0.55), (0, radius * 1.8, height * 0.55), radius * 0.5, paint)


_STYLES: tuple[tuple[Callable[[Builder, float, Chance], None], float, float], ...] = (
    (_bollard, 0.5, 1.3),
    (_marker, 0.8, 2.2),
    (_bin, 0.7, 1.4),
    (_board, 0.8, 1.6),
    (_cabinet, 0.8, 1.7),
    (_meter, 1.1, 2.0),
    (_cone, 0.5, 1.0),
    (_column, 1.6, 3.6),
    (_flag, 1.8, 3.8),
    (_hydrant, 0.6, 1.1),
)
"""How each is drawn, and its least and greatest height, m."""

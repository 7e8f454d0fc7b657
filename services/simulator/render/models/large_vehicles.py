"""Lorries, buses and motorcycles."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from services.simulator.render.models.car_body import (
    AMBER,
    GLASS,
    HEAD,
    RUBBER,
    TAIL,
    end_quad,
    flank,
    plate,
    rear_plate,
    wheel,
)
from services.simulator.render.models.cars import pick_paint
from services.simulator.render.models.mesh import Builder, Colour, Material
from services.simulator.render.models.textures import Layer

Size = tuple[float, float, float]


def lorry(builder: Builder, family: int, rng: np.random.Generator, size_m: Size) -> None:
    """Families: box body, tarpaulin, tank, tipper."""
    length, width, height = size_m
    cab = min(2.1, length * 0.3)
    paint = pick_paint(rng)
    _cab(builder, length, width, height * (0.78 if family % 4 else 0.86), cab, paint)
    builder.box((-cab / 2, 0, 0.78), (length - cab, width * 0.4, 0.3), (0.12, 0.12, 0.13))
    _LOADS[family % 4](builder, rng, length - cab - 0.35, width, height, -length / 2)
    radius = 0.5
    axles = [length / 2 - cab * 0.55, -length / 2 + 1.0]
    axles += [-length / 2 + 2.3] if length > 8.5 else []
    for x in axles:
        for side in (1.0, -1.0):
            wheel(builder, x, side, width * 0.97, radius)
    builder.box((-length / 2 + 0.08, 0, 0.62), (0.12, width * 0.94, 0.16), (0.2, 0.2, 0.21))
    for y in (width * 0.42, -width * 0.42):
        builder.box((0, y, 0.7), (length * 0.35, 0.05, 0.4), (0.25, 0.25, 0.26))
    _rear_lamps(builder, -length / 2, width, 0.80, rng)


def _cab(builder: Builder, length: float, width: float, height: float, cab: float, paint: Colour) -> None:
    x0, x1, half, rake = length / 2 - cab, length / 2, width / 2, 0.12
    front = [(x1, 0.55), (x1, height * 0.55), (x1 - rake, height * 0.95), (x1 - 0.3, height)]
    outline = [(x0, 0.55), *front, (x0, height)]
    for side in (1.0, -1.0):
        points = [(x, side * half, z) for x, z in outline]
        fan = [(0, k, k + 1) for k in range(1, len(points) - 1)]
        uv = [((x - x0) / cab, z / height) for x, z in outline]
        builder.add(points, (0, side, 0), uv, fan, paint, Layer.PAINT, Material.PAINT)
        z0, z1, y = height * 0.56, height * 0.86, side * (half + 0.006)
        pane = [(x0 + 0.3, y, z0), (x1 - 0.12, y, z0), (x1 - 0.2, y, z1), (x0 + 0.3, y, z1)]
        builder.quad(pane, GLASS, 0, Material.GLASS, normal=(0, side, 0))
        builder.box((x1 - 0.05, side * (half + 0.16), height * 0.72), (0.1, 0.22, 0.55), (0.1, 0.1, 0.1))
        builder.box((x1 - 0.3, side * (half - 0.01), 0.6), (0.5, 0.04, 0.25), (0.15, 0.15, 0.16))
    rows = np.array([[(x, half, z), (x, -half, z)] for x, z in outline[1:]])
    builder.grid(rows[:2], paint, Layer.CAR_FRONT, Material.PAINT, [[(0, 0), (1, 0)], [(0, 1), (1, 1)]], (x0, 0, 1))
    builder.grid(rows[1:3], GLASS, 0, Material.GLASS, None, (x0, 0, 1))
    builder.grid(rows[2:], paint, Layer.PAINT, Material.PAINT, None, (x0, 0, 1))
    for y in (half * 0.93, -half * 0.93):
        inner = y * 0.7
        end_quad(builder, x1 + 0.01, 1, (y, inner), (0.72, 0.92), HEAD, Material.HEAD)
        end_quad(builder, x1 + 0.01, 1, (y, inner), (0.94, 1.0), AMBER, Material.LEFT if y > 0 else Material.RIGHT)
    plate(builder, x1 + 0.012, 1, (0.62, 0.74), Layer.PLATE_WHITE)


def _box_load(
    builder: Builder, rng: np.random.Generator, length: float, width: float, height: float, rear: float
) -> None:
    colour = (0.92, 0.92, 0.91) if rng.uniform() < 0.6 else pick_paint(rng)
    builder.box((rear + length / 2, 0, (height + 0.95) / 2), (length, width, height - 0.95), colour, Layer.PAINT)
    y, band = width / 2 + 0.006, pick_paint(rng)
    z0 = float(rng.uniform(1.3, 2.0))
    for side in (1.0, -1.0):
        corners = flank((rear, rear + length), side * y, (z0, z0 + 0.7))
        builder.quad(corners, band, Layer.PAINT, normal=(0, side, 0))
    for y0 in (-0.02, width * 0.46, -width * 0.49):
        end_quad(builder, rear - 0.01, -1, (y0, y0 + 0.05), (1.0, height - 0.05), (0.35, 0.35, 0.36), Material.METAL)


def _tarpaulin(
    builder: Builder, rng: np.random.Generator, length: float, width: float, height: float, rear: float
) -> None:
    colour = pick_paint(rng)
    builder.box((rear + length / 2, 0, (height + 1.0) / 2), (length, width, height - 1.0), colour, Layer.TARPAULIN)
    builder.box((rear + length / 2, 0, 1.0), (length, width * 1.005, 0.14), (0.3, 0.3, 0.31))
    across = (-width * 0.47, width * 0.47)
    end_quad(builder, rear - 0.012, -1, across, (0.95, 1.10), (1, 1, 1), Material.RETRO, Layer.STRIPES)
    r, g, b = np.clip(np.array(colour) * 0.6, 0, 1).tolist()
    end_quad(builder, rear - 0.01, -1, (-0.03, 0.03), (1.1, height - 0.1), (r, g, b), Material.PLAIN)


def _tank(builder: Builder, rng: np.random.Generator, length: float, width: float, height: float, rear: float) -> None:
    radius = min(width / 2, (height - 1.0) / 2)
    z = height - radius
    colour = (0.78, 0.79, 0.81) if rng.uniform() < 0.6 else pick_paint(rng)
    ends = (rear + 0.25, 0, z), (rear + length - 0.1, 0, z)
    builder.tube(*ends, radius, colour, sides=18, material=Material.PAINT, layer=Layer.PAINT)
    builder.ball((rear + 0.25, 0, z), (0.25, radius, radius), colour, rows=7, sides=14, material=Material.PAINT)
    builder.box((rear + length / 2, 0, 1.0), (length, width * 0.8, 0.12), (0.25, 0.25, 0.26))
    end_quad(builder, rear - 0.01, -1, (-0.25, 0.25), (z - 0.18, z + 0.18), (0.95, 0.5, 0.08), Material.RETRO)


def _tipper(
    builder: Builder, rng: np.random.Generator, length: float, width: float, height: float, rear: float
) -> None:
    colour, top = pick_paint(rng), height - 0.45
    builder.box((rear + length / 2, 0, (top + 1.0) / 2), (length, width, top - 1.0), colour, Layer.TARPAULIN)
    for x in np.linspace(rear + 0.1, rear + length - 0.1, 6):
        for side in (1.0, -1.0):
            builder.box((x, side * width / 2, (top + 1.0) / 2), (0.1, 0.08, top - 1.0), colour)
    radii = (length * 0.46, width * 0.45, 0.5)
    builder.ball((rear + length / 2, 0, top - 0.05), radii, (0.42, 0.34, 0.25), layer=Layer.CLOTH)


_LOADS = (_box_load, _tarpaulin, _tank, _tipper)


def _rear_lamps(builder: Builder, x: float, width: float, z: float, rng: np.random.Generator) -> None:
    lamp = (z - 0.09, z + 0.09)
    for side, indicator in ((1.0, Material.LEFT), (-1.0, Material.RIGHT)):
        outer = side * width * 0.47
        end_quad(builder, x - 0.015, -1, (outer, outer - side * 0.16), lamp, AMBER, indicator)
        end_quad(builder, x - 0.015, -1, (outer - side * 0.17, outer - side * 0.45), lamp, TAIL, Material.TAIL)
    plate(builder, x - 0.016, -1, (z - 0.06, z + 0.06), rear_plate(rng))


def bus(builder: Builder, family: int, rng: np.random.Generator, size_m: Size) -> None:
    """Families: city bus, coach, double-decker, round old bus."""
    length, width, height = size_m
    kind = family % 4
    paint, second = pick_paint(rng), pick_paint(rng)
    x, half = length / 2, width / 2
    inset = 0.25 if kind == 3 else 0.08
    wall = [(half * 0.97, 0.32), (half, 0.45), (half, height * 0.5)]
    ring = np.array([*wall, (half - inset * 0.3, height - inset * 1.5), (half - inset, height - 0.04), (0, height)])
    for side in (1.0, -1.0):
        rows = np.array([[(s * x, side * y, z) for y, z in ring] for s in (1.0, 0.5, 0.0, -0.5, -1.0)])
        builder.grid(rows, paint, Layer.PAINT, Material.PAINT, None, (0, 0, height / 2))
        low = 0.55 if kind == 1 else 0.38
        floors = [(low, low + 0.34)] if kind != 2 else [(0.26, 0.46), (0.62, 0.84)]
        for z0, z1 in floors:
            _window_row(builder, length, side, half + 0.012, z0 * height, z1 * height, 7 if kind == 1 else 6)
        band = flank((-x, x), side * (half + 0.008), (0.6, 1.0))
        builder.quad(band, second, Layer.PAINT, Material.PAINT, normal=(0, side, 0))
        for axle in (x - 2.4, -x + 2.8):
            wheel(builder, axle, side, width, 0.48)
    for sense in (1.0, -1.0):
        outline = np.array([(sense * x, y, z) for y, z in ring] + [(sense * x, -y, z) for y, z in ring[-2::-1]])
        uv = np.stack([0.5 + outline[:, 1] / width, outline[:, 2] / height], axis=1)
        fan = [(0, k, k + 1) for k in range(1, len(outline) - 1)]
        builder.add(outline, (sense, 0, 0), uv, fan, paint, Layer.PAINT, Material.PAINT)
        z0 = (0.36 if sense > 0 else 0.52) * height
        for out, share, z, colour, material in (
            (0.01, 0.9, (z0, height * 0.82), GLASS, Material.GLASS),
            (0.012, 0.6, (height * 0.86, height * 0.95), (0.08, 0.08, 0.06), Material.PLAIN),
            (0.014, 0.4, (height * 0.885, height * 0.925), (0.95, 0.6, 0.1), Material.STREET),
        ):
            end_quad(builder, sense * (x + out), sense, (-half * share, half * share), z, colour, material)
        builder.box((sense * (x - 0.03), 0, 0.45), (0.1, width * 0.98, 0.3), (0.13, 0.13, 0.14))
    _bus_lamps(builder, x, half, rng)


def _window_row(builder: Builder, length: float, side: float, y: float, z0: float, z1: float, panes: int) -> None:
    edges = np.linspace(-length / 2 + 0.25, length / 2 - 0.2, panes + 1)
    for a, b in pairwise(edges):
        pane = flank((a + 0.04, b - 0.04), side * y, (z0, z1))
        builder.quad(pane, GLASS, 0, Material.GLASS, normal=(0, side, 0))


def _bus_lamps(builder: Builder, x: float, half: float, rng: np.random.Generator) -> None:
    for side, indicator in ((1.0, Material.LEFT), (-1.0, Material.RIGHT)):
        outer = side * half * 0.95
        end_quad(builder, -x - 0.02, -1, (outer, outer - side * 0.16), (0.85, 1.25), TAIL, Material.TAIL)
        end_quad(builder, -x - 0.02, -1, (outer, outer - side * 0.16), (1.28, 1.45), AMBER, indicator)
        end_quad(builder, x + 0.02, 1, (outer, outer - side * 0.4), (0.68, 0.88), HEAD, Material.HEAD)
        end_quad(builder, x + 0.02, 1, (outer, outer - side * 0.4), (0.9, 0.98), AMBER, indicator)
    plate(builder, -x - 0.022, -1, (0.7, 0.82), rear_plate(rng))


def motorcycle(builder: Builder, family: int, rng: np.random.Generator, size_m: Size) -> None:
    """With its rider. Families: sport, tourer with cases, scooter, chopper."""
    length, _, height = size_m
    kind, paint = family % 4, pick_paint(rng)
    radius = (0.31, 0.32, 0.24, 0.33)[kind]
    rear, front = -length / 2 + radius, length / 2 - radius
    for x in (rear, front):
        for side in (0.06, -0.06):
            builder.disc((x, side, radius), (0, np.sign(side), 0), radius, (1, 1, 1), 16, Layer.WHEEL)
        builder.tube((x, -0.06, radius), (x, 0.06, radius), radius, RUBBER, sides=16)
    seat = (0.80, 0.82, 0.74, 0.70)[kind]
    builder.ball((0.02, 0, 0.48), (0.34, 0.17, 0.24), (0.16, 0.16, 0.17), material=Material.METAL)
    builder.ball((0.22, 0, seat + 0.08), (0.30, 0.16, 0.15), paint, material=Material.PAINT)
    builder.ball((-0.42, 0, seat), (0.40, 0.14, 0.08), (0.08, 0.08, 0.08))
    builder.ball((rear - 0.02, 0, seat - 0.08), (0.26, 0.11, 0.12), paint, material=Material.PAINT)
    builder.tube((front, 0.05, radius), (front - 0.28, 0.05, seat + 0.22), 0.035, (0.5, 0.5, 0.52))
    builder.tube((front - 0.28, -0.36, seat + 0.24), (front - 0.28, 0.36, seat + 0.24), 0.02, (0.1, 0.1, 0.1))
    if kind in (0, 2):
        radii = (0.2, 0.2 if kind == 0 else 0.24, 0.3)
        builder.ball((front - 0.15, 0, seat + 0.05), radii, paint, material=Material.PAINT)
    if kind == 1:
        for side in (0.30, -0.30):
            builder.box((rear - 0.05, side, 0.68), (0.45, 0.2, 0.36), (0.12, 0.12, 0.13))
        builder.box((rear - 0.12, 0, seat + 0.28), (0.35, 0.4, 0.3), (0.12, 0.12, 0.13))
    end_quad(builder, -length / 2 + 0.03, -1, (-0.07, 0.07), (seat - 0.10, seat - 0.02), TAIL, Material.TAIL)
    low = (seat - 0.34, seat - 0.18)
    end_quad(builder, -length / 2 + 0.02, -1, (-0.10, 0.10), low, (1, 1, 1), Material.RETRO, Layer.PLATE_WHITE)
    end_quad(builder, front - 0.05, 1, (-0.09, 0.09), (seat + 0.02, seat + 0.16), HEAD, Material.HEAD)
    for side, material in ((1.0, Material.LEFT), (-1.0, Material.RIGHT)):
        builder.ball((rear - 0.1, side * 0.2, seat - 0.08), 0.035, AMBER, 4, 6, material=material)
    _rider(builder, rng, seat, height, front - 0.28)


def _rider(builder: Builder, rng: np.random.Generator, seat: float, height: float, bar_x: float) -> None:
    jacket = (0.10, 0.10, 0.11) if rng.uniform() < 0.5 else pick_paint(rng)
    trousers, helmet = (0.12, 0.13, 0.16), pick_paint(rng)
    head = height - 0.15
    shoulder = head - 0.27
    builder.tube((-0.28, 0, seat), (-0.06, 0, shoulder), 0.17, jacket, 0.20, 10, Layer.CLOTH)
    builder.ball((-0.06, 0, shoulder), (0.15, 0.23, 0.12), jacket, layer=Layer.CLOTH)
    builder.ball((0.02, 0, head), (0.15, 0.13, 0.15), helmet, material=Material.PAINT)
    builder.ball((0.09, 0, head), (0.10, 0.11, 0.06), (0.05, 0.05, 0.06), material=Material.GLASS)
    for side in (1.0, -1.0):
        elbow, knee = (bar_x * 0.5, side * 0.32, (shoulder + seat) / 2 + 0.1), (0.18, side * 0.19, seat - 0.08)
        builder.tube((-0.04, side * 0.22, shoulder), elbow, 0.06, jacket, layer=Layer.CLOTH)
        builder.tube(elbow, (bar_x, side * 0.32, seat + 0.25), 0.05, jacket, layer=Layer.CLOTH)
        builder.tube((-0.25, side * 0.13, seat + 0.04), knee, 0.09, trousers, 0.075, layer=Layer.CLOTH)
        builder.tube(knee, (-0.08, side * 0.2, 0.36), 0.07, trousers, 0.055, layer=Layer.CLOTH)
        builder.ball((-0.02, side * 0.2, 0.32), (0.14, 0.05, 0.06), (0.06, 0.06, 0.06))

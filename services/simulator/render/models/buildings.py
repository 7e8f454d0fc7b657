"""Houses with gables and windows, towers, street furniture."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from services.simulator.render.models.mesh import Builder, Colour, Material
from services.simulator.render.models.textures import Layer
from services.simulator.scene.solids import LIGHT_HEAD_M, LIGHT_POLE_M, MARKER_POST_M, SIGN_POLE_M

STOREY_M, BAY_M = 2.9, 3.2
WALLS: tuple[Colour, ...] = (
    (1.0, 1.0, 1.0), (0.98, 0.93, 0.80), (0.93, 0.84, 0.72), (0.85, 0.88, 0.90), (0.95, 0.80, 0.72), (0.82, 0.80, 0.76),
)  # fmt: skip
ROOFS: tuple[Colour, ...] = ((0.62, 0.30, 0.22), (0.50, 0.26, 0.20), (0.32, 0.32, 0.35), (0.42, 0.36, 0.32))
STEEL: Colour = (0.55, 0.57, 0.58)


def house(builder: Builder, length: float, width: float, height: float, seed: int) -> None:
    """A gabled house; front along x. Zero sizes are chosen by the seed."""
    rng = np.random.default_rng((81, seed))
    depth = length or float(rng.uniform(8, 12))
    wide = width or float(rng.uniform(9, 16))
    eaves = (height or float(rng.choice([1, 2, 2, 3])) * STOREY_M + 0.4 + 0.28 * depth) - 0.28 * depth
    style = int(rng.integers(5))
    if style == 4:
        _barn(builder, depth, wide, eaves, rng)
    else:
        brick = style in (0, 1)
        tint = (1.0, 0.97, 0.94) if brick else WALLS[int(rng.integers(len(WALLS)))]
        plain, window = (Layer.BRICK, Layer.BRICK_WINDOW) if brick else (Layer.PLASTER, Layer.PLASTER_WINDOW)
        _walls(builder, depth, wide, eaves, tint, plain, window, rng, shop=style == 3 and eaves > 4)
    _roof(builder, depth, wide, eaves, 0.28 * depth + 0.6, rng)
    if style != 4:
        builder.box((0.8, wide * 0.25, eaves + 0.3 * depth), (0.6, 0.6, 1.6), (0.8, 0.75, 0.7), Layer.BRICK, uv_m=1.5)


def _walls(
    builder: Builder,
    depth: float,
    wide: float,
    eaves: float,
    tint: Colour,
    plain: int,
    window: int,
    rng: np.random.Generator,
    shop: bool,
) -> None:
    storeys = max(1, round(eaves / STOREY_M))
    high = eaves / storeys
    for corner, along, span, blank in (
        ((depth / 2, -wide / 2), (0.0, 1.0), wide, 0.1),
        ((-depth / 2, wide / 2), (0.0, -1.0), wide, 0.1),
        ((depth / 2, wide / 2), (-1.0, 0.0), depth, 0.45),
        ((-depth / 2, -wide / 2), (1.0, 0.0), depth, 0.45),
    ):
        bays = max(1, round(span / BAY_M))
        door = int(rng.integers(bays))
        for storey in range(storeys):
            for bay in range(bays):
                layer = plain if rng.uniform() < blank else window
                if storey == 0 and shop:
                    layer = Layer.SHOP
                elif storey == 0 and bay == door and layer != Layer.SHOP:
                    layer = Layer.DOOR if plain == Layer.PLASTER else plain
                a, b = bay * span / bays, (bay + 1) * span / bays
                z0, z1 = storey * high, (storey + 1) * high
                p = [(corner[0] + along[0] * t, corner[1] + along[1] * t) for t in (a, b)]
                cell = float(rng.integers(0, 60))
                uv = [(cell, 0), (cell + 1, 0), (cell + 1, 1), (cell, 1)]
                material = Material.PLAIN if layer == plain else Material.FACADE
                builder.quad([(*p[0], z0), (*p[1], z0), (*p[1], z1), (*p[0], z1)], tint, layer, material, uv)
    builder.box((0, 0, 0.25), (depth + 0.1, wide + 0.1, 0.5), (0.5, 0.48, 0.46), Layer.CONCRETE, uv_m=3.0)
    for sense in (1.0, -1.0):
        _gable(builder, depth, sense * wide / 2, eaves, 0.28 * depth + 0.6, sense, tint, plain)


def _gable(
    builder: Builder, depth: float, y: float, eaves: float, rise: float, sense: float, tint: Colour, layer: int
) -> None:
    points = [(-depth / 2, y, eaves), (depth / 2, y, eaves), (0, y, eaves + rise)]
    uv = [(0, 0), (depth / BAY_M, 0), (depth / BAY_M / 2, rise / STOREY_M)]
    builder.add(points, (0, sense, 0), uv, [(0, 1, 2)], tint, layer)


def _barn(builder: Builder, depth: float, wide: float, eaves: float, rng: np.random.Generator) -> None:
    lower = eaves * float(rng.uniform(0.3, 0.5))
    builder.box((0, 0, lower / 2), (depth, wide, lower), (0.85, 0.84, 0.82), Layer.PLASTER, uv_m=4.0)
    upper = (depth + 0.06, wide + 0.06, eaves - lower)
    builder.box((0, 0, (eaves + lower) / 2), upper, (1, 0.95, 0.9), Layer.WOOD, uv_m=2.5)
    for sense in (1.0, -1.0):
        _gable(builder, depth, sense * (wide / 2 + 0.03), eaves, 0.28 * depth + 0.6, sense, (1, 0.95, 0.9), Layer.WOOD)
    gate = depth / 2 + 0.05
    builder.quad([(gate, -1.6, 0), (gate, 1.6, 0), (gate, 1.6, 2.8), (gate, -1.6, 2.8)], (0.45, 0.4, 0.36), Layer.WOOD)


def _roof(builder: Builder, depth: float, wide: float, eaves: float, rise: float, rng: np.random.Generator) -> None:
    colour, over = ROOFS[int(rng.integers(len(ROOFS)))], 0.45
    half, slope = depth / 2 + over, rise / (depth / 2)
    low, high, y = eaves - over * slope, eaves + rise + 0.06, wide / 2 + over
    run = float(np.hypot(half, high - low))
    for sense in (1.0, -1.0):
        x, side = sense * half, y * sense
        corners = [(x, -side, low), (x, side, low), (0, side, high), (0, -side, high)]
        uv = [(0, 0), (2 * y / 3, 0), (2 * y / 3, run / 3), (0, run / 3)]
        builder.quad(corners, colour, Layer.ROOF, Material.PLAIN, uv)
        edge = [(x, -y, low - 0.16), (x, y, low - 0.16), (x, y, low), (x, -y, low)]
        builder.quad(edge, (0.85, 0.84, 0.8), normal=(sense, 0, 0))


def tower(builder: Builder, length: float, width: float, height: float, seed: int) -> None:
    """A block of flats."""
    rng = np.random.default_rng((82, seed))
    depth, wide = length or float(rng.uniform(12, 16)), width or float(rng.uniform(16, 30))
    storeys = max(4, round((height or float(rng.uniform(15, 36))) / STOREY_M))
    tint = WALLS[int(rng.integers(len(WALLS)))]
    layer = Layer.TOWER if rng.uniform() < 0.6 else Layer.TOWER_2
    top = storeys * STOREY_M
    shift = float(rng.integers(0, 90))
    for corner, along, span in (
        ((depth / 2, -wide / 2), (0.0, 1.0), wide),
        ((-depth / 2, wide / 2), (0.0, -1.0), wide),
        ((depth / 2, wide / 2), (-1.0, 0.0), depth),
        ((-depth / 2, -wide / 2), (1.0, 0.0), depth),
    ):
        bays = max(1, round(span / 3.6))
        end = (corner[0] + along[0] * span, corner[1] + along[1] * span)
        uv = [(shift, 0), (shift + bays, 0), (shift + bays, storeys), (shift, storeys)]
        builder.quad([(*corner, 0), (*end, 0), (*end, top), (*corner, top)], tint, layer, Material.FACADE, uv)
        shift += bays
    builder.box((0, 0, top + 0.2), (depth + 0.3, wide + 0.3, 0.5), (0.5, 0.5, 0.5), Layer.CONCRETE, uv_m=3.0)
    builder.box((0, wide * 0.2, top + 1.4), (4, 5, 2.2), (0.6, 0.6, 0.6), Layer.CONCRETE, uv_m=3.0)


def lamp(builder: Builder, height: float, reach: float) -> None:
    """A street lamp whose arm reaches along x."""
    builder.tube((0, 0, 0), (0, 0, 1.2), 0.11, STEEL, 0.10, 8)
    builder.tube((0, 0, 1.2), (0, 0, height), 0.08, STEEL, 0.05, 8)
    builder.tube((0, 0, height - 0.05), (reach, 0, height + 0.12), 0.045, STEEL, 0.04, 6)
    builder.box((reach + 0.25, 0, height + 0.12), (0.7, 0.26, 0.12), (0.4, 0.41, 0.42))
    far, near, z = reach + 0.55, reach - 0.05, height + 0.05
    corners = [(far, -0.1, z), (near, -0.1, z), (near, 0.1, z), (far, 0.1, z)]
    builder.quad(corners, (1.0, 0.86, 0.62), material=Material.STREET, normal=(0, 0, -1))


def marker_post(builder: Builder, height: float) -> None:
    """A delineator at the roadside with its reflector towards x."""
    builder.box((0, 0, height / 2), (*MARKER_POST_M, height), (0.93, 0.93, 0.92))
    builder.box((0, 0, height * 0.85), (0.094, 0.124, 0.22), (0.06, 0.06, 0.06))
    z0, z1 = height * 0.8, height * 0.9
    corners = [(0.05, -0.04, z0), (0.05, 0.04, z0), (0.05, 0.04, z1), (0.05, -0.04, z1)]
    builder.quad(corners, (0.9, 0.6, 0.2), 0, Material.RETRO)


def gantry(builder: Builder, span: float, clearance: float, panels: list[tuple[float, float, float]]) -> None:
    """Two masts and a truss across y at x = 0; panels as (y, width, height) get their dark cases, facing x."""
    half, mid = span / 2, clearance + 0.75
    for y in (half, -half):
        builder.tube((-0.2, y, 0), (-0.2, y, clearance + 1.2), 0.2, STEEL, 0.18, 10)
        builder.box((-0.2, y, 0.15), (0.8, 0.8, 0.3), (0.6, 0.6, 0.58), Layer.CONCRETE)
    for z in (clearance + 0.45, clearance + 1.15):
        for x in (-0.35, -0.05):
            builder.tube((x, -half, z), (x, half, z), 0.06, STEEL, sides=6)
    steps = np.linspace(-half, half, max(4, int(span / 1.2)))
    for k, (a, b) in enumerate(pairwise(steps)):
        z0, z1 = (clearance + 0.45, clearance + 1.15) if k % 2 else (clearance + 1.15, clearance + 0.45)
        builder.tube((-0.05, a, z0), (-0.05, b, z1), 0.04, STEEL, sides=5)
    for y, wide, high in panels:
        builder.box((0.10, y, mid), (0.25, wide * 1.12, high * 1.12), (0.09, 0.09, 0.10))


def light_pole(builder: Builder, height: float, arm: float) -> None:
    """The post of a traffic light at the origin, with an arm along y where the head hangs over the road."""
    top = height + 0.5 if not arm else height + 0.3
    builder.tube((-0.14, 0, 0), (-0.14, 0, top), LIGHT_POLE_M / 2, (0.42, 0.44, 0.45), sides=8)
    if arm:
        builder.tube((-0.14, 0, top), (-0.14, arm, top), 0.05, (0.42, 0.44, 0.45), sides=6)


def light_head(builder: Builder, height: float, arm: float) -> None:
    """A three-lamp head looking along x at y = ``arm``; its lamps glow by their material."""
    builder.box((-0.02, arm, height), LIGHT_HEAD_M, (0.05, 0.055, 0.05))
    for z, colour, material in (
        (0.32, (0.95, 0.10, 0.06), Material.RED),
        (0.0, (0.98, 0.62, 0.05), Material.AMBER),
        (-0.32, (0.08, 0.90, 0.42), Material.GREEN),
    ):
        builder.disc((0.066, arm, height + z), (1, 0, 0), 0.10, colour, 16, 0, material)
        turn = np.linspace(0.15 * np.pi, 0.85 * np.pi, 7)
        rim = np.stack([np.zeros(7), np.cos(turn) * 0.125 + arm, np.sin(turn) * 0.125 + height + z], axis=1)
        visor = np.stack([rim + np.array([0.06, 0, 0]), rim + np.array([0.22, 0, 0])], axis=1)
        builder.grid(visor, (0.05, 0.055, 0.05))


def sign_post(builder: Builder, height: float) -> None:
    """The pole behind a sign."""
    builder.tube((-0.05, 0, 0), (-0.05, 0, height), SIGN_POLE_M / 2, (0.62, 0.64, 0.65), sides=7)

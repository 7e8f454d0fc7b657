"""Trees, conifers and hedges: clumps of alpha-textured leaves around trunk and boughs. Unit: metres at scale 1."""

from __future__ import annotations

import numpy as np

from services.simulator.render.models.mesh import Builder, Colour, Floats, Material
from services.simulator.render.models.textures import Layer

COARSE = 3  # the far version keeps every third clump, larger
TREE_HEIGHT_M, CONIFER_HEIGHT_M, HEDGE_LENGTH_M = 9.0, 11.0, 4.0


def _clump(
    builder: Builder, centre: Floats, middle: Floats, size: float, tone: Colour, rng: np.random.Generator
) -> None:
    """One leafy card, turned at random, lit as if it belonged to the crown's round surface."""
    outward = centre - middle
    outward /= max(float(np.linalg.norm(outward)), 1e-6)
    facing = outward + rng.normal(0, 0.7, 3)
    facing /= np.linalg.norm(facing)
    right = np.cross(facing, (0.0, 0.0, 1.0))
    right /= max(float(np.linalg.norm(right)), 1e-6)
    up = np.cross(right, facing)
    corners = [centre + size * (a * right + b * up) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    normal = outward * 0.8 + np.array([0, 0, 0.35])
    builder.quad(corners, tone, Layer.LEAVES, Material.FOLIAGE, normal=normal / np.linalg.norm(normal))


def tree(seed: int, keep: int = 1) -> Builder:
    """A broad-leaved tree about ``TREE_HEIGHT_M`` high; only every ``keep``-th clump of leaves, larger in turn."""
    rng = np.random.default_rng((71, seed))
    builder = Builder()
    trunk = float(rng.uniform(1.6, 2.8))
    builder.tube((0, 0, 0), (0, 0, trunk + 2.5), 0.24, (0.62, 0.6, 0.58), 0.12, 7, Layer.BARK)
    tint = np.array([1.0, 1.0, 0.9]) * rng.uniform(0.75, 1.1) + rng.normal(0, 0.06, 3)
    lobes = [(np.array([0, 0, trunk + 3.3]), 2.5)]
    for _ in range(int(rng.integers(3, 6))):
        angle = rng.uniform(0, 2 * np.pi)
        place = np.array([np.cos(angle) * 1.7, np.sin(angle) * 1.7, trunk + rng.uniform(1.6, 4.6)])
        lobes.append((place, rng.uniform(1.4, 2.0)))
    middle = np.array([0, 0, trunk + 2.6])
    for spot, radius in lobes:
        if rng.uniform() < 0.8:
            builder.tube((0, 0, trunk), spot * 0.8 + (0, 0, trunk * 0.2), 0.09, (0.6, 0.58, 0.56), 0.03, 5, Layer.BARK)
        for number in range(int(9 * radius)):
            direction = rng.normal(size=3)
            direction /= np.linalg.norm(direction)
            place = spot + direction * radius * rng.uniform(0.55, 0.95)
            depth = np.clip(0.62 + 0.13 * (place[2] - middle[2]), 0.45, 1.15) * rng.uniform(0.85, 1.15)
            r, g, b = np.clip(tint * depth, 0, 1)
            if number % keep:
                continue
            size = float(rng.uniform(0.75, 1.25)) * (1 + 0.22 * (keep - 1))
            _clump(builder, place, middle, size, (float(r), float(g), float(b)), rng)
    return builder


def conifer(seed: int, keep: int = 1) -> Builder:
    """A spruce about ``CONIFER_HEIGHT_M`` high: tiers of drooping branches, fewer of them for ``keep`` above 1."""
    rng = np.random.default_rng((72, seed))
    builder = Builder()
    builder.tube((0, 0, 0), (0, 0, CONIFER_HEIGHT_M), 0.2, (0.5, 0.46, 0.42), 0.02, 6, Layer.BARK)
    tone = float(rng.uniform(0.8, 1.15))
    base = float(rng.uniform(0.8, 1.6))
    wide = float(rng.uniform(2.2, 3.0))
    for level in np.linspace(0, 1, 13 if keep == 1 else 8):
        z = base + (CONIFER_HEIGHT_M - base - 0.4) * level
        reach = wide * (1 - level) ** 0.85 + 0.25
        for angle in np.linspace(0, 2 * np.pi, 7)[:-1] + rng.uniform(0, 6):
            out = np.array([np.cos(angle), np.sin(angle), 0.0])
            across = np.array([-out[1], out[0], 0.0]) * reach * 0.62
            tip, foot = out * reach, np.array([0, 0, z])
            droop = np.array([0, 0, -0.45 * reach])
            corners = [foot - across + tip + droop, foot + across + tip + droop, foot + across, foot - across]
            shade = tone * float(rng.uniform(0.8, 1.1)) * (0.75 + 0.35 * level)
            normal = out * 0.7 + np.array([0, 0, 0.6])
            colour = (min(shade, 1.0),) * 3
            builder.quad(corners, colour, Layer.NEEDLES, Material.FOLIAGE, normal=normal / np.linalg.norm(normal))
    return builder


def hedge(seed: int, keep: int = 1) -> Builder:
    """A hedge ``HEDGE_LENGTH_M`` long along x, 1.4 high, 0.9 wide; fewer clumps for ``keep`` above 1."""
    rng = np.random.default_rng((73, seed))
    builder = Builder()
    for _ in range(46 // keep):
        place = np.array([rng.uniform(-2, 2), rng.uniform(-0.35, 0.35), rng.uniform(0.25, 1.15)])
        shade = float(np.clip(0.55 + 0.4 * place[2] + rng.normal(0, 0.06), 0.4, 1.0))
        middle = np.array([place[0], 0, 0.3])
        size = float(rng.uniform(0.35, 0.5)) * (1 + 0.2 * (keep - 1))
        _clump(builder, place, middle, size, (shade * 0.85, shade * 0.95, shade * 0.8), rng)
    return builder

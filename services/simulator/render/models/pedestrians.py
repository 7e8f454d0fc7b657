"""Pedestrians: bodies of tubes and balls, jointed at hips, knees and shoulders; the vertex shader walks them.

A vertex's joint: 0 trunk, 1 and 2 left and right leg, 3 and 4 lower legs, 5 and 6 arms (see ``shaders_upright``).
The figure is built for a height of 1 and scaled to the actor's own.
"""

from __future__ import annotations

import numpy as np

from services.simulator.render.models.mesh import Builder, Colour, Material
from services.simulator.render.models.textures import Layer

HIP, KNEE, SHOULDER = 0.51, 0.28, 0.80
STRIDE_RAD, KNEE_RAD, ARM_RAD = 0.48, 0.75, 0.42
SKINS: tuple[Colour, ...] = ((0.87, 0.68, 0.56), (0.76, 0.56, 0.43), (0.56, 0.38, 0.27), (0.36, 0.24, 0.17))
HAIRS: tuple[Colour, ...] = (
    (0.12, 0.09, 0.07), (0.28, 0.18, 0.10), (0.55, 0.42, 0.24), (0.6, 0.6, 0.58), (0.4, 0.16, 0.08),
)  # fmt: skip


def _cloth(rng: np.random.Generator, bright: float) -> Colour:
    r, g, b = np.clip(rng.uniform(0.06, bright, 3) + rng.uniform(-0.05, 0.15), 0.04, 0.95)
    return float(r), float(g), float(b)


def pedestrian(builder: Builder, family: int, rng: np.random.Generator) -> None:
    """Families: jacket and trousers, long coat, skirt or dress, hooded with a backpack. Facing x, height 1."""
    kind = family % 4
    skin, hair = SKINS[int(rng.integers(len(SKINS)))], HAIRS[int(rng.integers(len(HAIRS)))]
    top, legs = _cloth(rng, 0.85), _cloth(rng, 0.45)
    if rng.uniform() < 0.12:
        top = (0.75, 0.85, 0.10)  # high-visibility
    bulk = float(rng.uniform(0.9, 1.2))
    _trunk(builder, top, legs, bulk, kind)
    _head(builder, skin, top if kind == 3 else hair, kind, rng)
    bare = kind == 2 and rng.uniform() < 0.5
    for side, leg, shin, arm in ((1.0, 1, 3, 5), (-1.0, 2, 4, 6)):
        _leg(builder, side, leg, shin, skin if bare else legs, bulk)
        _arm(builder, side, arm, top, skin, bulk)
    builder.joint = 0
    if kind == 3 or rng.uniform() < 0.2:
        builder.box((-0.095 * bulk, 0, 0.70), (0.09, 0.17, 0.23), _cloth(rng, 0.7), Layer.CLOTH)
    if rng.uniform() < 0.25:
        builder.joint = 5
        builder.box((0.0, 0.16, 0.40), (0.16, 0.05, 0.13), _cloth(rng, 0.7), Layer.CLOTH)
        builder.joint = 0


def _trunk(builder: Builder, top: Colour, legs: Colour, bulk: float, kind: int) -> None:
    heights = np.array([0.48, 0.54, 0.60, 0.68, 0.76, 0.815, 0.84])
    depth = np.array([0.055, 0.062, 0.056, 0.062, 0.066, 0.045, 0.02]) * bulk
    wide = np.array([0.085, 0.092, 0.084, 0.096, 0.112, 0.09, 0.03]) * bulk
    if kind in (1, 2):  # coat or skirt hangs to the knee
        heights = np.concatenate([[0.30, 0.42], heights[1:]])
        depth = np.concatenate([[0.105, 0.085], depth[1:]])
        wide = np.concatenate([[0.12, 0.105], wide[1:]])
    turn = np.linspace(0, 2 * np.pi, 11)
    rows = np.stack(
        [np.outer(depth, np.cos(turn)), np.outer(wide, np.sin(turn)), np.repeat(heights[:, None], 11, axis=1)], axis=2
    )
    centre = (0, 0, 0.65)
    if kind == 2:
        builder.grid(rows[:3], legs, Layer.CLOTH, Material.PLAIN, None, centre)
        builder.grid(rows[2:], top, Layer.CLOTH, Material.PLAIN, None, centre)
    else:
        builder.grid(rows, top, Layer.CLOTH, Material.PLAIN, None, centre)


def _head(builder: Builder, skin: Colour, hair: Colour, kind: int, rng: np.random.Generator) -> None:
    builder.tube((0, 0, 0.82), (0.005, 0, 0.88), 0.032, skin, sides=7)
    builder.ball((0.008, 0, 0.925), (0.052, 0.043, 0.066), skin, 7, 9)
    builder.ball((-0.012, 0, 0.94), (0.052, 0.05, 0.06), hair, 6, 9)
    if kind == 2 and rng.uniform() < 0.8:
        builder.ball((-0.035, 0, 0.89), (0.03, 0.05, 0.08), hair, 5, 8)
    if rng.uniform() < 0.25:
        builder.ball((0.0, 0, 0.965), (0.062, 0.055, 0.035), _cloth(rng, 0.8), 5, 8)


def _leg(builder: Builder, side: float, leg: int, shin: int, colour: Colour, bulk: float) -> None:
    y = side * 0.047 * bulk
    builder.joint = leg
    builder.tube((0, y, HIP + 0.02), (0, y, KNEE), 0.052 * bulk, colour, 0.038 * bulk, 8, Layer.CLOTH)
    builder.joint = shin
    builder.tube((0, y, KNEE + 0.01), (-0.008, y, 0.03), 0.039 * bulk, colour, 0.027, 8, Layer.CLOTH)
    builder.ball((0.028, y, 0.022), (0.068, 0.028, 0.024), (0.10, 0.08, 0.07), 5, 8)


def _arm(builder: Builder, side: float, arm: int, colour: Colour, skin: Colour, bulk: float) -> None:
    y = side * 0.118 * bulk
    builder.joint = arm
    builder.tube((0, y, SHOULDER + 0.01), (-0.01, y * 1.12, 0.63), 0.034 * bulk, colour, 0.028, 7, Layer.CLOTH)
    builder.tube((-0.01, y * 1.12, 0.64), (0.035, y * 1.15, 0.48), 0.028, colour, 0.022, 7, Layer.CLOTH)
    builder.ball((0.04, y * 1.15, 0.455), (0.022, 0.018, 0.032), skin, 4, 7)


def posed(points: np.ndarray, joints: np.ndarray, phase: float) -> np.ndarray:
    """Vertices (N, 3) of the unit figure at a step phase in turns: the shader's own formula, for exact boxes."""
    swing = np.sin(2 * np.pi * phase)
    out = points.copy()
    sign = np.array([0, 1, -1, 1, -1, -1, 1])[joints]
    shin = (joints == 3) | (joints == 4)
    bend = np.where(shin, KNEE_RAD * np.maximum(0.0, np.cos(2 * np.pi * phase) * sign), 0.0)
    out = _swung(out, KNEE, bend)
    limit = np.where(joints >= 5, ARM_RAD, STRIDE_RAD)
    pivot = np.where(joints >= 5, SHOULDER, HIP)
    return _swung(out, pivot, -sign * swing * limit)


def _swung(points: np.ndarray, pivot: np.ndarray | float, angle: np.ndarray) -> np.ndarray:
    x, z = points[:, 0], points[:, 2] - pivot
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * x + s * z, points[:, 1], -s * x + c * z + pivot], axis=1)

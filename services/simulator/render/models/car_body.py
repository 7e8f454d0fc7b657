"""Car bodies lofted from a side profile: stations along the car, a rounded ring of points at each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from services.simulator.render.models.mesh import Builder, Colour, Floats, Material
from services.simulator.render.models.textures import Layer

GLASS: Colour = (0.20, 0.23, 0.26)
RUBBER: Colour = (0.06, 0.06, 0.065)
TAIL: Colour = (0.75, 0.04, 0.04)
HEAD: Colour = (0.95, 0.95, 0.90)
AMBER: Colour = (0.95, 0.50, 0.05)
SHOULDER = 4  # ring points: 0 floor, 1 sill, 2 flank, 3 upper flank, 4 shoulder, 5 roof edge, 6 roof, 7 middle


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """A car's side view, front to rear: (x, deck, roof, glass) with x in lengths from the middle, heights in heights.

    ``glass`` tells what fills the stretch from this station to the next: "-" nothing, "w" windscreen or rear window
    (glass on top), "s" side windows, "p" a pillar.
    """

    stations: tuple[tuple[float, float, float, str], ...]
    roof_width: float = 0.72
    nose_taper: float = 0.86
    tail_taper: float = 0.90
    wheel_radius: float = 0.22  # in heights
    front_axle: float = 0.32
    rear_axle: float = -0.30
    floor: float = 0.13
    side_layer: int = Layer.CAR_SIDE


def _ring(
    length: float, width: float, height: float, profile: Profile, station: tuple[float, float, float, str]
) -> Floats:
    x, deck, roof, _ = station
    end = np.clip((abs(x) - 0.36) / 0.14, 0, 1) ** 2
    taper = 1 - end * (1 - (profile.nose_taper if x > 0 else profile.tail_taper))
    half = width / 2 * taper
    cabin = np.clip((roof - deck) / max(1 - deck, 0.05), 0, 1)
    edge = half * 0.90 * (1 - cabin) + width / 2 * profile.roof_width * cabin
    floor = profile.floor + 0.05 * end
    points = [
        (half * 0.86, floor),
        (half * 0.97, floor + 0.05),
        (half * 1.0, floor + (deck - floor) * 0.5),
        (half * 0.985, floor + (deck - floor) * 0.85),
        (half * 0.94, deck),
        (edge, max(roof - 0.035 * cabin, deck)),
        (edge * 0.82, roof),
        (0.0, roof + 0.012),
    ]
    return np.array([(x * length, y, z * height) for y, z in points])


def body(
    builder: Builder, length: float, width: float, height: float, profile: Profile, paint: Colour, roof: Colour
) -> None:
    """The painted shell with its windows; end caps and wheels come from their own functions."""
    rings = np.stack([_ring(length, width, height, profile, station) for station in profile.stations])
    centre = (0.0, 0.0, height * 0.45)
    for mirror in (1.0, -1.0):
        shell = rings * (1.0, mirror, 1.0)
        uv = np.stack([shell[:, :, 0] / length + 0.5, shell[:, :, 2] / height], axis=2)
        builder.grid(shell[:, : SHOULDER + 1], paint, profile.side_layer, Material.PAINT, uv[:, : SHOULDER + 1], centre)
        for index, (_, _, _, fill) in enumerate(profile.stations[:-1]):
            pair, spots = shell[index : index + 2], uv[index : index + 2]
            side = (GLASS, Layer.WHITE, Material.GLASS) if fill == "s" else (paint, Layer.PAINT, Material.PAINT)
            top = (GLASS, Layer.WHITE, Material.GLASS) if fill == "w" else (roof, Layer.PAINT, Material.PAINT)
            builder.grid(pair[:, 4:6], *side, spots[:, 4:6], centre)
            builder.grid(pair[:, 5:8], *top, spots[:, 5:8], (0, 0, -height))
    _cap(builder, rings[0], 1.0, paint, Layer.CAR_FRONT)
    _cap(builder, rings[-1], -1.0, paint, Layer.CAR_REAR)


def _cap(builder: Builder, ring: Floats, sense: float, paint: Colour, layer: int) -> None:
    outline = np.concatenate([ring, ring[-2::-1] * (1.0, -1.0, 1.0)])
    low, high, half = ring[:, 2].min(), ring[:, 2].max(), ring[:, 1].max()
    uv = np.stack([0.5 + 0.5 * outline[:, 1] / half, (outline[:, 2] - low) / (high - low)], axis=1)
    count = len(outline)
    fan = [(0, k, k + 1) for k in range(1, count - 1)]
    builder.add(outline, (sense, 0, 0.15), uv, fan, paint, layer, Material.PAINT)


def wheels(builder: Builder, length: float, width: float, height: float, profile: Profile) -> None:
    """Four wheels with dark arches on the flanks."""
    radius = profile.wheel_radius * height
    for x in (profile.front_axle * length, profile.rear_axle * length):
        for side in (1.0, -1.0):
            wheel(builder, x, side, width, radius)


def wheel(builder: Builder, x: float, side: float, width: float, radius: float) -> None:
    """One wheel standing on the ground at ``x`` on one flank (side 1 left, -1 right)."""
    outer = side * (width / 2 + 0.012)
    builder.disc((x, side * (width / 2 + 0.004), radius * 1.12), (0, side, 0), radius * 1.12, (0.03, 0.03, 0.03), 18)
    builder.tube((x, outer - side * 0.24, radius), (x, outer, radius), radius, RUBBER, sides=16)
    builder.disc((x, outer, radius), (0, side, 0), radius, (1, 1, 1), 18, Layer.WHEEL)


def end_quad(
    builder: Builder,
    x: float,
    sense: float,
    y: tuple[float, float],
    z: tuple[float, float],
    colour: Colour,
    material: int,
    layer: int = 0,
) -> None:
    """A lamp or plate on a car's end at ``x`` (sense 1 front, -1 rear), from y[0] to y[1] and z[0] to z[1]."""
    left, right = (min(y), max(y)) if sense > 0 else (max(y), min(y))
    corners = [(x, left, z[0]), (x, right, z[0]), (x, right, z[1]), (x, left, z[1])]
    builder.quad(corners, colour, layer, material, normal=(sense, 0, 0))


def flank(x: tuple[float, float], y: float, z: tuple[float, float]) -> list[tuple[float, float, float]]:
    """The corners of an upright rectangle along the car at ``y``, from x[0] to x[1] and z[0] to z[1]."""
    return [(x[0], y, z[0]), (x[1], y, z[0]), (x[1], y, z[1]), (x[0], y, z[1])]


def plate(builder: Builder, x: float, sense: float, z: tuple[float, float], layer: int) -> None:
    """A number plate on an end at ``x``, from z[0] to z[1]."""
    end_quad(builder, x, sense, (-0.26, 0.26), z, (1, 1, 1), Material.RETRO, layer)


def rear_plate(rng: np.random.Generator) -> Layer:
    """The layer of a plate behind: three in ten are yellow."""
    return Layer.PLATE_YELLOW if rng.uniform() < 0.3 else Layer.PLATE_WHITE

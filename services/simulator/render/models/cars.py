"""Cars and vans: profiles per family, with lamps, plates, mirrors and stripes drawn by the look seed."""

from __future__ import annotations

import tomllib
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from services.simulator.render.models.car_body import (
    AMBER,
    GLASS,
    HEAD,
    RUBBER,
    TAIL,
    Profile,
    body,
    end_quad,
    plate,
    rear_plate,
    wheels,
)
from services.simulator.render.models.mesh import Builder, Colour, Material
from services.simulator.render.models.textures import Layer

PAINTS: tuple[Colour, ...] = (
    (0.82, 0.83, 0.84), (0.62, 0.64, 0.66), (0.36, 0.38, 0.41), (0.11, 0.11, 0.12), (0.93, 0.93, 0.92),
    (0.60, 0.09, 0.08), (0.14, 0.22, 0.45), (0.30, 0.48, 0.66), (0.16, 0.32, 0.22), (0.78, 0.62, 0.22),
    (0.45, 0.33, 0.24), (0.85, 0.42, 0.12), (0.48, 0.55, 0.42), (0.30, 0.14, 0.26), (0.70, 0.66, 0.58),
)  # fmt: skip

_TABLE = tomllib.loads(Path(__file__).with_name("car_profiles.toml").read_text(encoding="utf-8"))


def _profile(row: dict[str, Any]) -> Profile:
    stations, side = tuple(map(tuple, row["stations"])), Layer[row.get("side_layer", "CAR_SIDE")]
    return Profile(**{**row, "stations": stations, "side_layer": side})


PROFILES: dict[str, tuple[Profile, ...]] = {kind: tuple(map(_profile, rows)) for kind, rows in _TABLE.items()}


def pick_paint(rng: np.random.Generator) -> Colour:
    """A paint of the usual range, slightly varied."""
    base = np.array(PAINTS[int(rng.integers(len(PAINTS)))]) * rng.uniform(0.85, 1.1) + rng.normal(0, 0.015, 3)
    r, g, b = np.clip(base, 0.03, 0.97)
    return float(r), float(g), float(b)


def car(builder: Builder, kind: str, family: int, rng: np.random.Generator, size_m: tuple[float, float, float]) -> None:
    """A saloon, estate or van of ``size_m`` (length, width, height); the origin is the footprint's centre."""
    length, width, height = size_m
    profile = PROFILES[kind][family % len(PROFILES[kind])]
    paint = pick_paint(rng)
    roof = pick_paint(rng) if rng.uniform() < 0.08 else paint
    body(builder, length, width, height, profile, paint, roof)
    wheels(builder, length, width, height, profile)
    _lamps(builder, size_m, profile, rng, tall=kind == "van" or rng.uniform() < 0.25)
    _trim(builder, size_m, profile, rng, paint)


def _lamps(
    builder: Builder, size_m: tuple[float, float, float], profile: Profile, rng: np.random.Generator, tall: bool
) -> None:
    length, width, height = size_m
    rear, front = -length / 2 - 0.012, length / 2 + 0.012
    half_rear, half_front = width / 2 * profile.tail_taper, width / 2 * profile.nose_taper
    top = profile.stations[-1][1] * height
    high = 0.26 * height if tall else float(rng.uniform(0.085, 0.13)) * height
    wide = float(rng.uniform(0.10, 0.14) if tall else rng.uniform(0.22, 0.30)) * width
    z1 = top - 0.03 * height
    z0 = z1 - high
    for side, indicator in ((1.0, Material.LEFT), (-1.0, Material.RIGHT)):
        outer = side * half_rear * 0.95
        split = outer - side * wide * 0.66
        end_quad(builder, rear, -1, (outer, split), (z0, z1), TAIL, Material.TAIL)
        end_quad(builder, rear, -1, (split, outer - side * wide), (z0, z1), AMBER, indicator)
        lamp_top = profile.stations[0][1] * height * 0.98
        outer = side * half_front * 0.95
        head = outer - side * width * 0.2
        end_quad(builder, front, 1, (outer, head), (lamp_top - 0.10 * height, lamp_top), HEAD, Material.HEAD)
        below = (lamp_top - 0.135 * height, lamp_top - 0.105 * height)
        end_quad(builder, front, 1, (outer, head), below, AMBER, indicator)
    layer = rear_plate(rng)
    plate_z = float(rng.uniform(0.30, 0.42)) * height if not tall else 0.25 * height
    plate(builder, rear - 0.004, -1, (plate_z, plate_z + 0.115), layer)
    plate(builder, front + 0.004, 1, (0.22 * height, 0.22 * height + 0.115), Layer.PLATE_WHITE)
    _third_brake(builder, size_m, profile)


def _third_brake(builder: Builder, size_m: tuple[float, float, float], profile: Profile) -> None:
    """The high brake lamp at the upper rim of the rear window, or of the rear where there is no such window."""
    length, _, height = size_m
    panes = [k for k, station in enumerate(profile.stations) if station[3] == "w" and station[0] < 0]
    if panes:
        x, _, roof, _ = profile.stations[panes[-1]]
        box = (x * length - 0.035, roof * height - 0.015)
    else:
        box = (-length / 2 - 0.01, profile.stations[-1][2] * height - 0.05)
    builder.box((box[0], 0, box[1]), (0.04, 0.34, 0.035), (0.6, 0.03, 0.03), material=Material.BRAKE)


def _trim(
    builder: Builder, size_m: tuple[float, float, float], profile: Profile, rng: np.random.Generator, paint: Colour
) -> None:
    length, width, height = size_m
    for x, sense in ((length / 2 - 0.05, 1.0), (-length / 2 + 0.05, -1.0)):  # bumpers
        taper = profile.nose_taper if sense > 0 else profile.tail_taper
        colour = (0.10, 0.10, 0.11) if rng.uniform() < 0.5 else paint
        builder.box((x, 0, 0.235 * height), (0.13, width * taper * 0.99, 0.15 * height), colour)
    pane = next(station for station in profile.stations if station[3] == "w")
    for side in (1.0, -1.0):  # mirrors
        centre = (pane[0] * length - 0.10 * length, side * (width / 2 + 0.07), pane[1] * height + 0.09)
        builder.box(centre, (0.12, 0.17, 0.13), paint, material=Material.PAINT)
    if profile.side_layer == Layer.VAN_SIDE or profile.stations[-1][2] > 0.9:  # upright rear: window and door gap
        z0, z1 = 0.60 * height, 0.86 * height
        if rng.uniform() < 0.7:
            end_quad(builder, -length / 2 - 0.008, -1, (-width * 0.36, width * 0.36), (z0, z1), GLASS, Material.GLASS)
        gap = (0.3 * height, 0.93 * height)
        end_quad(builder, -length / 2 - 0.01, -1, (-0.012, 0.012), gap, RUBBER, Material.PLAIN)
    if rng.uniform() < 0.10:
        _stripe(builder, length, profile, height, pick_paint(rng), float(rng.uniform(0.12, 0.22)) * width)


def _stripe(builder: Builder, length: float, profile: Profile, height: float, colour: Colour, half: float) -> None:
    for a, b in pairwise(profile.stations):
        if a[3] == "w":
            continue
        za, zb = a[2] * height + 0.022, b[2] * height + 0.022
        xa, xb = a[0] * length, b[0] * length
        corners = [(xa, half, za), (xb, half, zb), (xb, -half, zb), (xa, -half, za)]
        builder.quad(corners, colour, Layer.PAINT, Material.PAINT, normal=(0, 0, 1))
    x, z0, z1 = -length / 2 - 0.006, 0.3 * height, profile.stations[-1][2] * height
    end_quad(builder, x, -1, (-half, half), (z0, z1), colour, Material.PAINT, Layer.PAINT)

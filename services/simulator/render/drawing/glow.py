"""Glare around lamps, light pools on the road, and shadows under things: tables of sprites for one frame."""

from __future__ import annotations

import math

import moderngl
import numpy as np

from services.simulator.render.drawing.frame import LIT, Cast
from services.simulator.render.drawing.static_world import World, light_centre
from services.simulator.render.models.actors import Lamp, lamp_levels
from services.simulator.render.models.mesh import Floats, Material
from services.simulator.scene.scene import Actor

COLOURS: dict[int, tuple[float, float, float]] = {
    Material.TAIL: (0.9, 0.05, 0.04),
    Material.BRAKE: (0.9, 0.05, 0.04),
    Material.HEAD: (1.0, 0.96, 0.86),
    Material.LEFT: (1.0, 0.55, 0.06),
    Material.RIGHT: (1.0, 0.55, 0.06),
    Material.RED: (1.0, 0.10, 0.06),
    Material.AMBER: (1.0, 0.62, 0.06),
    Material.GREEN: (0.10, 0.95, 0.45),
    Material.STREET: (1.0, 0.80, 0.52),
}
SHADOW_REACH_M = 120.0


def glows(world: World, cast_: Cast) -> Floats:
    """Rows (x, y, z, width, height, least share of the picture, r, g, b), additive."""
    night = cast_.light.night > 0
    dark = 1.0 if night else 0.25 + 0.3 * cast_.light.haze
    rows: list[tuple[float, ...]] = []
    for actor in cast_.actors:
        rows += _actor_glows(actor, cast_, dark)
    for light, _, state in cast_.lights:
        x, y, z = light_centre(light)
        for material in LIT[state]:
            drop = {Material.RED: 0.32, Material.AMBER: 0.0, Material.GREEN: -0.32}[material]
            c, s = math.cos(light.pose.yaw_rad), math.sin(light.pose.yaw_rad)
            if (cast_.view.eye[0] - x) * c + (cast_.view.eye[1] - y) * s > 0:
                rows += _sprite(cast_, (x + 0.25 * c, y + 0.25 * s, z + drop), material, 0.32, 0.45 * dark)
    if night:
        for spot in world.street_lamps:
            rows += _sprite(cast_, (float(spot[0]), float(spot[1]), float(spot[2])), Material.STREET, 0.7, 0.8)
    return np.array(rows).reshape(-1, 9)


def _actor_glows(actor: Actor, cast_: Cast, dark: float) -> list[tuple[float, ...]]:
    model = cast_.models[actor.id].model
    if model is None or not model.lamps:
        return []
    levels = lamp_levels(actor, cast_.scene.time_s, cast_.light.night > 0)
    c, s = math.cos(actor.pose.yaw_rad), math.sin(actor.pose.yaw_rad)
    to_eye = cast_.view.eye[:2] - (actor.pose.x_m, actor.pose.y_m)
    facing = float(to_eye @ (c, s)) / max(float(np.hypot(*to_eye)), 0.1)
    rows = []
    for lamp in model.lamps:
        level, shown = levels[lamp.material], max(0.0, facing * lamp.sense)
        if level > 0 and shown > 0:
            place = _lamp_place(actor, lamp, c, s)
            size, power = (0.55, 0.85) if lamp.material == Material.HEAD else (0.30, 0.5)
            rows += _sprite(cast_, place, lamp.material, size, power * dark * min(level, 2.0) * shown)
    return rows


def _lamp_place(actor: Actor, lamp: Lamp, c: float, s: float) -> tuple[float, float, float]:
    x = lamp.x_m + lamp.sense * 0.06
    pose = actor.pose
    return pose.x_m + c * x - s * lamp.y_m, pose.y_m + s * x + c * lamp.y_m, pose.z_m + lamp.z_m


def _sprite(
    cast_: Cast, place: tuple[float, float, float], material: int, size_m: float, power: float
) -> list[tuple[float, ...]]:
    """A lamp's glare and, on a wet road, its long reflection below the ground line."""
    r, g, b = (channel * power for channel in COLOURS[material])
    rows: list[tuple[float, ...]] = [(*place, size_m, size_m, 0.0, r, g, b)]
    wet = cast_.light.wet
    if wet > 0.1 and place[2] < 6.0:
        k, (x, y, z) = 0.45 * wet, place
        rows.append((x, y, -z * 0.9, size_m * 0.55, size_m * 1.1 + z * 0.9, 0.0, r * k, g * k, b * k))
    return rows


def blobs(world: World, cast_: Cast) -> Floats:
    """Rows (x, y, z, yaw, half length, half width, strength, softness): contact shadows and the plants' shade."""
    rows: list[tuple[float, ...]] = []
    contact = 0.85 if cast_.light.night == 0 else 0.6
    for actor in cast_.actors:
        pose, small = actor.pose, actor.kind == "pedestrian"
        half_l, half_w = (0.38, 0.38) if small else (actor.length_m / 2 + 0.25, actor.width_m / 2 + 0.30)
        place = (pose.x_m, pose.y_m, pose.z_m, pose.yaw_rad, half_l, half_w)
        rows.append((*place, contact * (0.7 if small else 1.0), 0.0 if small else 0.55))
    for item in world.buildings:
        half_l, half_w = (item.length_m or 10.0) / 2 + 1.2, (item.width_m or 12.0) / 2 + 1.2
        rows.append((item.pose.x_m, item.pose.y_m, 0.0, item.pose.yaw_rad, half_l, half_w, 0.4, 0.7))
    return np.array(rows + _plant_blobs(world, cast_)).reshape(-1, 8)


def _plant_blobs(world: World, cast_: Cast) -> list[tuple[float, ...]]:
    sun = cast_.light.sun_dir
    rows: list[tuple[float, ...]] = []
    azimuth, stretch = math.atan2(sun[1], sun[0]), 1.0 / max(sun[2], 0.25)
    for grove in world.plants:
        near = np.linalg.norm(grove.centres[:, :2] - cast_.view.eye[:2], axis=1) < SHADOW_REACH_M
        for row in grove.rows[near]:
            high, wide = float(row[5]), float(row[4])
            rows.append((float(row[0]), float(row[1]), 0.0, 0.0, 2.6 * wide, 2.6 * wide, 0.30, 0.0))
            if cast_.light.shadow > 0.05:
                reach = 5.5 * high * math.hypot(sun[0], sun[1]) * stretch
                x, y = row[0] - math.cos(azimuth) * reach, row[1] - math.sin(azimuth) * reach
                size = (3.3 * wide * stretch, 3.0 * wide)
                rows.append((float(x), float(y), 0.0, azimuth, *size, cast_.light.shadow, 0.12))
    return rows


def upload(buffer: moderngl.Buffer, rows: Floats) -> int:
    """Write a table of sprites, as many rows as fit; returns their number."""
    rows = rows[: buffer.size // (4 * rows.shape[1])]
    if len(rows):
        buffer.write(rows.astype("<f4").tobytes())
    return len(rows)

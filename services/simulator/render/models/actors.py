"""Actor meshes by kind, family and look, with what the renderer needs of them: vertices, lamps, size."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from services.simulator.render.models import cars, large_vehicles, pedestrians
from services.simulator.render.models.mesh import Builder, Floats, Material, Mesh
from services.simulator.scene.scene import Actor

FAMILIES = 4  # mesh families per actor kind
LAMPS = (Material.TAIL, Material.BRAKE, Material.HEAD, Material.LEFT, Material.RIGHT)


@dataclass(frozen=True, slots=True)
class Lamp:
    """A lamp's middle in the model frame; ``sense`` 1 shines ahead, -1 back."""

    material: int
    x_m: float
    y_m: float
    z_m: float
    sense: float


@dataclass(frozen=True, slots=True, eq=False)
class Model:
    """A built mesh with its lamps; people are of unit height and get scaled."""

    mesh: Mesh
    points: Floats
    joints: np.ndarray
    lamps: tuple[Lamp, ...]


def model_key(actor: Actor) -> tuple[object, ...]:
    """Actors with the same key share a mesh."""
    if actor.kind == "pedestrian":
        return actor.kind, actor.mesh_family % FAMILIES, actor.look_seed
    size = (round(actor.length_m, 2), round(actor.width_m, 2), round(actor.height_m, 2))
    return actor.kind, actor.mesh_family % FAMILIES, actor.look_seed, size


def build_model(actor: Actor) -> Model:
    """The mesh for an actor, the same for the same key."""
    builder, family = Builder(), actor.mesh_family % FAMILIES
    rng = np.random.default_rng((91, actor.look_seed & 0xFFFFFFFF, family))
    size = (actor.length_m, actor.width_m, actor.height_m)
    if actor.kind == "pedestrian":
        pedestrians.pedestrian(builder, family, rng)
    elif actor.kind == "lorry":
        large_vehicles.lorry(builder, family, rng, size)
    elif actor.kind == "bus":
        large_vehicles.bus(builder, family, rng, size)
    elif actor.kind == "motorcycle":
        large_vehicles.motorcycle(builder, family, rng, size)
    else:
        cars.car(builder, actor.kind, family, rng, size)
    mesh = builder.build()
    return Model(mesh, mesh.points(), mesh.vertices["meta"][:, 2].astype(int), _lamps(mesh))


def _lamps(mesh: Mesh) -> tuple[Lamp, ...]:
    points, materials = mesh.points(), mesh.vertices["meta"][:, 1]
    found = []
    for material in LAMPS:
        for side in (1, 0, -1):
            for sense in (1, -1):
                lateral = np.sign(np.round(points[:, 1], 2)) if material != Material.BRAKE else np.zeros(len(points))
                chosen = (materials == material) & (lateral == side) & (np.sign(points[:, 0]) == sense)
                if chosen.any():
                    x, y, z = points[chosen].mean(axis=0)
                    found.append(Lamp(int(material), float(x), float(y), float(z), float(sense)))
    return tuple(found)


def lamp_levels(actor: Actor, time_s: float, night: bool) -> Floats:
    """How brightly each material of the actor glows, (16,)."""
    level = np.zeros(16)
    lit = 1.0 if actor.lights_on else 0.0
    level[Material.TAIL] = 0.45 * lit + (1.6 if actor.braking else 0.0)
    level[Material.BRAKE] = 1.6 if actor.braking else 0.0
    level[Material.HEAD] = (2.0 if night else 0.8) * lit
    blink = 1.6 if time_s * 1.5 % 1.0 < 0.55 else 0.0
    if actor.indicator != "off":
        level[Material.LEFT if actor.indicator == "left" else Material.RIGHT] = blink
    level[Material.STREET] = 1.0
    return level


def actor_matrix(actor: Actor) -> Floats:
    """Model to world, 4 x 4."""
    c, s = np.cos(actor.pose.yaw_rad), np.sin(actor.pose.yaw_rad)
    scale = actor.height_m if actor.kind == "pedestrian" else 1.0
    out = np.eye(4)
    out[:3, :3] = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) * scale
    out[:3, 3] = (actor.pose.x_m, actor.pose.y_m, actor.pose.z_m)
    return out


def world_points(model: Model, actor: Actor) -> Floats:
    """The actor's vertices in the world, (N, 3), exactly as drawn."""
    points = pedestrians.posed(model.points, model.joints, actor.walk_phase) if model.joints.any() else model.points
    matrix = actor_matrix(actor)
    out: Floats = points @ matrix[:3, :3].T + matrix[:3, 3]
    return out

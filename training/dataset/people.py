"""People put where they are hard to see: before and behind posts, trunks and vehicles, in groups, crossing.

A stage's own people stand anywhere along the pavement, so hardly one before a lamp post, in a knot of others or half
behind a parked car, as people at the roadside do.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from services.simulator.scene.scene import Actor, Pose, Scene, in_ego_frame
from training.stages.road_users import drawn
from training.stages.stage import Split

UPRIGHT = ("lamp", "post", "street_furniture", "tree", "conifer")
NEAREST_M, FARTHEST_M = 5.0, 75.0
WIDE = 0.55
"""A person who stands further aside than this share of the distance ahead is in neither camera's picture."""
PLACES = ("thing", "vehicle", "open", "road")
LIKELY = (0.35, 0.3, 0.15, 0.2)
ROAD_HALF_M, ROADSIDE_M = 4.0, 9.0


def with_people(scene: Scene, split: Split, rng: np.random.Generator) -> Scene:
    """The scene with two to seven knots of up to five people more.

    A knot is 5 to 75 m ahead of the ego, or up to 4 m before or behind a thing or a vehicle that is. A person who would stand in a
    vehicle or less than 0.3 m from it, or within 4 m of the ego's origin, is left out, so that a knot may be empty.
    """
    things = [item.pose for item in scene.static.scenery if item.kind in UPRIGHT]
    things = _in_sight(scene.ego, things + [post.pose for post in scene.static.signs])
    vehicles = [actor for actor in scene.actors if actor.kind != "pedestrian"]
    near = _in_sight(scene.ego, [actor.pose for actor in vehicles])
    added: list[Actor] = []
    first = max((actor.id for actor in scene.actors), default=0) + 1
    for _ in range(int(rng.integers(2, 8))):
        where = str(rng.choice(PLACES, p=LIKELY))
        middle = _beside(scene.ego, {"thing": things, "vehicle": near}.get(where, []), rng)
        middle = middle or _somewhere(scene.ego, ROAD_HALF_M if where == "road" else ROADSIDE_M, rng)
        heading = scene.ego.yaw_rad + float(rng.choice([0.0, 0.5, 1.0, 1.5])) * math.pi
        for _ in range(int(rng.choice([1, 2, 3, 4, 5], p=[0.45, 0.25, 0.14, 0.1, 0.06]))):
            pose = _near(middle, heading, rng)
            if (
                all(_clear_of(pose, each) for each in vehicles)
                and math.dist((pose.x_m, pose.y_m), (scene.ego.x_m, scene.ego.y_m)) > NEAREST_M - 1.0
            ):
                added.append(_person(first + len(added), pose, split, rng))
    return replace(scene, actors=scene.actors + tuple(added))


def _in_sight(ego: Pose, poses: list[Pose]) -> list[Pose]:
    return [pose for pose in poses if _is_in_sight(*in_ego_frame(ego, pose.x_m, pose.y_m))]


def _is_in_sight(ahead_m: float, aside_m: float) -> bool:
    return NEAREST_M < ahead_m < FARTHEST_M and abs(aside_m) < WIDE * ahead_m


def _beside(ego: Pose, poses: list[Pose], rng: np.random.Generator) -> Pose | None:
    """On our line of sight to one of them, up to 4 m before or behind it, a little aside."""
    if not poses:
        return None
    thing = poses[int(rng.integers(len(poses)))]
    shift = float(rng.choice([-1.0, 1.0], p=[0.65, 0.35]) * rng.uniform(0.4, 4.0))
    aside = float(rng.normal(0.0, 0.35))
    bearing = math.atan2(thing.y_m - ego.y_m, thing.x_m - ego.x_m)
    return replace(
        thing,
        x_m=thing.x_m + math.cos(bearing) * shift - math.sin(bearing) * aside,
        y_m=thing.y_m + math.sin(bearing) * shift + math.cos(bearing) * aside,
    )


def _somewhere(ego: Pose, reach_m: float, rng: np.random.Generator) -> Pose:
    ahead = float(np.exp(rng.uniform(np.log(NEAREST_M), np.log(FARTHEST_M))))
    aside = float(rng.uniform(-1.0, 1.0)) * min(reach_m, WIDE * ahead)
    c, s = math.cos(ego.yaw_rad), math.sin(ego.yaw_rad)
    return replace(ego, x_m=ego.x_m + c * ahead - s * aside, y_m=ego.y_m + s * ahead + c * aside)


def _near(middle: Pose, heading: float, rng: np.random.Generator) -> Pose:
    return replace(
        middle,
        x_m=middle.x_m + float(rng.normal(0, 0.6)),
        y_m=middle.y_m + float(rng.normal(0, 0.6)),
        z_m=float(rng.choice([0.0, 0.11])),
        yaw_rad=heading + float(rng.normal(0, 0.4)),
    )


def _person(id_: int, pose: Pose, split: Split, rng: np.random.Generator) -> Actor:
    return replace(drawn(rng, split, id_, "pedestrian", pose), walk_phase=float(rng.uniform()))


def _clear_of(pose: Pose, vehicle: Actor) -> bool:
    ahead, aside = in_ego_frame(vehicle.pose, pose.x_m, pose.y_m)
    return abs(ahead) > vehicle.length_m / 2 + 0.3 or abs(aside) > vehicle.width_m / 2 + 0.3

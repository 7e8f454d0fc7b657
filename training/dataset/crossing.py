"""Vehicles put across our way: what is seen of a vehicle that comes out of a side road is its flank.

A stage's own traffic keeps to the lanes, where one vehicle in twenty-five stands turned; cross traffic was found late.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from services.simulator.scene.scene import Actor, ActorKind, Pose, Scene
from training.stages.road_users import drawn
from training.stages.stage import Split

NEAREST_M, FARTHEST_M = 9.0, 75.0
WIDE = 0.72
"""A vehicle that stands further aside than this share of the distance ahead is beyond the wide camera's edge."""
TURNED_RAD = 0.35
"""Side roads meet ours at a right angle, more or less."""
KINDS: tuple[ActorKind, ...] = ("saloon", "estate", "van", "lorry", "bus", "motorcycle")
LIKELY = (0.34, 0.26, 0.16, 0.08, 0.06, 0.10)
ROOM_M = 0.5


def with_crossing(scene: Scene, split: Split, rng: np.random.Generator) -> Scene:
    """The scene with up to four vehicles more, 9 to 75 m ahead of the ego, which sees their flanks. None overlaps another actor."""
    others = list(scene.actors)
    first = max((actor.id for actor in scene.actors), default=0) + 1
    for _ in range(int(rng.integers(1, 5))):
        new = _vehicle(
            first, _somewhere(scene.ego, rng), split, rng, lit=any(actor.lights_on for actor in scene.actors)
        )
        if all(_apart(new, other) for other in others) and _ahead_m(scene.ego, new) > NEAREST_M:
            others.append(new)
            first += 1
    return replace(scene, actors=tuple(others))


def _somewhere(ego: Pose, rng: np.random.Generator) -> Pose:
    ahead = float(np.exp(rng.uniform(math.log(NEAREST_M + 4.0), math.log(FARTHEST_M))))
    aside = float(rng.uniform(-WIDE, WIDE)) * ahead
    c, s = math.cos(ego.yaw_rad), math.sin(ego.yaw_rad)
    heading = ego.yaw_rad + float(rng.choice([-1.0, 1.0])) * math.pi / 2 + float(rng.normal(0.0, TURNED_RAD))
    x_m, y_m = ego.x_m + c * ahead - s * aside, ego.y_m + s * ahead + c * aside
    return replace(ego, x_m=x_m, y_m=y_m, z_m=0.0, yaw_rad=heading)


def _vehicle(id_: int, pose: Pose, split: Split, rng: np.random.Generator, *, lit: bool) -> Actor:
    kind: ActorKind = rng.choice(KINDS, p=LIKELY)
    return replace(drawn(rng, split, id_, kind, pose), lights_on=lit and bool(rng.uniform() < 0.9))


def _apart(one: Actor, other: Actor) -> bool:
    reach = math.hypot(one.length_m, one.width_m) / 2 + math.hypot(other.length_m, other.width_m) / 2
    return math.dist((one.pose.x_m, one.pose.y_m), (other.pose.x_m, other.pose.y_m)) > reach + ROOM_M


def _ahead_m(ego: Pose, actor: Actor) -> float:
    return math.dist((ego.x_m, ego.y_m), (actor.pose.x_m, actor.pose.y_m)) - actor.length_m / 2

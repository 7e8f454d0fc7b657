"""Still objects at the road, as boxes that LiDAR meets: houses and trunks, posts as thin as they are, and what is fixed to them."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from services.simulator.scene.scene import Pose, Scenery, SignPost, StaticWorld, TrafficLight
from services.simulator.signart import face_size_m

LAMP_HEIGHT_M, POST_HEIGHT_M = 7.5, 1.0
MARKER_POST_M = (0.09, 0.12)
SCENERY_M = {
    "house": (9.0, 9.0, 7.0),
    "tower": (14.0, 12.0, 18.0),
    "tree": (0.5, 0.5, 5.0),
    "conifer": (0.5, 0.5, 6.0),
    "lamp": (0.16, 0.16, LAMP_HEIGHT_M),
    "post": (*MARKER_POST_M, POST_HEIGHT_M),
    "street_furniture": (0.3, 0.3, 1.2),
}
"""Length, width and height where the scenario leaves them to the looks."""
THIN = frozenset({"lamp", "post"})
"""What is no broader where it is higher."""
SIGN_POLE_M, LIGHT_POLE_M, ABOVE_FACE_M = 0.076, 0.14, 0.2
FACE_DEEP_M, BETWEEN_FACES_M = 0.03, 0.03
LIGHT_HEAD_M = (0.16, 0.46, 1.10)


class Solid(NamedTuple):
    """A box: the middle of its ground, length (along the pose's yaw), width, from which height on up to which."""

    pose: Pose
    length_m: float
    width_m: float
    base_m: float
    top_m: float


class Hung(NamedTuple):
    """A sign's face on its post: the height of its middle above the post's foot, and its size."""

    z_m: float
    width_m: float
    height_m: float


def hung(post: SignPost) -> Iterator[Hung]:
    """A post's faces, stacked downwards with a small gap."""
    z_m = post.height_m
    for part, face in enumerate(post.faces):
        width_m, height_m = face_size_m(face.country, face.code)
        if face.size_m > 0:
            width_m, height_m = face.size_m, height_m * face.size_m / width_m
        z_m -= height_m / 2 + BETWEEN_FACES_M if part else 0.0
        yield Hung(z_m, width_m, height_m)
        z_m -= height_m / 2


def solids(static: StaticWorld) -> Iterator[Solid]:
    """Everything that stands still and is no ground; a gantry, above all traffic, is left out."""
    for thing in static.scenery:
        yield from _scenery(thing)
    for sign in static.signs:
        yield from _sign(sign)
    for light in static.lights:
        yield from _light(light)


def _scenery(thing: Scenery) -> Iterator[Solid]:
    known = SCENERY_M.get(thing.kind)
    if known is None:
        return
    length_m, width_m, height_m = known
    if thing.kind not in THIN:
        length_m, width_m = thing.length_m or length_m, thing.width_m or width_m
    yield Solid(thing.pose, length_m, width_m, 0.0, thing.height_m or height_m)


def _sign(post: SignPost) -> Iterator[Solid]:
    yield Solid(post.pose, SIGN_POLE_M, SIGN_POLE_M, 0.0, post.height_m + ABOVE_FACE_M)
    for face in hung(post):
        half_m = face.height_m / 2
        yield Solid(post.pose, FACE_DEEP_M, face.width_m, face.z_m - half_m, face.z_m + half_m)


def _light(light: TrafficLight) -> Iterator[Solid]:
    length_m, width_m, height_m = LIGHT_HEAD_M
    low_m, high_m = light.height_m - height_m / 2, light.height_m + height_m / 2
    yield Solid(light.pose, LIGHT_POLE_M, LIGHT_POLE_M, 0.0, high_m)
    yield Solid(beside(light.pose, -light.arm_m), length_m, width_m, low_m, high_m)


def beside(pose: Pose, left_m: float) -> Pose:
    """The pose so far to its own left."""
    return replace(pose, x_m=pose.x_m - math.sin(pose.yaw_rad) * left_m, y_m=pose.y_m + math.cos(pose.yaw_rad) * left_m)

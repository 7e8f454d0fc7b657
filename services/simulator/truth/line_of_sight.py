"""Line of sight: how much of a body can be seen past houses, parked cars and lorries, on flat ground.

The road has no crests: what hides a hazard is a bend with houses, a row of parked cars, or a vehicle ahead.
"""

import math
from collections.abc import Iterable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from services.simulator.scene.scene import FRONT, Box, Pose, Scene, StaticWorld
from services.simulator.truth.hazards import HazardSource

HALF = 0.5
"""A hazard is in sight when at least this share of it is."""
ACROSS, UP = 8, 5
"""Points that are looked for on a body, across and up."""
LIT_M = 65.0
"""How far dipped headlamps show what carries no light; ours."""
HIDES_M = {"house": (9.0, 9.0, 7.0), "tower": (14.0, 12.0, 18.0)}
"""Length, width and height where the scenario leaves them to the looks."""
Boxes = NDArray[np.float64]
"""Rows of x, y, yaw, half length, half width, height."""


def boxes(bodies: Iterable[Box]) -> Boxes:
    """Bodies as rows."""
    rows = [(b.pose.x_m, b.pose.y_m, b.pose.yaw_rad, b.length_m / 2, b.width_m / 2, b.height_m) for b in bodies]
    return np.array(rows, dtype=np.float64).reshape(-1, 6)


def houses(static: StaticWorld) -> Boxes:
    """What of the scenery hides a vehicle: houses; trunks are too thin."""
    found = [(thing, HIDES_M[thing.kind]) for thing in static.scenery if thing.kind in HIDES_M]
    return boxes(
        Box(thing.pose, thing.length_m or size[0], thing.width_m or size[1], thing.height_m or size[2])
        for thing, size in found
    )


def eye(ego: Pose) -> tuple[float, float, float]:
    """Where the front camera is in the world: x, y, z."""
    c, s = math.cos(ego.yaw_rad), math.sin(ego.yaw_rad)
    return ego.x_m + FRONT.x_m * c, ego.y_m + FRONT.x_m * s, FRONT.z_m


def share_in_sight(ego: Pose, body: Box, hiding: Boxes) -> float:
    """The share of the body's outline, 0 to 1, that straight lines from the eye reach. `hiding` must not hold itself."""
    start = np.array(eye(ego))
    between = hiding[_between(start, body, hiding)]
    if not len(between):
        return 1.0
    goals = _outline(start, body)
    hidden = np.zeros(len(goals), dtype=bool)
    for row in between:
        hidden |= _meets(start, goals, row)
    return float(1.0 - hidden.mean())


def _outline(start: Boxes, body: Box) -> Boxes:
    """Points (ACROSS * UP, 3) over the body as it shows from there: as wide as its corners spread, at its middle."""
    pose, c, s = body.pose, math.cos(body.pose.yaw_rad), math.sin(body.pose.yaw_rad)
    away = np.array([pose.x_m - start[0], pose.y_m - start[1]])
    away /= max(float(np.hypot(*away)), 1e-6)
    aside = np.array([-away[1], away[0]])
    half = abs(body.length_m / 2 * float(aside @ (c, s))) + abs(body.width_m / 2 * float(aside @ (-s, c)))
    across = [(low + high) / 2 for low, high in pairwise(np.linspace(-half, half, ACROSS + 1))]
    up = [(low + high) / 2 for low, high in pairwise(np.linspace(body.foot_m, body.height_m, UP + 1))]
    return np.array([[pose.x_m + d * aside[0], pose.y_m + d * aside[1], z] for d in across for z in up])


def _between(start: Boxes, body: Box, hiding: Boxes) -> NDArray[np.bool_]:
    """Which could stand in the way: nearer than the body, and near the line to it."""
    way = np.array([body.pose.x_m - start[0], body.pose.y_m - start[1]])
    length = max(float(np.hypot(*way)), 1e-6)
    offset = hiding[:, :2] - start[:2]
    along, beside = offset @ way / length, offset @ np.array([-way[1], way[0]]) / length
    reach = np.hypot(hiding[:, 3], hiding[:, 4]) + max(body.length_m, body.width_m) / 2
    near: NDArray[np.bool_] = (along > -reach) & (along < length + reach) & (np.abs(beside) < reach)
    return near


def _meets(start: Boxes, goals: Boxes, row: Boxes) -> NDArray[np.bool_]:
    """Which lines of sight pass through a box."""
    x, y, yaw, half_length, half_width, height = row
    c, s = math.cos(yaw), math.sin(yaw)
    turn = np.array([[c, -s], [s, c]])
    origin, ends = (start[:2] - (x, y)) @ turn, (goals[:, :2] - (x, y)) @ turn
    low, high = np.zeros(len(goals)), np.ones(len(goals))
    for axis, half in ((0, half_length), (1, half_width)):
        slope = ends[:, axis] - origin[axis]
        slope = np.where(np.abs(slope) < 1e-9, 1e-9, slope)
        one, other = (-half - origin[axis]) / slope, (half - origin[axis]) / slope
        low, high = np.maximum(low, np.minimum(one, other)), np.minimum(high, np.maximum(one, other))
    rise = goals[:, 2] - start[2]
    lowest = np.minimum(start[2] + low * rise, start[2] + high * rise)
    met: NDArray[np.bool_] = (low < high) & (lowest < height)
    return met


class Sight:
    """What the ego has in sight at one instant: past houses and the road users of the scene, as far as air and light allow."""

    def __init__(self, houses: Boxes, scene: Scene, visibility_m: float, night: bool) -> None:
        self._ego, self._houses = scene.ego, houses
        self._actors = {actor.id: actor for actor in scene.actors if actor.kind != "pedestrian"}
        self._far_m, self._unlit_m = visibility_m, min(visibility_m, LIT_M if night else visibility_m)

    def shows(self, source: HazardSource) -> bool:
        """Whether a source can be perceived: seen, or felt where there is nothing to see."""
        return source.body is None or self.reaches(source.actor_id, source.body, source.lit)

    def reaches(self, own_id: int | None, body: Box, lit: bool) -> bool:
        """Whether at least half of a body is in sight; `own_id` is what it does not hide behind."""
        x, y, _ = eye(self._ego)
        if math.hypot(body.pose.x_m - x, body.pose.y_m - y) > (self._far_m if lit else self._unlit_m):
            return False
        others = boxes(Box.of(actor) for number, actor in self._actors.items() if number != own_id)
        return share_in_sight(self._ego, body, np.concatenate([self._houses, others])) >= HALF

"""An avenue of nothing but traffic lights, each in a state of its own: more heads, states, skies and distances than
drives of signs show. Heads stand on both sides and hang over the road, turned a little; the sun may stand on their lamps.

What "test" holds out: the random streams of places, states, skies and scenery. There is one head in the renderer.
"""

from collections.abc import Iterator

import numpy as np

from services.simulator.scene.scene import FRONT, TELE, Pose, StaticWorld, TrafficLight
from training.labelling import LabellingRenderer
from training.sign_pictures.avenue import (
    Avenue,
    Chance,
    Frame,
    any_atmosphere,
    any_state,
    frame_at,
    scenery_along,
    straight_road,
)

ROWS = 5
_SPACING_M, _FRAMES_EACH, _LATERAL_M = 32.0, 15, (-3.2, 6.8)


def light_avenue(split: str, seed: int) -> Avenue:
    """A road with heads right, left and above every 32 m."""
    chance = np.random.default_rng([seed, 83, len(split)])
    length = (ROWS + 2) * _SPACING_M
    heads = [head for row in range(ROWS) for head in _row(row, (row + 2) * _SPACING_M, chance)]
    static = StaticWorld(
        road=straight_road(length),
        lights=tuple(heads),
        scenery=scenery_along(length, chance),
        seed=seed,
    )
    return Avenue(static, length)


def _row(row: int, x_m: float, chance: Chance) -> Iterator[TrafficLight]:
    for place, y in enumerate((*_LATERAL_M, _LATERAL_M[0])):
        state = any_state(chance)
        above = place == len(_LATERAL_M)
        x = x_m + float(chance.uniform(-8, 8)) + (4.0 if above else 0.0)
        yaw = float(np.pi + np.clip(chance.normal(0, 0.15), -0.45, 0.45))
        pose = Pose(x_m=x, y_m=y + float(chance.uniform(-0.6, 0.6)), yaw_rad=yaw)
        height = float(chance.uniform(4.6, 5.6) if above else chance.uniform(2.2, 3.4))
        arm = float(chance.uniform(2.5, 5.0)) if above else 0.0
        yield TrafficLight(id=40_000 + 10 * row + place, pose=pose, state=state, arm_m=arm, height_m=height)


def drive_lights(split: str, seed: int, frames: int) -> Iterator[Frame]:
    """Frames at places of their own, three of four through the tele camera, a new sky for each third."""
    chance = np.random.default_rng([seed, 89])
    world, sky = light_avenue(split, seed), any_atmosphere(chance, split)
    renderer = LabellingRenderer(world.static)
    for number in range(frames):
        if number and number % _FRAMES_EACH == 0:
            world = light_avenue(split, seed + 7919 * (number // _FRAMES_EACH))
        if number % 3 == 0:
            sky = any_atmosphere(chance, split)
        x_m = float(chance.uniform(0, world.length_m - _SPACING_M))
        yield frame_at(renderer, world.static, x_m, TELE if number % 4 else FRONT, sky, chance)
    renderer.close()

"""What two sweeps would show of those whose range is measured: their near ends, now and one sweep before."""

from collections.abc import Iterable

import numpy as np

from evaluation.modelled_sensors.noise import normal
from evaluation.modelled_sensors.sight import Thing
from services.perception.range.camera import Floats
from services.perception.track.sweep_speed import Sweeps
from services.simulator.session import LIDAR_STEPS
from services.simulator.world import STEP_S

BETWEEN_S = LIDAR_STEPS * STEP_S
WAY_SIGMA_M, LONELY_SIGMA_M = 0.06, 0.2
"""How far off the way from one sweep to the next is, where several returns tell the ends and where one does: as `lookback` measured
it of 3,100 vehicles."""
UP_M = 0.8


def swept(
    measured: Iterable[tuple[Thing, float, bool]],
    camera_m: tuple[float, float],
    speed_mps: float,
    seed: int,
    *names: int | str,
) -> Sweeps:
    """Sweeps in the ego frame. `measured`: things with the depth that was measured, and whether one return tells of it alone.

    `camera_m`: where the camera sits, ahead and to the left. `names`: of the picture, for what is drawn.
    """
    latest: list[tuple[float, float, float]] = []
    before: list[tuple[float, float, float]] = []
    for thing, depth_m, lonely in measured:
        if thing.sides_m is None:
            continue
        x_m, y_m = camera_m[0] + depth_m, camera_m[1] - sum(thing.sides_m) / 2
        off_m = (LONELY_SIGMA_M if lonely else WAY_SIGMA_M) * normal(seed, "way", thing.key, *names)
        then_m = x_m - (thing.ahead_mps - speed_mps) * BETWEEN_S + off_m
        count = 1 if lonely else 2
        latest += count * [(x_m, y_m, UP_M)]
        before += count * [(then_m, y_m, UP_M)]
    return Sweeps(_points(latest), _points(before), 0.0, BETWEEN_S)


def _points(rows: list[tuple[float, float, float]]) -> Floats:
    return np.array(rows, np.float64).reshape(-1, 3)

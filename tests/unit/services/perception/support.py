"""Sightings of vehicles, and drives behind one."""

import numpy as np

from services.perception.range.sizes import CAR
from services.perception.track.kalman import Fix
from services.perception.track.road_user import EgoState, Sighting
from services.perception.track.tracker import Tracker

STEP_NS = 100_000_000


def sighting(x_m: float, y_m: float, sigma_m: float = 0.3, score: float = 0.8, age_s: float = 0.0) -> Sighting:
    covariance = np.diag([sigma_m**2, 0.25**2])
    return Sighting(kind="vehicle", fix=Fix(np.array([x_m, y_m]), covariance, age_s), score=score, body=CAR)


def drive(
    tracker: Tracker, steps: int, gap_m: float, closing_mps: float, *, first: int = 1, speed: float = 20.0
) -> set[int]:
    """A vehicle straight ahead seen `steps` times with noise; the ids it had."""
    rng = np.random.default_rng(3)
    ids: set[int] = set()
    for k in range(first, first + steps):
        x = gap_m - closing_mps * k * 0.1 + rng.normal(0, 0.2)
        ids.update(tracker.step(k * STEP_NS, [sighting(x, rng.normal(0, 0.1))], EgoState(speed, 0.0)))
    return ids


def steady(tracker: Tracker, k: int, *places: tuple[float, float]) -> float | None:
    tracker.step(k * STEP_NS, [sighting(x_m, y_m, 0.1) for x_m, y_m in places], EgoState(20.0, 0.0))
    return tracker.published()[0].steady_s

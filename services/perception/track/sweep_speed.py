"""Speed from two LiDAR sweeps, for a track whose ranges were estimates so far: where it was one sweep ago."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from services.perception.range.box_range import GROUND_CLEARANCE_M
from services.perception.track.kalman import Estimate, Fix, Floats

ABOVE_M = (GROUND_CLEARANCE_M, 3.0)
"""Returns from between these heights are of bodies."""
HALF_WIDTH_M = 1.2
"""To either side of a thing's middle."""
SLACK_M = 1.5
"""By how much a fix may differ from the nearest return that it was made of."""
SIGMAS, NOISE_M, MOST_M = 3.0, 0.3, 3.0
"""It is looked for where its speed leads, so many sigmas, and a little, about; further off than the last, it could be another."""
FREE_M = 3.0
"""Nothing may lie so closely before it: what goes on there, as a rail does, has no near end."""
DEEP_M = 1.0
"""Returns no further behind the nearest than this are of the same end."""
LONELY_SIGMA_M, SIGMA_M = 0.4, 0.15
"""How well one return, and several, tell where that end is. Of 3,100 vehicles 15 m ahead and further the way between two sweeps
was wrong by 0.2 m where one of the ends was a single return, else by 0.03 to 0.08 m (root mean square)."""
LEAST_BETWEEN_S, MOST_BETWEEN_S = 0.02, 0.25
"""Between the two sweeps."""
SAME_AGE_S = 1e-3
UNKNOWN_SIGMA_M = 5.0
"""Of the lateral place then: it is looked for where it is now."""


@dataclass(frozen=True, slots=True, eq=False)
class Sweeps:
    """Returns (N, 3 or more) of the latest sweep and of the one before, each in the ego frame of its instant.

    How old they are, and how far the ego turned to the left from one to the other.
    """

    latest: Floats
    before: Floats
    age_s: float
    before_age_s: float
    turned_rad: float = 0.0


def fix_before(estimate: Estimate, fix: Fix, sweeps: Sweeps) -> Fix | None:
    """Where the near end of what `fix` measured was one sweep earlier; None where the sweeps do not tell.

    Both sweeps are read alike, so that what is wrong with the near end in one is as wrong in the other.
    """
    between_s = sweeps.before_age_s - sweeps.age_s
    if abs(fix.age_s - sweeps.age_s) > SAME_AGE_S or not LEAST_BETWEEN_S <= between_s <= MOST_BETWEEN_S:
        return None
    x, y = fix.place.tolist()
    _, _, vx, vy = estimate.mean.tolist()
    now = _near_end(sweeps.latest, x, y, SLACK_M)
    if now is None:
        return None
    slack = min(MOST_M, SIGMAS * math.sqrt(float(estimate.covariance[2, 2])) * between_s + NOISE_M)
    before = turned(sweeps.before, -sweeps.turned_rad)
    then = _near_end(before, now[0] - vx * between_s, y - vy * between_s, slack)
    if then is None:
        return None
    place = np.array([x + then[0] - now[0], y])
    return Fix(place, np.diag([now[1] ** 2 + then[1] ** 2, UNKNOWN_SIGMA_M**2]), sweeps.before_age_s)


def _near_end(points: Floats, x_m: float, y_m: float, slack_m: float) -> tuple[float, float] | None:
    """How far ahead the nearest return there is, and its sigma; `None` without one, or where something goes on before it."""
    aside = np.abs(points[:, 1] - y_m) < HALF_WIDTH_M
    body = (points[:, 2] > ABOVE_M[0]) & (points[:, 2] < ABOVE_M[1])
    ahead = points[aside & body & (np.abs(points[:, 0] - x_m + FREE_M / 2) < slack_m + FREE_M / 2), 0]
    if not len(ahead) or ahead.min() < x_m - slack_m:
        return None
    several = int((ahead < ahead.min() + DEEP_M).sum()) > 1
    return float(ahead.min()), SIGMA_M if several else LONELY_SIGMA_M


def turned(points: Floats, angle_rad: float) -> Floats:
    """Points (N, 3 or more; m, x ahead, y left) as (N, 3), turned to the left about the ego."""
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    there: Floats = points[:, :3] @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return there

"""From grip and sight to speed and distance, by stopping distance."""

import math

G_MPS2 = 9.81
MU_REFERENCE = 0.70
"""The grip that limits take for granted: the lower end of a dry road. Dry gives factors of exactly 1."""
REACTION_S = 1.5
"""Driver's reaction and brake build-up; design guides use 1 to 2.5 s."""
SIGHT_MARGIN_M = 5.0
MIN_REFERENCE_MPS, UNKNOWN_REFERENCE_MPS = 22.2, 27.8
MIN_FACTOR, MAX_FOLLOWING = 0.1, 4.0


def stopping_distance_m(speed_mps: float, mu: float) -> float:
    """v t + v^2 / (2 mu g)."""
    return speed_mps * REACTION_S + speed_mps**2 / (2.0 * mu * G_MPS2)


def speed_for_distance_mps(distance_m: float, mu: float) -> float:
    """The speed from which one stops within `distance_m`: the positive root of the same equation."""
    if distance_m <= 0.0:
        return 0.0
    brake = mu * G_MPS2
    return brake * (math.sqrt(REACTION_S**2 + 2.0 * distance_m / brake) - REACTION_S)


def reference_speed_mps(speed_mps: float | None, limit_mps: float | None) -> float:
    """The speed that the factors are worked out for: the limit where it is known; else the ego's, and no less than 80
    km/h, for a limit may lie above
    what is driven and factors fall with speed."""
    if limit_mps is not None:
        return max(limit_mps, 1.0)
    return UNKNOWN_REFERENCE_MPS if speed_mps is None else max(speed_mps, MIN_REFERENCE_MPS)


def safe_speed_mps(mu_low: float, sight_m: float | None) -> float | None:
    """The speed from which one stops within sight; None where sight is unknown."""
    return None if sight_m is None else speed_for_distance_mps(sight_m - SIGHT_MARGIN_M, mu_low)


def speed_factor(reference_mps: float, mu_low: float, sight_m: float | None) -> float:
    """What a limit is scaled with, in [MIN_FACTOR, 1]: stop within the distance that the reference grip gives at the
    limit, and within sight.
    """
    grip = speed_for_distance_mps(stopping_distance_m(reference_mps, MU_REFERENCE), mu_low) / reference_mps
    safe = safe_speed_mps(mu_low, sight_m)
    factor = grip if safe is None else min(grip, safe / reference_mps)
    return min(1.0, max(MIN_FACTOR, factor))


def following_factor(reference_mps: float, mu_low: float, sight_m: float | None) -> float:
    """What the following distance is scaled with, in [1, MAX_FOLLOWING]: by the stopping distance; by a quarter more
    where sight is short.
    """
    ratio = stopping_distance_m(reference_mps, mu_low) / stopping_distance_m(reference_mps, MU_REFERENCE)
    short = 1.25 if sight_m is not None and sight_m < 200.0 else 1.0
    return min(MAX_FOLLOWING, max(1.0, ratio) * short)

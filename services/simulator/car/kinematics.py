"""Braking, following and bends as plain functions of distances and speeds; SI units, decelerations as negative numbers."""

import math

from domain.kinematics import GRAVITY_MPS2

COMFORT_MPS2 = 1.2
"""A stop is begun once it would take this much."""
LATERAL_COMFORT_MPS2 = 2.2
"""Bends are taken with no more than this across."""
STAND_BEFORE_M = 0.6
FREE = math.inf


def stopping_mps2(speed_mps: float, distance_m: float, urgent_mps2: float = COMFORT_MPS2) -> float:
    """Acceleration to stand `distance_m` ahead; `FREE` while it is too early to begin. Beyond: full braking."""
    if distance_m <= STAND_BEFORE_M:
        return -max(speed_mps * 4.0, 2.0)
    needed = speed_mps * speed_mps / (2.0 * (distance_m - STAND_BEFORE_M / 2))
    if needed < urgent_mps2 and distance_m > 4.0:
        return FREE
    return -max(needed, min(0.6, urgent_mps2))


def following_mps2(
    speed_mps: float, lead_mps: float, gap_m: float, *, headway_s: float, stand_m: float, a_mps2: float, b_mps2: float
) -> float:
    """The interaction term of the intelligent driver model (Treiber, Hennecke, Helbing 2000)."""
    closing = speed_mps - lead_mps
    wanted = stand_m + max(0.0, speed_mps * headway_s + speed_mps * closing / (2.0 * math.sqrt(a_mps2 * b_mps2)))
    return -a_mps2 * (wanted / max(gap_m, 0.3)) ** 2


def free_road_mps2(speed_mps: float, wanted_mps: float, a_mps2: float) -> float:
    """The free term of the same model, gentle above the wanted speed: a foot off the pedal, not an emergency."""
    if wanted_mps <= 0.1:
        return -max(speed_mps, 1.0)
    ratio = speed_mps / wanted_mps
    if ratio > 1.0:
        return max(-1.0 - 1.5 * (ratio - 1.0) * 4.0, -3.0) * min(1.0, (speed_mps - wanted_mps) / 1.0)
    return a_mps2 * (1.0 - ratio**4)


def bend_speed_mps(curvature: float) -> float:
    """The speed at which a bend is comfortable; `FREE` on a straight."""
    return math.sqrt(LATERAL_COMFORT_MPS2 / curvature) if curvature > 1e-4 else FREE


def clip_by_grip(acceleration_mps2: float, mu: float) -> float:
    """No more than the tyres give."""
    limit = mu * GRAVITY_MPS2
    return min(max(acceleration_mps2, -limit), limit)

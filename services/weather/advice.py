"""From grip, sight and wind to speed and distance, by stopping distance."""

import math
from typing import Literal, NamedTuple

from domain.kinematics import GRAVITY_MPS2

MU_REFERENCE = 0.70
"""The grip that limits take for granted: just below the lower end of a dry road, so that dry gives factors of 1."""
REACTION_S = 1.5
"""Driver's reaction and brake build-up; design guides use 1 to 2.5 s."""
SIGHT_MARGIN_M = 5.0
MIN_REFERENCE_MPS, UNKNOWN_REFERENCE_MPS = 80.0 / 3.6, 100.0 / 3.6
MIN_FACTOR, MAX_FOLLOWING = 0.1, 4.0
MAX_SIGHT_WIDENING = 1.25
"""Where one cannot stop within sight, the gap is widened by how much stopping exceeds sight, up to this (ours)."""

Bounded = Literal["none", "grip", "sight", "wind"]


class Road(NamedTuple):
    """What speed and distance are worked out from."""

    mu_low: float
    sight_m: float | None = None
    wind_mps: float | None = None
    """The speed that gusts allow."""
    brakes: float = 1.0
    """Share of ordinary braking that the car still has."""


class Advice(NamedTuple):
    """Speed and distance, and what they were worked out from."""

    speed_factor: float
    following_factor: float
    safe_speed_mps: float | None
    stopping_m: float
    """From the reference speed, on this road with these brakes."""
    usual_m: float
    """From the reference speed, on a dry road with sound brakes."""
    bounded_by: Bounded


def stopping_distance_m(speed_mps: float, mu: float) -> float:
    """v t + v^2 / (2 mu g)."""
    return speed_mps * REACTION_S + speed_mps**2 / (2.0 * mu * GRAVITY_MPS2)


def speed_for_distance_mps(distance_m: float, mu: float) -> float:
    """The speed from which one stops within `distance_m`: the positive root of the same equation."""
    if distance_m <= 0.0:
        return 0.0
    brake = mu * GRAVITY_MPS2
    return brake * (math.sqrt(REACTION_S**2 + 2.0 * distance_m / brake) - REACTION_S)


def reference_speed_mps(speed_mps: float | None, limit_mps: float | None) -> float:
    """The speed that the factors are worked out for: the limit where it is known; else the ego's, and no less than 80
    km/h, for a limit may lie above what is driven and factors fall with speed.
    """
    if limit_mps is not None:
        return max(limit_mps, 1.0)
    return UNKNOWN_REFERENCE_MPS if speed_mps is None else max(speed_mps, MIN_REFERENCE_MPS)


def advise(reference_mps: float, road: Road) -> Advice:
    """Stop within the distance that the reference grip gives at the limit, and within sight; stand against the gusts.

    Weak brakes lengthen every stop, but lower the speed by sight alone: for grip, the car's own factor does.
    """
    usual = stopping_distance_m(reference_mps, MU_REFERENCE)
    stopping = stopping_distance_m(reference_mps, road.brakes * road.mu_low)
    safe = safe_speed_mps(road)
    shares: dict[Bounded, float] = {
        "none": 1.0,
        "grip": speed_for_distance_mps(usual, road.mu_low) / reference_mps,
        "sight": 1.0 if safe is None else safe / reference_mps,
        "wind": 1.0 if road.wind_mps is None else road.wind_mps / reference_mps,
    }
    bounded_by = min(shares, key=lambda name: (round(shares[name], 6), name != "none"))
    return Advice(
        speed_factor=min(1.0, max(MIN_FACTOR, shares[bounded_by])),
        following_factor=_following(stopping, usual, road.sight_m),
        safe_speed_mps=safe,
        stopping_m=stopping,
        usual_m=usual,
        bounded_by=bounded_by,
    )


def safe_speed_mps(road: Road) -> float | None:
    """The speed from which one stops within sight; None where sight is unknown."""
    if road.sight_m is None:
        return None
    return speed_for_distance_mps(road.sight_m - SIGHT_MARGIN_M, road.brakes * road.mu_low)


def _following(stopping_m: float, usual_m: float, sight_m: float | None) -> float:
    """By the stopping distance; by up to a quarter more where it exceeds sight: then only the vehicle ahead warns."""
    unseen = 1.0 if sight_m is None else stopping_m / max(1.0, sight_m - SIGHT_MARGIN_M)
    widened = min(MAX_SIGHT_WIDENING, max(1.0, unseen))
    return min(MAX_FOLLOWING, max(1.0, stopping_m / usual_m) * widened)

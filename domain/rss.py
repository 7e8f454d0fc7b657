"""Responsibility-Sensitive Safety: the distances that must not be undercut.

Formulas: Shalev-Shwartz, Shammah, Shashua, "On a Formal Model of Safe and Scalable Self-driving Cars" (2017), definitions
1, 2 and 6. The simplified d_min of the paper is `same_direction` with acceleration 0, a standing lead, brake_min = mu g,
margin d0 and rho = t_r. Speeds m/s, distances m, decelerations positive.
"""

import math

import msgspec

from domain.kinematics import GRAVITY_MPS2 as GRAVITY_MPS2


class Longitudinal(msgspec.Struct, frozen=True, kw_only=True):
    """A driver's response: `rho_s` of accelerating, then braking with at least `brake_min_mps2`."""

    rho_s: float
    accel_max_mps2: float
    brake_min_mps2: float


class Lateral(msgspec.Struct, frozen=True, kw_only=True):
    """The same sideways; `fluctuation_m` is what a car wavers within its lane without meaning it."""

    rho_s: float
    accel_max_mps2: float
    brake_min_mps2: float
    fluctuation_m: float


def braking_distance_m(speed_mps: float, brake_mps2: float) -> float:
    """From `speed_mps` to a halt; infinite without brakes, 0 when standing."""
    if speed_mps <= 0.0:
        return 0.0
    return speed_mps * speed_mps / (2.0 * brake_mps2) if brake_mps2 > 0.0 else math.inf


def stopping_distance_m(speed_mps: float, who: Longitudinal) -> float:
    """The worst way to a halt: accelerate through the response time, then brake no harder than one must."""
    speed = max(0.0, speed_mps)
    after = speed + who.rho_s * who.accel_max_mps2
    return (speed + after) / 2.0 * who.rho_s + braking_distance_m(after, who.brake_min_mps2)


def same_direction_m(follow_mps: float, lead_mps: float, follower: Longitudinal, lead_brake_max_mps2: float) -> float:
    """Least safe gap behind a lead that may brake with `lead_brake_max_mps2` at any moment."""
    return max(0.0, stopping_distance_m(follow_mps, follower) - braking_distance_m(lead_mps, lead_brake_max_mps2))


def opposite_direction_m(correct_mps: float, wrong_mps: float, correct: Longitudinal, wrong: Longitudinal) -> float:
    """Least safe gap between two that drive towards each other; both speeds positive, both must stop."""
    return stopping_distance_m(correct_mps, correct) + stopping_distance_m(wrong_mps, wrong)


def lateral_m(left_mps: float, right_mps: float, left: Lateral, right: Lateral) -> float:
    """Least safe gap between neighbours; speeds positive to the RIGHT, so `left_mps` > 0 moves towards the other."""
    gap = _sideways_m(left_mps, left) + _sideways_m(-right_mps, right)
    return max(0.0, gap + max(left.fluctuation_m, right.fluctuation_m))


def _sideways_m(towards_mps: float, who: Lateral) -> float:
    after = towards_mps + who.rho_s * who.accel_max_mps2
    return (towards_mps + after) / 2.0 * who.rho_s + braking_distance_m(after, who.brake_min_mps2)


def paper_d_min_m(speed_mps: float, mu: float, t_r_s: float, d0_m: float) -> float:
    """The paper's d_min(v, mu): blind to the lead's speed."""
    follower = Longitudinal(rho_s=t_r_s, accel_max_mps2=0.0, brake_min_mps2=mu * GRAVITY_MPS2)
    return same_direction_m(speed_mps, 0.0, follower, math.inf) + d0_m

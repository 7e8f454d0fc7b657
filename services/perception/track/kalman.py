"""A constant-velocity Kalman filter of one road user in the moving ego frame.

State: place of its near surface and velocity relative to the ego, (x, y, vx, vy), x forward and y left. Between two
instants the ego moves: the frame turns by its yaw, and what the ego gains in speed every other loses relative to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class EgoMotion:
    """The ego over one step; None where it is unknown (never taken for zero silently: the noise grows)."""

    dt_s: float
    speed_mps: float | None = None
    speed_before_mps: float | None = None
    yaw_rate_radps: float | None = None

    @property
    def turn_rad(self) -> float:
        """By how much the frame turned to the left."""
        return (self.yaw_rate_radps or 0.0) * self.dt_s


@dataclass(frozen=True, slots=True, kw_only=True)
class Noise:
    """Unmodelled accelerations (one sigma, m/s^2) along and across the ego's direction."""

    along_mps2: float
    across_mps2: float


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """Mean (4,) and covariance (4, 4)."""

    mean: Floats
    covariance: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Fix:
    """A measured place (2,) with its covariance (2, 2); `age_s` is how much older the range is than the picture."""

    place: Floats
    covariance: Floats
    age_s: float = 0.0

    def matrix(self) -> Floats:
        """How the state shows in the measurement."""
        return np.array([[1.0, 0.0, -self.age_s, 0.0], [0.0, 1.0, 0.0, 0.0]])


UNKNOWN_SPEED_NOISE_MPS2 = 2.0
"""Added along where the ego's speed is unknown: then its own braking looks like theirs."""
UNKNOWN_YAW_NOISE_RADPS = 0.05


def predict(estimate: Estimate, motion: EgoMotion, noise: Noise) -> Estimate:
    """The estimate one step later, in the ego frame of that instant."""
    dt = motion.dt_s
    step = np.eye(4)
    step[0, 2] = step[1, 3] = dt
    mean, covariance = step @ estimate.mean, step @ estimate.covariance @ step.T
    covariance = covariance + _process(estimate.mean, motion, noise)
    turn = _turn(-motion.turn_rad)
    if motion.speed_mps is not None:
        before = motion.speed_mps if motion.speed_before_mps is None else motion.speed_before_mps
        mean = turn @ (mean + np.array([0.0, 0.0, before, 0.0])) - np.array([0.0, 0.0, motion.speed_mps, 0.0])
    else:
        mean = turn @ mean
    return Estimate(mean, turn @ covariance @ turn.T)


def _process(mean: Floats, motion: EgoMotion, noise: Noise) -> Floats:
    dt = motion.dt_s
    along, across = noise.along_mps2, noise.across_mps2
    if motion.speed_mps is None:
        along += UNKNOWN_SPEED_NOISE_MPS2
    gain = np.array([[dt * dt / 2, 0.0], [0.0, dt * dt / 2], [dt, 0.0], [0.0, dt]])
    process: Floats = gain @ np.diag([along**2, across**2]) @ gain.T
    if motion.yaw_rate_radps is None:
        process[1, 1] += (UNKNOWN_YAW_NOISE_RADPS * dt * mean[0]) ** 2
    return process


def _turn(angle_rad: float) -> Floats:
    c, s = math.cos(angle_rad), math.sin(angle_rad)
    turn = np.zeros((4, 4))
    turn[:2, :2] = turn[2:, 2:] = ((c, -s), (s, c))
    return turn


def widened(estimate: Estimate, factor: float) -> Estimate:
    """The same place and speed, its variances so many times as large."""
    return Estimate(estimate.mean, factor * estimate.covariance)


def displaced(estimate: Estimate, fix: Fix) -> Estimate:
    """The same place and speed, the place unsure by as much as the fix is off: the way between says nothing of the speed."""
    off = fix.place - (fix.matrix() @ estimate.mean)
    covariance = estimate.covariance.copy()
    covariance[:2, :2] += np.outer(off, off)
    return Estimate(estimate.mean, covariance)


def correction(estimate: Estimate, fix: Fix) -> float:
    """The factor by which a fix corrects the range (0.5 to 2)."""
    expected = max(1.0, float((fix.matrix() @ estimate.mean)[0]))
    return min(2.0, max(0.5, float(fix.place[0]) / expected))


def rescaled(estimate: Estimate, fix: Fix) -> Estimate:
    """Place and speed times that factor: guessed ranges are wrong by one in every picture, and so is the speed made of them."""
    return Estimate(correction(estimate, fix) * estimate.mean, estimate.covariance)


def distance(estimate: Estimate, fix: Fix) -> tuple[float, float]:
    """Squared Mahalanobis distance of a fix from the estimate, and the same plus the spread's logarithm as a cost.

    Written out in plain numbers: it runs for every pair of track and fix, where numpy's calls would cost most.
    """
    x, y, vx, _ = estimate.mean.tolist()
    p, age = estimate.covariance.tolist(), fix.age_s
    (r00, r01), (_, r11) = fix.covariance.tolist()
    place_x, place_y = fix.place.tolist()
    dx, dy = place_x - (x - age * vx), place_y - y
    s00 = p[0][0] - 2 * age * p[0][2] + age * age * p[2][2] + r00
    s01 = p[0][1] - age * p[2][1] + r01
    s11 = p[1][1] + r11
    determinant = max(s00 * s11 - s01 * s01, 1e-12)
    squared = (dx * dx * s11 - 2 * dx * dy * s01 + dy * dy * s00) / determinant
    return squared, squared + math.log(determinant)


def update(estimate: Estimate, fix: Fix) -> Estimate:
    """The estimate after a fix (Joseph form, so that the covariance stays positive)."""
    return _updated(estimate, fix.matrix(), fix.place, fix.covariance)


def with_speed(estimate: Estimate, speed_mps: Floats, sigma_mps: float) -> Estimate:
    """The estimate after a measured velocity (2,) relative to the ego."""
    return _updated(estimate, np.eye(4)[2:], speed_mps, np.eye(2) * sigma_mps**2)


def _updated(estimate: Estimate, matrix: Floats, value: Floats, noise: Floats) -> Estimate:
    spread = matrix @ estimate.covariance @ matrix.T + noise
    gain = np.linalg.solve(spread, matrix @ estimate.covariance).T
    keep = np.eye(4) - gain @ matrix
    covariance = keep @ estimate.covariance @ keep.T + gain @ noise @ gain.T
    return Estimate(estimate.mean + gain @ (value - matrix @ estimate.mean), (covariance + covariance.T) / 2)

"""Live friction from how far the wheels slip under a known braking: the brush model of a tyre.

With x = C s / mu up to 3, the share of the grip that is used is 1 - (1 - x / 3)^3: C is the tyre's stiffness for each
unit of its load, s the slip (Pacejka, Tire and Vehicle Dynamics, ch. 3; used so for estimating friction by Svendenius,
Tire Modeling and Friction Estimation, Lund 2007). Little braking says little: a tyre that is hardly strained is as
stiff on ice as on asphalt. So nothing is told until the wheels slip more than the softest tyre would on a good road,
past some four fifths of the grip.
"""

import math
from collections import deque
from statistics import fmean
from typing import NamedTuple

from domain.kinematics import GRAVITY_MPS2
from proto.vehicle import Ego
from services.weather.observations.observation import Interval

STIFF, SOFT = 45.0, 18.0
"""C of a stiff summer tyre and of a soft winter tyre (ours, around the 20 to 40 of the literature)."""
SLIP_ERROR = 0.002
"""What unequal wheel radii and noise leave in a slip averaged over four wheels and half a second."""
SKEW_S = 0.06
"""By so much wheel speeds and vehicle speed may be apart in time, over the bus and its filters: while the car brakes,
that alone looks like slip.
"""
STEADY = 0.25
"""Braking may change by this share within the window: where it comes or goes, slip and deceleration are of different
moments.
"""
MOST_MU = 1.2
TOLD_UP_TO = 0.85
"""An upper bound above this is a dry road's, and tells nothing."""
LEAST_BRAKING_MPS2 = 0.7
LEAST_SPEED_MPS = 10.0
MOST_YAW_RADPS = 0.15
"""In a bend the wheels run on different arcs, and the tyre spends grip sideways."""
NS = 1_000_000_000
WINDOW_NS, LEAST_SAMPLES, KEPT_NS = NS // 2, 6, 2 * NS


def mu_of(braking: float, slip: float, stiffness: float) -> float:
    """The mu at which this slip brakes with `braking` (in g): no less than that, `MOST_MU` where the tyre is not yet
    strained at all.
    """
    force = stiffness * slip
    if force <= braking:
        return MOST_MU
    strained = 1.0 - braking / force
    if strained >= 2.0 / 3.0:
        return braking  # all of it slides
    x = 4.5 * (1.0 - math.sqrt(1.0 - 4.0 * strained / 3.0))
    return min(MOST_MU, max(braking, force / x))


def slip_error(braking: float, speed_mps: float) -> float:
    """How far a measured slip may be from the true one while braking with `braking` (in g)."""
    return SLIP_ERROR + SKEW_S * braking * GRAVITY_MPS2 / speed_mps


def friction(braking: float, slip: float, error: float = SLIP_ERROR) -> Interval:
    """Where mu lies: the stiff tyre and more slip below, the soft one and less slip above."""
    low = mu_of(braking, slip + error, STIFF)
    return Interval(low, max(low, mu_of(braking, max(0.0, slip - error), SOFT)))


class _Sample(NamedTuple):
    stamp_ns: int
    braking: float
    slip: float
    speed_mps: float


class Braking:
    """Gathers what the car does while it brakes straight ahead."""

    def __init__(self) -> None:
        self._samples: deque[_Sample] = deque(maxlen=64)
        self._last: tuple[Interval, int] | None = None

    def add(self, ego: Ego, stamp_ns: int) -> None:
        """One state of the car; a pause in braking begins anew."""
        sample = _sample(ego, stamp_ns)
        if sample is None:
            self._samples.clear()
            return
        self._samples.append(sample)
        while stamp_ns - self._samples[0].stamp_ns > WINDOW_NS:
            self._samples.popleft()
        if len(self._samples) >= LEAST_SAMPLES and self._steady():
            braking, slip = fmean(each.braking for each in self._samples), fmean(each.slip for each in self._samples)
            error = slip_error(braking, min(each.speed_mps for each in self._samples))
            self._last = friction(braking, slip, error), stamp_ns

    def _steady(self) -> bool:
        braking = [each.braking for each in self._samples]
        return max(braking) - min(braking) <= STEADY * fmean(braking)

    def friction(self, now_ns: int) -> Interval | None:
        """Where mu lies by the last braking; None where that told nothing, or was more than two seconds ago."""
        if self._last is None or not 0 <= now_ns - self._last[1] <= KEPT_NS or self._last[0].high > TOLD_UP_TO:
            return None
        return self._last[0]


def _sample(ego: Ego, stamp_ns: int) -> _Sample | None:
    if ego.acceleration_mps2 is None or ego.wheel_slip is None or ego.speed_mps is None:
        return None
    straight = ego.yaw_rate_radps is not None and abs(ego.yaw_rate_radps) <= MOST_YAW_RADPS
    braked = ego.brake_pedal is None or ego.brake_pedal > 0.0
    fast = ego.speed_mps >= LEAST_SPEED_MPS
    if not (straight and braked and fast and ego.acceleration_mps2 <= -LEAST_BRAKING_MPS2) or ego.abs_active:
        return None
    return _Sample(stamp_ns, -ego.acceleration_mps2 / GRAVITY_MPS2, max(0.0, ego.wheel_slip), ego.speed_mps)

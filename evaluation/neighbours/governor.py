"""The simulated human with a governor: the car is kept below the highest speed at which true RSS holds. No word is said."""

import math

from evaluation.metrics.conflicts import (
    ACCEL_MAX_MPS2,
    LEAD_BRAKE_MPS2,
    RESPONSE_S,
    braking_mps2,
    gap_m,
    person_ahead,
)
from proto.truth import Truth
from services.arbiter import rss
from services.simulator.driver import Driver, View, Wish, pedals

FASTEST_MPS = 80.0
_HALVINGS = 40


class Governed(Driver):
    """Drives as ever, but no faster than the governor lets him."""

    truth: Truth | None = None
    """The newest; the drive sets it before each step."""

    def drive(self, view: View, dt: float) -> Wish:
        """The driver's wish, or less."""
        wish = super().drive(view, dt)
        if self.truth is None:
            return wish
        most = governed_mps2(view.speed_mps, self.truth, dt)
        return wish if wish.acceleration_mps2 <= most else pedals(most)


def governed_mps2(speed_mps: float, truth: Truth, dt: float) -> float:
    """The most that may be accelerated for a step; beyond the cap what is braked, up to what grip and brakes allow."""
    cap = cap_mps(truth)
    return math.inf if cap >= FASTEST_MPS else max((cap - speed_mps) / dt, -braking_mps2(truth))


def cap_mps(truth: Truth) -> float:
    """The highest speed at which the gaps to the lead and to a person in the path are RSS distances. 0: none is."""
    if safe(FASTEST_MPS, truth):
        return FASTEST_MPS
    low, high = 0.0, FASTEST_MPS
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        low, high = (middle, high) if safe(middle, truth) else (low, middle)
    return low


def safe(speed_mps: float, truth: Truth) -> bool:
    """Whether no RSS distance would be undercut at that speed; the constants are those by which interventions are judged."""
    ego = rss.Longitudinal(rho_s=RESPONSE_S, accel_max_mps2=ACCEL_MAX_MPS2, brake_min_mps2=braking_mps2(truth))
    person = person_ahead(truth)
    if person is not None and gap_m(person) < rss.stopping_distance_m(speed_mps, ego):
        return False
    if truth.gap_m is None or truth.closing_mps is None:
        return True
    lead_mps = truth.speed_mps - truth.closing_mps
    least_m = (
        rss.same_direction_m(speed_mps, lead_mps, ego, LEAD_BRAKE_MPS2)
        if lead_mps >= 0.0
        else rss.opposite_direction_m(speed_mps, -lead_mps, ego, ego)
    )
    return truth.gap_m >= least_m

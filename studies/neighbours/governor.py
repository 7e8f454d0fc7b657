"""The simulated human with a governor: the car is kept below the highest speed at which true RSS holds. No word is said."""

import math

from evaluation.metrics.conflicts import braking_mps2, violates_rss
from proto.truth import Truth
from services.simulator.driver.driver import Driver, DriverView, Wish, pedals

FASTEST_MPS = 80.0
_HALVINGS = 40


class Governed(Driver):
    """The simulated driver, with the governor's speed as the upper bound."""

    truth: Truth | None = None
    """The newest; the drive sets it before each step."""

    def drive(self, view: DriverView, dt: float) -> Wish:
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
    """The highest speed at which the gaps to the lead and to a person in the path are RSS distances, by the constants by which
    interventions are judged. 0: none is."""
    if not violates_rss(truth, FASTEST_MPS):
        return FASTEST_MPS
    low, high = 0.0, FASTEST_MPS
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        low, high = (low, middle) if violates_rss(truth, middle) else (middle, high)
    return low

"""What only driving shows: the braking that a bar of pressure gives."""

from collections.abc import Iterable

import pytest

from services.can.ratios import BrakeEffect
from services.can.witness import Motion, Shape

SHAPE = Shape(brake_bar_per_mps2=10.0, brake_bar_full_pedal=90.0)
ASKED_BAR, DT_S = 28.0, 0.05
SLIDE = (
    *((9.0, -3.0 - 4.0 * step) for step in range(6)),  # the wheels lock: their speed falls off
    *((0.0, -8.0 + step) for step in range(9)),
    *((0.0, 0.0) for _ in range(40)),  # the car slides on
    *((7.0, 4.0 + 4.0 * step) for step in range(6)),  # the wheels turn again
    *((7.0, 20.0 - 2.0 * step) for step in range(10)),
)
"""Speed by the wheels, and what it makes of the acceleration, m/s and m/s2."""


def effect(moved: Iterable[tuple[float, float]]) -> float | None:
    brakes = BrakeEffect()
    values = {"brake_pedal": ASKED_BAR / 90.0, "brake_pressure_bar": ASKED_BAR}
    for speed, acceleration in moved:
        brakes.step(values, Motion(speed, 0.0, acceleration), SHAPE, DT_S)
    return brakes.shares().get("brake_effect")


@pytest.mark.parametrize("share", [0.3, 0.6, 1.0])
def test_weak_brakes_are_measured_by_what_they_do(share: float) -> None:
    assert effect([(15.0, -2.8 * share)] * 100) == pytest.approx(share)


@pytest.mark.parametrize("share", [0.4, 1.0])
def test_wheels_that_stand_and_turn_again_prove_nothing(share: float) -> None:
    steady = [(15.0, -2.8 * share)] * 100
    assert effect([*steady, *SLIDE, *steady]) == pytest.approx(share, rel=0.1)
    assert effect([*steady, *SLIDE]) == pytest.approx(share, rel=0.1)

"""What only driving shows: the braking that a bar of pressure gives."""

from collections.abc import Iterable

import pytest

from services.can.health.expected_values import SLOPE_SAMPLES, Motion, Shape, slope
from services.can.health.ratios import BrakeEffect

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


def pressing_harder(share: float, lag: float, hard_bar: float) -> float | None:
    """The car brakes gently, then hard; `lag`: seconds over which its deceleration is told. Slip grows with the braking."""
    brakes, dt_s = BrakeEffect(), DT_S
    speed, speeds = 25.0, list[tuple[float, float]]()
    for step in range(200):
        pressure = 17.0 if step % 50 < 30 else hard_bar
        given = pressure / 10.0 * share
        speed -= given * dt_s if speed > 6.0 else 0.0
        change = slope(speeds)
        told = speed * (1.0 - min(0.12, 0.0006 * pressure))
        brakes.step(
            {"brake_pedal": pressure / 90.0, "brake_pressure_bar": pressure}, Motion(told, 0.0, change), SHAPE, dt_s
        )
        speeds = [*speeds, (step * dt_s, told)][-round(lag / dt_s) :]
        if speed <= 6.0:
            break
    return brakes.shares().get("brake_effect")


@pytest.mark.parametrize("hard_bar", [30.0, 43.0, 70.0])
@pytest.mark.parametrize("share", [0.5, 1.0])
def test_a_foot_that_presses_harder_is_no_weak_brake(share: float, hard_bar: float) -> None:
    assert pressing_harder(share, SLOPE_SAMPLES * DT_S, hard_bar) == pytest.approx(share, abs=0.1)


def test_braking_held_back_by_anti_lock_proves_nothing() -> None:
    brakes, hard = BrakeEffect(), {"brake_pedal": 0.8, "brake_pressure_bar": 72.0}
    moved = Motion(20.0, 0.0, -3.0)
    for step in range(200):
        brakes.step({**hard, "abs_active": float(step % 10 < 7)}, moved, SHAPE, DT_S)
    assert "brake_effect" not in brakes.shares()

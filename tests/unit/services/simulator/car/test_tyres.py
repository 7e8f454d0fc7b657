"""Soft tyres: less grip in the wet, faster wheels, warmer, and a pull to their side."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from services.simulator.car import tyres
from services.simulator.car.braking import Ability
from services.simulator.car.condition import Condition
from services.simulator.car.state import CarModel, CarState, Controls, parked
from tests.unit.services.simulator._braking import stopping_m

LACKS = st.floats(0.0, 0.8)
SOFT = Condition().leaking(3, 0.05, 0.8)


def soft(lacking: float) -> Ability:
    return Ability(lacking=(lacking, lacking, lacking, lacking))


def test_the_speed_of_aquaplaning_goes_with_the_root_of_the_pressure() -> None:
    assert tyres.aquaplaning_mps(2.0, 0.75) == pytest.approx(0.5 * tyres.aquaplaning_mps(2.0))
    assert tyres.aquaplaning_mps(2.4) * 3.6 == pytest.approx(77.0, abs=2.0)


@settings(max_examples=60, deadline=None)
@given(LACKS, LACKS, st.floats(0.0, 2.0), st.floats(0.0, 45.0))
def test_less_air_never_grips_better(one: float, other: float, film: float, speed: float) -> None:
    less, more = sorted((one, other))
    grips = [tyres.grip_share((each, 0.0, each, 0.0), film, speed) for each in (less, more)]
    assert 0.0 < grips[1] <= grips[0] <= 1.0
    assert tyres.grip_share((0.0, 0.0, 0.0, 0.0), film, speed) == 1.0


@settings(max_examples=30, deadline=None)
@given(LACKS, LACKS, st.floats(0.0, 1.5))
def test_the_softer_the_tyres_the_longer_the_way_to_stop(one: float, other: float, film: float) -> None:
    less, more = sorted((one, other))
    assert stopping_m(soft(less), film_mm=film) <= stopping_m(soft(more), film_mm=film) + 1e-6


def test_soft_tyres_cost_more_way_in_rain_than_on_a_dry_road() -> None:
    dry, wet = (stopping_m(soft(0.5), film_mm=film) / stopping_m(Ability(), film_mm=film) for film in (0.0, 0.6))
    assert dry < 1.05
    assert wet > 1.15


def drive(condition: Condition, seconds: float) -> CarState:
    model = CarModel(parked(15.0))
    for _ in range(round(seconds / 0.05)):
        state = model.step(0.05, Controls(speed_mps=25.0), condition)
    return state


def test_a_slow_leak_loses_what_it_should_beside_what_warmth_gives() -> None:
    leaking, sound = drive(SOFT, 240.0), drive(Condition(), 240.0)
    lost = sound.tyre_pressure_bar[3] - leaking.tyre_pressure_bar[3]
    assert lost == pytest.approx(0.2, abs=0.01)
    assert sound.tyre_pressure_bar[3] > 2.6
    assert leaking.tyre_temperature_c[3] > sound.tyre_temperature_c[3]
    assert leaking.tyre_pressure_bar[0] == sound.tyre_pressure_bar[0]


def test_a_soft_tyre_turns_faster_than_the_others() -> None:
    state = drive(Condition().leaking(3, 6.0, 1.3), 60.0)
    fl, fr, rl, rr = state.wheel_speeds_mps
    assert fl == fr == rl
    assert rr / fl == pytest.approx(1.0 / (1.0 - 0.02 * (1.0 - state.tyre_pressure_bar[3] / 2.6)), rel=1e-3)


def test_a_car_pulls_to_the_side_of_its_soft_tyre() -> None:
    assert tyres.pull_rad((0.0, 0.0, 0.5, 0.0)) > 0.0 > tyres.pull_rad((0.0, 0.5, 0.0, 0.0))


def test_a_mended_tyre_is_filled() -> None:
    model = CarModel()
    model.step(60.0, Controls(speed_mps=0.0), SOFT)
    assert model.step(0.05, Controls(speed_mps=0.0)).tyre_lost_bar == (0.0, 0.0, 0.0, 0.0)

"""Brakes that are broken brake less, and the more the worse they are."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from services.simulator.car import braking
from services.simulator.car.braking import Ability
from services.simulator.car.condition import SOUND
from services.simulator.car.faults import FAULTS, Active
from services.simulator.car.state import CarModel, CarState, Controls
from tests.unit.services.simulator._braking import stopping_m

MU_DRY_G = 0.85 * 9.81
FILMS = st.floats(0.0, 1.5)
SPEEDS = st.floats(8.0, 38.0)


def ability(preset: str, severity: float, state: CarState = CarState(), for_s: float = 60.0) -> Ability:
    return braking.ability(FAULTS[preset].breaks(SOUND, Active(severity, for_s)), state)


def test_a_sound_car_stops_by_the_grip_of_the_road() -> None:
    assert stopping_m(Ability()) == pytest.approx(25.0**2 / 2 / MU_DRY_G, rel=0.02)


def test_without_the_booster_the_foot_gives_what_the_regulation_asks_for() -> None:
    lost = braking.decelerate(MU_DRY_G, ability("booster_lost", 1.0), 0.85, 0.0, 25.0, False)
    assert 2.44 <= lost.mps2 < 3.5


def test_one_circuit_brakes_with_half_the_wheels() -> None:
    assert stopping_m(ability("circuit_lost", 1.0)) == pytest.approx(2 * stopping_m(Ability()), rel=0.02)


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(["booster_lost", "circuit_lost", "lining_worn", "brakes_hot"]), FILMS, SPEEDS, st.data())
def test_the_graver_the_fault_the_longer_the_way(preset: str, film: float, speed: float, data: st.DataObject) -> None:
    mild, grave = sorted((data.draw(st.floats(0.01, 1.0)), data.draw(st.floats(0.01, 1.0))))
    asked = data.draw(st.floats(1.0, 12.0))
    way = [
        stopping_m(_hot(preset, severity), from_mps=speed, film_mm=film, asked_mps2=asked)
        for severity in (0.0, mild, grave)
    ]
    assert way[0] <= way[1] + 1e-6
    assert way[1] <= way[2] + 1e-6


def _hot(preset: str, severity: float) -> Ability:
    """The ability after a step with the fault: drag has to heat the discs first."""
    condition = FAULTS[preset].breaks(SOUND, Active(severity, 60.0)) if severity else SOUND
    return braking.ability(condition, CarModel().step(0.01, Controls(speed_mps=20.0), condition))


@settings(max_examples=60, deadline=None)
@given(FILMS, SPEEDS)
def test_locked_wheels_slide_further_and_more_so_in_the_wet(film: float, speed: float) -> None:
    slides, grips = (stopping_m(car, from_mps=speed, film_mm=film) for car in (ability("abs_unit", 1.0), Ability()))
    assert slides > 1.1 * grips
    dry = stopping_m(ability("abs_unit", 1.0), from_mps=speed) / stopping_m(Ability(), from_mps=speed)
    assert slides / grips >= dry - 1e-6


def test_without_anti_lock_gentle_braking_is_as_before() -> None:
    assert stopping_m(ability("abs_unit", 1.0), asked_mps2=3.0) == stopping_m(Ability(), asked_mps2=3.0)


def test_braking_down_a_long_descent_heats_the_discs_until_they_fade() -> None:
    model, before = CarModel(), braking.ability(SOUND, CarState())
    for _ in range(6000):  # five minutes held at 30 m/s against a tenth of gravity
        hot = model.step(0.05, Controls(speed_mps=30.0, acceleration_mps2=-1.0, brake=0.2))
    assert hot.brake_temperature_c[0] > braking.FADE_FROM_C
    assert braking.ability(SOUND, hot).effect < before.effect
    for _ in range(6000):
        cold = model.step(0.05, Controls(speed_mps=30.0))
    assert braking.ability(SOUND, cold).effect == before.effect

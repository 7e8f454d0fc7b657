"""Friction numbers against their published sources."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.weather.advice import speed_for_distance_mps, stopping_distance_m
from services.weather.road.friction import (
    contact,
    floating_speed_mps,
    rain_film_mm,
    snow_low,
    speed_share,
    wet_high,
    wet_low,
)
from services.weather.road.sight import rain_sight_m


def test_a_film_of_a_tenth_of_an_inch_floats_a_tyre_at_about_47_miles_an_hour() -> None:
    # Huebner, Reed and Henry: 26.04 * 0.0945^-0.259 mph at 2.4 mm
    assert floating_speed_mps(2.4) == pytest.approx(26.04 * 0.09449**-0.259 * 0.44704, rel=1e-3)
    assert floating_speed_mps(2.4) / 0.44704 == pytest.approx(48.0, abs=1.0)


def test_rain_of_an_inch_an_hour_at_forty_leaves_two_thousand_feet_of_sight() -> None:
    assert rain_sight_m(25.4, 40 * 0.44704) == pytest.approx(2000 * 0.3048)


def test_a_crossfall_drains_ordinary_rain_but_not_a_cloudburst() -> None:
    assert rain_film_mm(0.0) == 0.0
    assert rain_film_mm(10.0) <= 0.35
    assert 0.4 < rain_film_mm(60.0) < 1.2


def test_deep_water_floats_a_tyre_no_later_than_by_gallaway() -> None:
    # 10 % spin-down, 33 psi, tread of 1.6 mm, texture of 0.8 mm, 20 mm of water
    assert floating_speed_mps(20.0) / 0.44704 == pytest.approx(47.0, abs=0.5)
    assert floating_speed_mps(20.0) < floating_speed_mps(2.4)


def test_most_of_the_fall_comes_below_a_quarter_of_a_millimetre() -> None:
    # Kulakowski and Harwood: films of 0.025 to 0.23 mm
    fall = [wet_low(film, 5.0) for film in (0.0, 0.23, 1.0)]
    assert fall[0] - fall[1] > 2.0 * (fall[1] - fall[2])


def test_speed_takes_of_wet_friction_what_the_international_friction_index_says() -> None:
    assert speed_share(60 / 3.6) == 1.0
    assert speed_share(120 / 3.6) == pytest.approx(2.71828 ** (-0.15 * 60 / (14.2 + 89.7 * 0.5)), rel=1e-4)


def test_cold_packed_snow_grips_better_than_melting_snow() -> None:
    assert snow_low(-15.0) > snow_low(-3.0) > snow_low(0.0) == snow_low(None)


@given(st.floats(0, 4), st.floats(0, 4), st.floats(0, 60), st.floats(0, 1))
def test_a_deeper_film_never_grips_better(film: float, more: float, speed_mps: float, soft: float) -> None:
    assert wet_low(film + more, speed_mps, soft) <= wet_low(film, speed_mps, soft) + 1e-12
    assert wet_high(film + more) <= wet_high(film) + 1e-12
    assert contact(film + more, speed_mps) <= contact(film, speed_mps) + 1e-12
    assert wet_low(film, speed_mps, soft) <= wet_high(film)


@given(st.floats(0.1, 60), st.floats(0.05, 1.0))
def test_the_speed_for_a_distance_inverts_the_stopping_distance(speed_mps: float, mu: float) -> None:
    assert speed_for_distance_mps(stopping_distance_m(speed_mps, mu), mu) == pytest.approx(speed_mps, rel=1e-6)

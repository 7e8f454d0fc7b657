"""Friction numbers against their published sources."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.weather.advice import speed_for_distance_mps, stopping_distance_m
from services.weather.friction import contact, floating_speed_mps, rain_film_mm, wet
from services.weather.interval import Interval
from services.weather.sight import rain_sight_m


def test_a_film_of_a_tenth_of_an_inch_floats_a_tyre_at_about_47_miles_an_hour() -> None:
    # Huebner, Reed and Henry: 26.04 * 0.0945^-0.259 mph at 2.4 mm
    assert floating_speed_mps(2.4) == pytest.approx(26.04 * 0.09449**-0.259 * 0.44704, rel=1e-3)
    assert floating_speed_mps(2.4) / 0.44704 == pytest.approx(48.0, abs=1.0)


def test_rain_of_an_inch_an_hour_at_forty_leaves_two_thousand_feet_of_sight() -> None:
    assert rain_sight_m(25.4, 40 * 0.44704) == pytest.approx(2000 * 0.3048)


def test_a_crossfall_drains_ordinary_rain_but_not_a_cloudburst() -> None:
    assert rain_film_mm(0.0) == 0.0
    assert rain_film_mm(10.0) <= 0.2
    assert 0.4 < rain_film_mm(60.0) < 1.2


@given(st.floats(0, 3), st.floats(0, 3), st.floats(0, 60))
def test_a_deeper_film_never_grips_better(film: float, more: float, speed_mps: float) -> None:
    assert wet(Interval(0.0, film + more), speed_mps).low <= wet(Interval(0.0, film), speed_mps).low + 1e-12
    assert contact(film + more, speed_mps) <= contact(film, speed_mps) + 1e-12


@given(st.floats(0.1, 60), st.floats(0.05, 1.0))
def test_the_speed_for_a_distance_inverts_the_stopping_distance(speed_mps: float, mu: float) -> None:
    assert speed_for_distance_mps(stopping_distance_m(speed_mps, mu), mu) == pytest.approx(speed_mps, rel=1e-6)

"""Sight through rain, snow and spray; the speed that gusts leave."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.weather.road.sight import snow_sight_m, spray_sight_m
from services.weather.road.wind import wind_speed_mps


def test_a_millimetre_of_snow_an_hour_hides_what_is_beyond_eight_hundred_metres() -> None:
    assert snow_sight_m(1.0) == pytest.approx(800.0)
    assert snow_sight_m(4.0) == pytest.approx(200.0)


def test_spray_needs_standing_water_and_speed() -> None:
    assert spray_sight_m(0.05, 30.0) is None
    assert spray_sight_m(0.5, 10.0) is None
    assert (spray_sight_m(0.5, 33.0) or 0.0) < (spray_sight_m(0.5, 22.0) or 0.0)


def test_a_gust_of_a_hurricane_leaves_the_speed_of_a_town_and_a_breeze_all() -> None:
    assert wind_speed_mps(0.7, 60.0) == 13.9
    assert (wind_speed_mps(0.7, 5.0) or 0.0) > 100.0
    assert wind_speed_mps(0.7, None) is None


@given(st.floats(0.05, 1), st.floats(0, 1), st.floats(1, 50), st.floats(0, 20))
def test_less_grip_and_stronger_gusts_never_leave_more_speed(mu: float, less: float, gust: float, more: float) -> None:
    before = wind_speed_mps(mu, gust)
    after = wind_speed_mps(mu * max(0.01, less), gust + more)
    assert before is not None
    assert after is not None
    assert after <= before

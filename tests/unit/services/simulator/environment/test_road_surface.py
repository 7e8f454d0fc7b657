"""Snow, ice, frost and water on the simulated road, and the friction that they leave."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.simulator.environment.road_surface import draw_road
from services.simulator.environment.weather import WeatherCourse
from services.simulator.scenario.plan import WeatherPlan

MINUTES_40 = 2400.0


def course(**key: float) -> WeatherCourse:
    return WeatherCourse((WeatherPlan(at_s=0, **key),))


def test_each_seed_has_a_road_of_its_own() -> None:
    grips = {round(WeatherCourse((WeatherPlan(at_s=0),), seed).at(0).mu_at(20.0), 3) for seed in range(20)}
    assert len(grips) == 20
    assert 0.70 < min(grips) < max(grips) < 0.98


def test_water_takes_more_grip_the_faster_one_drives_and_a_dry_road_none() -> None:
    wet, dry = course(rain_mm_h=30).at(60), course().at(60)
    assert wet.mu_at(5.0) > wet.mu_at(20.0) > wet.mu_at(38.0)
    assert dry.mu_at(5.0) == dry.mu_at(38.0)


@given(speed=st.floats(0.0, 60.0), rain=st.floats(0.0, 60.0))
def test_grip_is_a_share_whichever_way_one_drives(speed: float, rain: float) -> None:
    wet = course(rain_mm_h=rain).at(60)
    assert 0.0 < wet.mu_at(speed) < 1.2
    assert wet.mu_at(-speed) == wet.mu_at(speed), "a car that has stopped may go backwards by a rounding error"


def test_rain_on_a_frozen_road_becomes_ice() -> None:
    freezing = course(rain_mm_h=2, air_c=-2.0, road_c=-3.0)
    assert freezing.at(MINUTES_40).cover.ice_mm > 0.05
    assert freezing.at(MINUTES_40).mu < 0.2


def test_salt_keeps_water_from_freezing_a_few_degrees_below() -> None:
    salted = next(seed for seed in range(50) if draw_road(seed).salted)
    key = WeatherPlan(at_s=0, rain_mm_h=2, air_c=-2.0, road_c=-3.0)
    assert WeatherCourse((key,), salted).at(MINUTES_40).cover.ice_mm == 0.0


def test_vapour_settles_as_frost_below_the_dew_point_and_not_above() -> None:
    frosty = course(air_c=-1.0, road_c=-4.0, dew_point_c=-1.0)
    bare = course(air_c=-1.0, road_c=-4.0, dew_point_c=-9.0)
    assert bare.at(MINUTES_40).mu == pytest.approx(0.85)
    assert frosty.at(MINUTES_40).mu < 0.6


def test_snow_gathers_on_a_cold_road_and_melts_to_slush_and_water_on_a_warm_one() -> None:
    snowing = course(snow_mm_h=2.0, air_c=-3.0, road_c=-3.0)
    melting = course(air_c=4.0, road_c=3.0, lying_snow_mm=0.3)
    assert 0.15 < snowing.at(MINUTES_40).mu < 0.35
    assert melting.at(100).film_mm > 0.1
    assert melting.at(MINUTES_40).cover.snow_mm == 0.0

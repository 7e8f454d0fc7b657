"""The weather's course, water on the road, friction."""

import pytest

from services.simulator.environment.road_surface import Road
from services.simulator.environment.weather import WeatherCourse, atmosphere, friction
from services.simulator.scenario.plan import DaylightPlan, WeatherPlan


def test_friction_falls_with_the_film_and_is_dry_without_one() -> None:
    values = [friction(film / 100) for film in range(0, 150, 5)]
    assert values[0] == Road().dry
    assert values == sorted(values, reverse=True)
    assert 0.35 < values[-1] < 0.5


def test_rain_that_begins_wets_the_road_with_a_delay_and_dries_slowly() -> None:
    keys = (
        WeatherPlan(at_s=0),
        WeatherPlan(at_s=10, rain_mm_h=10),
        WeatherPlan(at_s=60, rain_mm_h=10),
        WeatherPlan(at_s=61),
    )
    course = WeatherCourse(keys)
    assert not course.at(0).wet
    assert course.at(50).wet
    assert course.at(120).wet
    assert course.at(50).mu < course.at(12).mu < course.at(0).mu
    assert not course.at(1500).wet


def test_between_two_times_the_weather_changes_evenly_and_then_stays() -> None:
    course = WeatherCourse((WeatherPlan(at_s=0, visibility_m=1000), WeatherPlan(at_s=100, visibility_m=3000)))
    assert [course.at(at).visibility_m for at in (0, 50, 100, 500)] == pytest.approx([1000, 2000, 3000, 3000])


def test_below_the_horizon_it_is_night() -> None:
    course = WeatherCourse((WeatherPlan(at_s=0, rain_mm_h=8),))
    assert atmosphere(course.at(0), DaylightPlan(sun_elevation_deg=-8)).night
    day = atmosphere(course.at(0), DaylightPlan(sun_elevation_deg=30))
    assert not day.night
    assert day.rain_mm_h == 8
    assert day.wetness > 0.5

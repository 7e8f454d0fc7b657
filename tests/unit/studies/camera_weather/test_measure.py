"""The measures: what is told is compared with the truth, the dangerous mistakes by themselves."""

import math

import pytest

from proto.weather import CameraWeather, Within
from studies.camera_weather.measure import GROUPS, Case, area, calibration_error, figures

DAY = {"night": 0.0, "rain_mm_h": 0.0, "visibility_m": 5000.0, "wetness": 0.0, "sun_deg": 40.0}


def case(told: CameraWeather, **note: float) -> Case:
    return Case(told, 1, DAY | note)


def told(wet: float, low: float = 100.0, high: float = 400.0) -> CameraWeather:
    within = Within(low=low, high=high, confidence=0.9)
    return CameraWeather(camera="front", visibility_m=within, rain=0.02, wet_road=wet, night=False)


def test_a_wet_road_told_dry_counts_and_an_unsure_one_does_not() -> None:
    wet = [case(told(0.03), wetness=0.8), case(told(0.3), wetness=0.8), case(told(0.9), wetness=0.8)]
    assert figures(wet).wet_called_dry == pytest.approx(1 / 3)
    assert figures(wet).wet_right == pytest.approx(1 / 3)


def test_an_interval_holds_lies_too_far_or_too_near() -> None:
    three = [case(told(0.5), visibility_m=sight) for sight in (200.0, 60.0, 900.0)]
    of = figures(three)
    assert of.held == pytest.approx(1 / 3)
    assert of.too_good == pytest.approx(1 / 3)
    assert of.wide == pytest.approx(4.0)


def test_what_is_not_told_is_counted_and_judged_by_nothing_else() -> None:
    of = figures([case(CameraWeather(camera="front"))])
    assert of.unknown == 1.0
    assert math.isnan(of.held)
    assert math.isnan(of.wet_right)


def test_the_area_is_one_for_a_perfect_order_and_a_half_for_none() -> None:
    apart = [case(told(0.9), wetness=1.0), case(told(0.2))]
    assert area(apart, "wet") == 1.0
    assert area([case(told(0.4), wetness=1.0), case(told(0.4))], "wet") == 0.5
    assert calibration_error(apart, "wet") == pytest.approx(0.15)


def test_every_weather_has_a_row() -> None:
    groups = {
        case(told(0.5), **note).group for note in ({}, {"night": 1.0}, {"visibility_m": 90.0}, {"rain_mm_h": 9.0})
    }
    assert groups == {"dry", "night", "fog below 150 m", "rain from 4 mm/h"}
    assert groups <= {name for name, _ in GROUPS}

"""Weather and light as numbers."""

import math

import pytest

from services.simulator.render.drawing.light import extinction_per_m, light_of
from services.simulator.scene.scene import Atmosphere


def test_contrast_falls_to_two_percent_at_the_visibility_distance() -> None:
    beta = extinction_per_m(Atmosphere(fog_visibility_m=120.0))
    assert math.exp(-beta * 120.0) == pytest.approx(0.02, rel=1e-3)


def test_rain_dims_the_view_more_the_harder_it_falls() -> None:
    light, heavy = (extinction_per_m(Atmosphere(rain_mm_h=rate)) for rate in (2.0, 20.0))
    assert extinction_per_m(Atmosphere()) < light < heavy


def test_clouds_take_the_sun_and_its_shadows() -> None:
    clear, grey = light_of(Atmosphere(cloud=0.0)), light_of(Atmosphere(cloud=1.0))
    assert grey.sun[0] < 0.1 * clear.sun[0]
    assert grey.shadow < 0.1 * clear.shadow


def test_rain_wets_the_road_whatever_wetness_says() -> None:
    assert light_of(Atmosphere(rain_mm_h=10.0, wetness=0.0)).wet == 1.0


def test_a_low_sun_is_redder_than_a_high_one() -> None:
    low, high = light_of(Atmosphere(sun_elevation_deg=4)), light_of(Atmosphere(sun_elevation_deg=60))
    assert low.sun[2] / low.sun[0] < high.sun[2] / high.sun[0]

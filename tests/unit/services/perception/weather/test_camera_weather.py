"""The weather from pictures: rendered weathers are told apart, what cannot be told stays unknown, nothing is told as certain."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.paths import data
from proto.sensors import Calibration
from proto.weather import CameraWeather
from services.perception.range.camera import Camera
from services.perception.weather.camera_weather import NS, OPEN_M, SUREST, WeatherModel, WeatherWindow, weigh
from services.simulator.render import Renderer, RendererUnavailable
from services.simulator.scene.scene import FRONT, Atmosphere
from training.stages.stage import random_stage

MODEL = WeatherModel(data("models/weather.onnx"))
STAGES = range(40, 46)
CAMERA = Camera.of(
    Calibration(
        fx_px=FRONT.focal_px,
        fy_px=FRONT.focal_px,
        cx_px=FRONT.width_px / 2,
        cy_px=FRONT.height_px / 2,
        width_px=FRONT.width_px,
        height_px=FRONT.height_px,
        x_m=FRONT.x_m,
        z_m=FRONT.z_m,
        pitch_rad=FRONT.pitch_rad,
    )
)


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    try:
        made = Renderer(random_stage(STAGES[0], "test")[0])
    except RendererUnavailable as error:
        pytest.skip(str(error))
    yield made
    made.close()


def told_of(renderer: Renderer, atmosphere: Atmosphere) -> CameraWeather:
    """What six places in one weather tell together."""
    window = WeatherWindow(MODEL.card, "front")
    for second, seed in enumerate(STAGES):
        scene = replace(random_stage(seed, "test")[1], atmosphere=atmosphere)
        told = window.add(second * NS, MODEL.judge(renderer.render(scene, FRONT), CAMERA))
    return told


def test_a_clear_dry_day_is_far_sight_without_rain(renderer: Renderer) -> None:
    told = told_of(renderer, Atmosphere(cloud=0.2))
    assert told.night is False
    assert told.visibility_m is not None
    assert told.visibility_m.high == OPEN_M
    assert told.rain is not None
    assert told.rain < 0.2
    assert told.wet_road is not None
    assert told.wet_road < 0.5
    assert told.rain_mm_h is None
    assert told.snow_cover is None


def test_fog_is_short_sight(renderer: Renderer) -> None:
    told = told_of(renderer, Atmosphere(fog_visibility_m=90.0, cloud=0.8))
    assert told.visibility_m is not None
    assert told.visibility_m.low <= 90.0 <= told.visibility_m.high < 600.0


def test_heavy_rain_is_rain_on_a_wet_road_with_an_intensity(renderer: Renderer) -> None:
    told = told_of(renderer, Atmosphere(rain_mm_h=15.0, wetness=0.95, fog_visibility_m=2500.0, cloud=1.0))
    assert told.rain is not None
    assert told.rain > 0.8
    assert told.wet_road is not None
    assert told.wet_road > 0.8
    assert told.rain_mm_h is not None
    assert told.rain_mm_h.low <= 15.0 <= told.rain_mm_h.high


def test_by_night_sight_is_unknown(renderer: Renderer) -> None:
    told = told_of(renderer, Atmosphere(night=True))
    assert told.night is True
    assert told.visibility_m is None


@pytest.mark.parametrize("value", [0, 255])
def test_a_blind_camera_tells_nothing(value: int) -> None:
    picture = np.full((360, 640, 3), value, np.uint8)
    told = WeatherWindow(MODEL.card, "front").add(0, MODEL.judge(picture, CAMERA))
    assert told == CameraWeather(camera="front", reasons=("the pictures are unlike those learned from",))


judgements = st.fixed_dictionaries(
    {name: st.floats(-60.0, 60.0) if name in MODEL.card.odds else st.floats(-3.0, 9.0) for name in MODEL.card.outputs}
)


@given(st.lists(judgements, min_size=1, max_size=8))
def test_nothing_is_told_as_certain_and_intervals_are_in_order(judged: list[dict[str, float]]) -> None:
    told = weigh(MODEL.card, "front", judged)
    for chance in (told.rain, told.wet_road):
        assert chance is not None
        assert 1.0 - SUREST <= chance <= SUREST
    for within in (told.visibility_m, told.rain_mm_h):
        if within is not None:
            assert 0.0 < within.low <= within.high
            assert math.isfinite(within.high)
            assert 0.0 < within.confidence < 1.0


@given(st.lists(judgements, min_size=1, max_size=8), st.sampled_from([("wet", "wet_road"), ("rain", "rain")]))
def test_more_signs_of_water_never_make_it_less_likely(judged: list[dict[str, float]], asked: tuple[str, str]) -> None:
    name, field = asked
    surer = [each | {name: each[name] + 1.0} for each in judged]
    assert getattr(weigh(MODEL.card, "front", surer), field) >= getattr(weigh(MODEL.card, "front", judged), field)


def test_old_pictures_are_forgotten_and_a_clock_set_back_starts_anew() -> None:
    dry = dict.fromkeys(MODEL.card.outputs, 0.0)
    window = WeatherWindow(MODEL.card, "front")
    assert window.add(0, dry).reasons[0] == "1 pictures"
    assert window.add(9 * NS, dry).reasons[0] == "2 pictures"
    assert window.add(12 * NS, dry).reasons[0] == "2 pictures"
    assert window.add(3 * NS, dry).reasons[0] == "1 pictures"


def test_pictures_mostly_unlike_those_learned_from_tell_nothing_until_they_are_few() -> None:
    dry = dict.fromkeys(MODEL.card.outputs, 0.0)
    window = WeatherWindow(MODEL.card, "front")
    assert window.add(0, None).wet_road is None
    assert window.add(1 * NS, dry).wet_road is not None
    assert window.add(2 * NS, None).wet_road is None

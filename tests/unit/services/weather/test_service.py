"""The Weather service on a real in-process bus."""

from typing import Any

import pytest

from drivemcp.errors import ConfigError
from drivemcp.testing import TestBus, bus
from proto import topics
from proto.sensors import WeatherSensing
from proto.vehicle import Degradation, Ego, Indicator
from proto.weather import CameraWeather, Conditions, Within
from services.weather.service import SERVICE, WeatherConfig
from services.weather.sources.internet import InternetConfig

FAST = WeatherConfig(conditions_hz=20.0, ego_max_age_s=600.0)
DRY = WeatherSensing(
    rain_mm_h=0.0,
    snow_mm_h=0.0,
    visibility_m=9000.0,
    air_temperature_c=18.0,
    road_temperature_c=22.0,
    water_film_mm=0.0,
)
WET = WeatherSensing(
    rain_mm_h=25.0, visibility_m=900.0, air_temperature_c=9.0, road_temperature_c=9.5, water_film_mm=0.5
)


def result(b: TestBus, **arguments: Any) -> dict[str, Any]:
    outcome = b.call("assess_weather", arguments)
    assert outcome.ok, outcome
    assert outcome.result is not None
    return outcome.result


def test_sensing_becomes_conditions() -> None:
    with bus() as b:
        b.start(SERVICE, FAST)
        node = b.node("simulator")
        dry = b.wait_for(
            topics.CONDITIONS, lambda c: c.wet is False, after=lambda: node.publish(topics.WEATHER_SENSING, DRY)
        )
        wet = b.wait_for(
            topics.CONDITIONS, lambda c: c.wet is True, after=lambda: node.publish(topics.WEATHER_SENSING, WET)
        )
    assert dry.speed_factor == 1.0
    assert wet.speed_factor < 0.85
    assert wet.mu_low < dry.mu_low


def test_wipers_anti_lock_and_tyres_over_can_count() -> None:
    with bus() as b:
        b.start(SERVICE, FAST)
        car = b.node("can")

        def drive() -> None:
            car.publish(topics.EGO, Ego(speed_mps=12.0, acceleration_mps2=-2.5, abs_active=True, wiper_stage=2))
            car.publish(
                topics.DEGRADATION,
                Degradation(
                    h=0.3, indicators=(Indicator(name="tyre_pressure_low", value=0.8, weight=0.6, source="can"),)
                ),
            )

        answer = b.wait_for(topics.CONDITIONS, lambda c: "measured by car" in c.reason, after=drive)
    assert answer.mu_low <= 0.9 * 2.5 / 9.81 + 1e-3
    assert answer.precipitation == "rain"


def test_a_flat_tyre_lowers_grip_in_rain_though_another_tyre_s_sensor_is_silent() -> None:
    flat = Indicator(name="tyre_pressure_low_fr", value=1.0, weight=0.6, source="can")
    with bus() as b:
        b.start(SERVICE, FAST)
        car = b.node("can")

        def drive(health: Degradation) -> None:
            car.publish(topics.WEATHER_SENSING, WET)
            car.publish(topics.EGO, Ego(speed_mps=25.0))
            car.publish(topics.DEGRADATION, health)

        def told_at_this_speed(conditions: Conditions) -> bool:
            return conditions.wet is True and conditions.reference_speed_mps == 25.0

        sound = b.wait_for(topics.CONDITIONS, told_at_this_speed, after=lambda: drive(Degradation(h=0.0)))
        half_known = Degradation(h=0.4, indicators=(flat,), unknown=("tyre_pressure_low_fl",))
        b.wait_for(
            topics.CONDITIONS,
            lambda c: told_at_this_speed(c) and c.mu_low < sound.mu_low - 0.03,
            after=lambda: drive(half_known),
        )


def test_without_any_input_conditions_are_published_and_careful() -> None:
    with bus() as b:
        b.start(SERVICE, FAST)
        answer = b.wait_for(topics.CONDITIONS)
    assert answer.risk_level == "unknown"
    assert answer.mu_low <= 0.3


def test_old_sensing_is_no_sensing() -> None:
    with bus() as b:
        b.start(SERVICE, FAST)
        node = b.node("simulator")
        old_ns = node.clock.now_ns() - 60_000_000_000

        def drive() -> None:
            node.publish(topics.WEATHER_SENSING, DRY, stamp_ns=old_ns)
            node.publish(topics.EGO, Ego(speed_mps=25.0))  # whose speed is known has been sent the sensing before it

        b.wait_for(topics.CONDITIONS, lambda c: c.reference_speed_mps == 25.0, after=drive)
        assert result(b)["precipitation"] == "unknown"


def test_the_tool_answers_what_if_without_changing_what_is_published() -> None:
    with bus() as b:
        b.start(SERVICE, FAST)
        node = b.node("simulator")
        b.wait_for(topics.CONDITIONS, lambda c: c.wet is False, after=lambda: node.publish(topics.WEATHER_SENSING, DRY))
        asked = result(b, rain_mm_h=40.0, water_film_mm=0.8, limit_mps=13.9)
        now = b.wait_for(topics.CONDITIONS, lambda c: c.wet is False)
        assert b.call("assess_weather", {"rain_mm_h": "much"}).status == "tool_error"
    assert asked["precipitation"] == "rain"
    assert asked["speed_factor"] < 0.85
    assert now.speed_factor == 1.0


def test_a_camera_s_wet_road_and_fog_lower_what_is_advised() -> None:
    with bus() as b:
        b.start(SERVICE, FAST)
        node = b.node("simulator")
        dry = b.wait_for(
            topics.CONDITIONS, lambda c: c.wet is False, after=lambda: node.publish(topics.WEATHER_SENSING, DRY)
        )
        eye = b.node("perception")
        foggy = CameraWeather(
            camera="front", visibility_m=Within(low=80.0, high=150.0, confidence=0.9), rain=0.9, wet_road=0.95
        )
        warned = b.wait_for(
            topics.CONDITIONS,
            lambda c: c.visibility_m is not None and c.visibility_m < 200.0,
            after=lambda: eye.publish(topics.CAMERA_WEATHER, foggy),
        )
    assert warned.mu_low < dry.mu_low
    assert warned.speed_factor < dry.speed_factor


def test_weather_from_the_internet_is_refused_in_lockstep() -> None:
    config = WeatherConfig(lockstep=True, internet=InternetConfig(providers=("open_meteo",)))
    with bus() as b, pytest.raises(ConfigError, match=r"internet\.providers"):
        b.start(SERVICE, config)

"""Weathers to be measured in: drawn by a seed, and those of the shipped scenarios."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from services.simulator.scenario.load import load_scenario
from services.simulator.scenario.plan import WeatherPlan

Chance = np.random.Generator
Keys = tuple[WeatherPlan, ...]
RAIN_ENDS_S = 600.0


def _dry(chance: Chance) -> Keys:
    return (WeatherPlan(at_s=0, air_c=_draw(chance, 6, 30)),)


def _rainy(low: float, high: float) -> Callable[[Chance], Keys]:
    def keys(chance: Chance) -> Keys:
        rates = chance.uniform(low, high, 3)
        sights = 14_000.0 / (1.0 + rates**0.9)
        air_c = _draw(chance, 5, 20)
        return tuple(
            WeatherPlan(at_s=600 * n, rain_mm_h=float(rate), visibility_m=float(sight), air_c=air_c)
            for n, (rate, sight) in enumerate(zip(rates, sights, strict=True))
        )

    return keys


def _after_rain(chance: Chance) -> Keys:
    rain, air_c = _draw(chance, 2, 25), _draw(chance, 5, 22)
    return (
        WeatherPlan(at_s=0, rain_mm_h=rain, air_c=air_c, visibility_m=3000),
        WeatherPlan(at_s=RAIN_ENDS_S - 60, rain_mm_h=rain, air_c=air_c, visibility_m=3000),
        WeatherPlan(at_s=RAIN_ENDS_S, air_c=air_c),
    )


def _fog(chance: Chance) -> Keys:
    air_c = _draw(chance, 3, 11)
    road_c = air_c + _draw(chance, -1, 2)
    return (
        WeatherPlan(
            at_s=0, visibility_m=_draw(chance, 40, 280), air_c=air_c, road_c=road_c, dew_point_c=air_c, wind_mps=0.5
        ),
    )


def _frost_night(chance: Chance) -> Keys:
    air_c = _draw(chance, -4, 2)
    road_c = min(air_c - _draw(chance, 0.5, 3), -0.5)
    return (_cold(chance, air_c, road_c, road_c + _draw(chance, 0.0, 2.0), frost_mm=_draw(chance, 0.005, 0.08)),)


def _cold_dry(chance: Chance) -> Keys:
    air_c = _draw(chance, -9, 1)
    return (_cold(chance, air_c, air_c + _draw(chance, -1, 2), air_c - _draw(chance, 6, 12)),)


def _black_ice(chance: Chance) -> Keys:
    road_c = _draw(chance, -5, -0.5)
    air_c = road_c + _draw(chance, 0, 3)
    return (_cold(chance, air_c, road_c, road_c + _draw(chance, -1, 1), ice_mm=_draw(chance, 0.02, 0.3)),)


def _freezing_rain(chance: Chance) -> Keys:
    road_c = _draw(chance, -4, -0.5)
    return (_cold(chance, road_c + 1.0, road_c, road_c, rain_mm_h=_draw(chance, 0.4, 3)),)


def _snow(chance: Chance) -> Keys:
    rate, road_c = _draw(chance, 0.3, 3), _draw(chance, -8, -0.3)
    return (
        WeatherPlan(
            at_s=0,
            snow_mm_h=rate,
            visibility_m=1200.0 / rate,
            air_c=road_c - 0.5,
            road_c=road_c,
            dew_point_c=road_c - 1.0,
            lying_snow_mm=_draw(chance, 0.1, 3),
        ),
    )


def _slush(chance: Chance) -> Keys:
    rate, road_c = _draw(chance, 0.3, 3), _draw(chance, 0.1, 1.5)
    return (
        WeatherPlan(
            at_s=0,
            snow_mm_h=rate,
            visibility_m=1200.0 / rate,
            air_c=road_c,
            road_c=road_c,
            lying_snow_mm=_draw(chance, 0.2, 2),
        ),
    )


def _storm(chance: Chance) -> Keys:
    wind = _draw(chance, 12, 22)
    return (WeatherPlan(at_s=0, rain_mm_h=_draw(chance, 0, 15), air_c=9, wind_mps=wind, gust_mps=1.6 * wind),)


def _cold(
    chance: Chance,
    air_c: float,
    road_c: float,
    dew_c: float,
    *,
    frost_mm: float = 0.0,
    ice_mm: float = 0.0,
    rain_mm_h: float = 0.0,
) -> WeatherPlan:
    return WeatherPlan(
        at_s=0,
        air_c=air_c,
        road_c=road_c,
        dew_point_c=dew_c,
        lying_frost_mm=frost_mm,
        lying_ice_mm=ice_mm,
        rain_mm_h=rain_mm_h,
        visibility_m=_draw(chance, 2000, 15_000),
    )


def _draw(chance: Chance, low: float, high: float) -> float:
    return float(chance.uniform(low, high))


GENERATED: Mapping[str, Callable[[Chance], Keys]] = {
    "dry": _dry,
    "drizzle": _rainy(0.2, 1.5),
    "rain": _rainy(3, 12),
    "cloudburst": _rainy(25, 70),
    "after rain": _after_rain,
    "fog": _fog,
    "frost night": _frost_night,
    "cold and dry": _cold_dry,
    "black ice": _black_ice,
    "freezing rain": _freezing_rain,
    "snow": _snow,
    "slush": _slush,
    "storm": _storm,
}


def shipped(folder: Path) -> dict[str, Keys]:
    """The weather of each scenario file in a folder, by its name."""
    return {path.stem: load_scenario(path).weather for path in sorted(folder.glob("*.toml"))}

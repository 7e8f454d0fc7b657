"""What a scenario's number varies on its layout: driver's tongue, traffic, weather, daylight, paces and distances."""

from random import Random

import msgspec

from evaluation.scenarios.names import Family
from services.simulator.scenario.plan import CrosserPlan, DaylightPlan, Scenario, TrafficPlan, WeatherPlan

RAIN_MM_H: dict[Family, tuple[float, ...]] = {
    "urb-rain": (3.0, 6.0, 10.0, 15.0, 22.0),
    "cross-border": (0.0, 0.0, 0.0, 2.0, 5.0),
    "dynamic-vsl": (0.0, 0.3, 2.0, 4.0, 8.0),
}
"""Each as often as the others."""
SUN_DEG = {"day": (18.0, 55.0), "dusk": (1.0, 6.0), "night": (-18.0, -8.0)}
LIGHT = ("day", "day", "day", "dusk", "night", "night")
KEYS_S = (0.0, 25.0, 70.0, 150.0)


def vary(layout: Scenario, family: Family, chance: Random) -> Scenario:
    """The scenario on a layout."""
    low, high = SUN_DEG[chance.choice(LIGHT)]
    language = chance.choice(("en", "de"))
    weather = _weather(RAIN_MM_H[family], chance)
    return msgspec.structs.replace(
        layout,
        driver_language=language,
        driver_country="GBR" if language == "en" else "DEU",
        duration_s=600.0,
        weather=weather,
        water=layout.water if any(key.rain_mm_h > 0.0 for key in weather) else (),
        daylight=DaylightPlan(
            sun_elevation_deg=round(chance.uniform(low, high), 1), sun_azimuth_deg=round(chance.uniform(0.0, 359.0))
        ),
        traffic=_traffic(layout.road.lanes, chance),
        crossers=tuple(_crosser(each, chance) for each in layout.crossers),
    )


def _weather(rains_mm_h: tuple[float, ...], chance: Random) -> tuple[WeatherPlan, ...]:
    rain, air_c, wind = chance.choice(rains_mm_h), chance.uniform(4.0, 18.0), chance.uniform(1.0, 8.0)
    return tuple(_key(at_s, rain * chance.uniform(0.6, 1.3), air_c, wind) for at_s in KEYS_S)


def _key(at_s: float, rain_mm_h: float, air_c: float, wind_mps: float) -> WeatherPlan:
    """Rain and what it leaves of the sight: as in the shipped scenarios, 900 m at 19 mm/h, 12 km when dry."""
    visibility_m = max(700.0, 12_000.0 / (1.0 + 0.6 * rain_mm_h))
    return WeatherPlan(
        at_s=at_s,
        rain_mm_h=round(rain_mm_h, 1),
        visibility_m=round(visibility_m),
        air_c=round(air_c, 1),
        cloud=1.0 if rain_mm_h > 0.0 else 0.4,
        wind_mps=round(wind_mps, 1),
    )


def _traffic(lanes: int, chance: Random) -> TrafficPlan:
    low, high = (6, 11) if lanes > 1 else (2, 5)
    return TrafficPlan(
        forward=chance.randint(low, high),
        oncoming=chance.randint(3, 8),
        gap_m=round(chance.uniform(70.0, 110.0)),
        lorries=round(chance.uniform(0.05, 0.3), 2),
    )


def _crosser(plan: CrosserPlan, chance: Random) -> CrosserPlan:
    """Another pace; a person may step out earlier than in the layout, never so late that the ego cannot avoid the person."""
    within = plan.when_ego_within_m
    return msgspec.structs.replace(
        plan,
        walk_mps=round(plan.walk_mps * chance.uniform(0.85, 1.2), 2),
        when_ego_within_m=None if within is None else round(within * chance.uniform(1.0, 1.2), 1),
    )

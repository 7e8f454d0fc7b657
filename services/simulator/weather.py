"""The weather's course, the water on the road, and the friction that comes of it."""

import math
from bisect import bisect_right
from dataclasses import dataclass

import numpy as np

from services.simulator.plan import DaylightPlan, WeatherPlan
from services.simulator.scene import Atmosphere
from services.simulator.spine import Array

WET_FROM_MM = 0.03
"""A film from which the road counts as wet: water stands on it and spray is thrown up."""
MU_DRY = 0.85
_WETTING_S, _DRYING_S = 30.0, 240.0
_HORIZON_S = 3600


@dataclass(frozen=True, slots=True, kw_only=True)
class Weather:
    """The weather at one instant."""

    rain_mm_h: float
    visibility_m: float
    air_c: float
    road_c: float
    cloud: float
    wind_mps: float
    film_mm: float
    mu: float

    @property
    def wet(self) -> bool:
        """Whether a limit that holds when wet holds now."""
        return self.film_mm >= WET_FROM_MM


def friction(film_mm: float) -> float:
    """mu of a worn road under a water film: 0.85 dry, 0.53 wet, 0.42 with a millimetre standing (ours, provisional)."""
    return MU_DRY - 0.30 * (1.0 - math.exp(-film_mm / 0.08)) - 0.13 * min(film_mm, 1.0)


class WeatherCourse:
    """Evenly between the scenario's times; the film follows the rain with a delay."""

    def __init__(self, keys: tuple[WeatherPlan, ...]) -> None:
        self._keys, self._times = keys, [key.at_s for key in keys]
        self._film = _films(np.array([self._value(float(at), "rain_mm_h") for at in range(_HORIZON_S)]))

    def at(self, time_s: float) -> Weather:
        """The weather at a time; after the last key it stays."""
        film = float(np.interp(time_s, np.arange(_HORIZON_S), self._film))
        air = self._value(time_s, "air_c")
        return Weather(
            rain_mm_h=self._value(time_s, "rain_mm_h"),
            visibility_m=self._value(time_s, "visibility_m"),
            air_c=air,
            road_c=air + (0.5 if film > WET_FROM_MM else 3.0),
            cloud=self._value(time_s, "cloud"),
            wind_mps=self._value(time_s, "wind_mps"),
            film_mm=film,
            mu=friction(film),
        )

    def _value(self, time_s: float, field: str) -> float:
        after = bisect_right(self._times, time_s)
        if after == len(self._keys):
            return float(getattr(self._keys[-1], field))
        low, high = self._keys[after - 1], self._keys[after]
        share = (time_s - low.at_s) / (high.at_s - low.at_s)
        return float(getattr(low, field) + share * (getattr(high, field) - getattr(low, field)))


def atmosphere(weather: Weather, daylight: DaylightPlan) -> Atmosphere:
    """What the cameras see of it."""
    return Atmosphere(
        sun_elevation_deg=daylight.sun_elevation_deg,
        sun_azimuth_rad=math.radians(daylight.sun_azimuth_deg),
        night=daylight.sun_elevation_deg < -2.0,
        rain_mm_h=weather.rain_mm_h,
        fog_visibility_m=weather.visibility_m,
        wetness=1.0 - math.exp(-weather.film_mm / 0.1),
        cloud=weather.cloud,
    )


def _films(rain_mm_h: Array) -> Array:
    """Film in mm second by second: it starts where steady rain would have brought it."""
    steady = 0.09 * rain_mm_h**0.65
    films = np.empty_like(steady)
    film = float(steady[0])
    for second, target in enumerate(steady):
        film += (float(target) - film) / (_WETTING_S if target > film else _DRYING_S)
        films[second] = film
    return films

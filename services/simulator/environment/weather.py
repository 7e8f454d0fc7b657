"""The weather's course along the scenario's times."""

import math
from bisect import bisect_right
from dataclasses import dataclass

from services.simulator.environment import road_surface
from services.simulator.environment.road_surface import Cover, Road, Sky, draw_road
from services.simulator.scenario.plan import DaylightPlan, WeatherPlan
from services.simulator.scene.scene import Atmosphere

WET_FROM_MM = 0.03
"""A film from which the road counts as wet: water stands on it and spray is thrown up."""
ROAD_OVER_AIR_K, WET_ROAD_OVER_AIR_K = 3.0, 0.5
DEW_UNDER_AIR_K = 3.0
GUSTS = 1.5
_HORIZON_S = 3600


@dataclass(frozen=True, slots=True, kw_only=True)
class Weather:
    """The weather at one instant, and the road under it."""

    rain_mm_h: float
    visibility_m: float
    air_c: float
    road_c: float
    cloud: float
    wind_mps: float
    snow_mm_h: float = 0.0
    gust_mps: float = 0.0
    dew_point_c: float = 0.0
    cover: Cover = Cover()
    road: Road = Road()

    @property
    def film_mm(self) -> float:
        """Water on the road that flows."""
        return self.cover.film_mm

    @property
    def mu(self) -> float:
        """Friction at walking pace."""
        return self.mu_at(0.0)

    def mu_at(self, speed_mps: float) -> float:
        """Friction under sound tyres at a speed."""
        return road_surface.friction(self.cover, self.road, self.road_c, speed_mps)

    @property
    def wet(self) -> bool:
        """Whether a limit that holds when wet holds now."""
        return self.film_mm >= WET_FROM_MM


def friction(film_mm: float) -> float:
    """mu of the average road under a water film, at walking pace: 0.85 dry, 0.48 with half a millimetre standing."""
    return road_surface.friction(Cover(film_mm=film_mm), Road(), 12.0, 0.0)


class WeatherCourse:
    """Evenly between the scenario's times; what lies on the road follows with a delay. Without a seed, the road is the
    average one.
    """

    def __init__(self, keys: tuple[WeatherPlan, ...], seed: int | None = None) -> None:
        self._keys, self._times = keys, [key.at_s for key in keys]
        self.road = Road() if seed is None else draw_road(seed)
        self._covers: list[Cover] = []
        """Second by second, as far as they were asked for."""

    def at(self, time_s: float) -> Weather:
        """The weather at a time; after the last key it stays."""
        cover = self._cover(min(_HORIZON_S - 1, max(0, round(time_s))))
        sky, wind_mps = self._sky(time_s, cover.film_mm), self._value(time_s, "wind_mps")
        gust_mps = self._given(time_s, "gust_mps")
        return Weather(
            rain_mm_h=sky.rain_mm_h,
            snow_mm_h=sky.snow_mm_h,
            visibility_m=sky.visibility_m,
            air_c=self._value(time_s, "air_c"),
            road_c=sky.road_c,
            dew_point_c=sky.dew_point_c,
            cloud=self._value(time_s, "cloud"),
            wind_mps=wind_mps,
            gust_mps=GUSTS * wind_mps if gust_mps is None else gust_mps,
            cover=cover,
            road=self.road,
        )

    def _cover(self, second: int) -> Cover:
        while len(self._covers) <= second:
            before = self._covers[-1] if self._covers else self._first()
            self._covers.append(before.after(self._sky(float(len(self._covers)), before.film_mm), self.road, 1.0))
        return self._covers[second]

    def _first(self) -> Cover:
        """What lies at the start: what the first key says, as wet as its rain has long kept it."""
        first = self._keys[0]
        return Cover(
            film_mm=road_surface.wet_film_mm(self._sky(0.0, 0.0)),
            snow_mm=first.lying_snow_mm,
            ice_mm=first.lying_ice_mm,
            frost_mm=first.lying_frost_mm,
        )

    def _sky(self, time_s: float, film_mm: float) -> Sky:
        return Sky(
            rain_mm_h=self._value(time_s, "rain_mm_h"),
            snow_mm_h=self._value(time_s, "snow_mm_h"),
            visibility_m=self._value(time_s, "visibility_m"),
            road_c=self._road_c(time_s, film_mm),
            dew_point_c=self._dew_c(time_s),
        )

    def _road_c(self, time_s: float, film_mm: float) -> float:
        given = self._given(time_s, "road_c")
        if given is not None:
            return given
        over = WET_ROAD_OVER_AIR_K if film_mm > WET_FROM_MM else ROAD_OVER_AIR_K
        return self._value(time_s, "air_c") + over

    def _dew_c(self, time_s: float) -> float:
        given = self._given(time_s, "dew_point_c")
        return self._value(time_s, "air_c") - DEW_UNDER_AIR_K if given is None else given

    def _value(self, time_s: float, field: str) -> float:
        """Of a field that no key leaves open."""
        return self._given(time_s, field) or 0.0

    def _given(self, time_s: float, field: str) -> float | None:
        """Evenly between two keys; a key that leaves it open leaves it open until the next."""
        after = bisect_right(self._times, time_s)
        if after == len(self._keys):
            value: float | None = getattr(self._keys[-1], field)
            return value
        low, high = self._keys[after - 1], self._keys[after]
        share = (time_s - low.at_s) / (high.at_s - low.at_s)
        start, end = getattr(low, field), getattr(high, field)
        return None if start is None or end is None else float(start + share * (end - start))


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

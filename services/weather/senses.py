"""Observations from what weather sensing, the car and a camera report."""

import math
from collections.abc import Mapping, Sequence

import msgspec

from proto.sensors import WeatherSensing
from proto.vehicle import Degradation, Ego
from proto.weather import CameraWeather, Within
from services.weather.memory import Memory
from services.weather.observations.observation import FIELDS, SURE, Interval, Observation, RoadState
from services.weather.road.sight import FOG_LAMP_SIGHT_M

SUPPOSED = "supposed"
SENSOR_CONFIDENCE, SENSOR_HALVES_S = 0.97, 40.0
CAR_CONFIDENCE, CAR_HALVES_S = 0.85, 20.0
CAMERA_CONFIDENCE, CAMERA_HALVES_S = SURE, 10.0
"""A picture may warn, and never reassure: a dry look or a clear view from it alone raises nothing."""
PROBABLE = 0.7
"""From this probability on, what a camera takes for rain, water or snow counts as a warning."""
CAMERA_RAIN_MM_H = Interval(0.1, 8.0)
"""Rain that a camera sees and cannot measure."""
RELATIVE, WIND_RELATIVE = 0.2, 0.1
"""Error of rain, film and sight sensors that is allowed for."""
ROAD_K, AIR_K, OUTSIDE_K, DEW_K = 1.2, 0.6, 1.5, 0.6
"""The car's thermometer reads warm behind an engine and over a sunny road."""
ABS_SHARE = 0.8
"""An anti-lock system uses 80 to 95 % of the peak (UN R13-H, annex 6, asks for 75 %)."""
TYRE_LOW = "tyre_pressure_low"
"""How the indicators of the tyres' pressures begin."""

# Wiper stage -> rain it speaks for (mm/h). Off: they may be forgotten in drizzle, not in rain.
_WIPER_RAIN: Mapping[int, Interval] = {
    0: Interval(0.0, 0.25),
    1: Interval(0.0, 3.0),
    2: Interval(0.5, 12.0),
    3: Interval(3.0, 100.0),
}


def from_sensing(sensing: WeatherSensing, stamp_ns: int) -> Observation:
    """What rain sensor, thermometers, road sensor and anemometer report."""
    return Observation(
        source="road weather",
        stamp_ns=stamp_ns,
        confidence=SENSOR_CONFIDENCE,
        halves_s=SENSOR_HALVES_S,
        rain_mm_h=_about(sensing.rain_mm_h),
        snow_mm_h=_about(sensing.snow_mm_h),
        film_mm=_about(sensing.water_film_mm),
        visibility_m=_about(sensing.visibility_m),
        air_c=_within(sensing.air_temperature_c, AIR_K),
        road_c=_within(sensing.road_temperature_c, ROAD_K),
        dew_point_c=_within(sensing.dew_point_c, DEW_K),
        wind_mps=_about(sensing.wind_mps, WIND_RELATIVE),
        gust_mps=_about(sensing.gust_mps, WIND_RELATIVE),
    )


def from_camera(seen: CameraWeather, stamp_ns: int) -> Observation:
    """What a picture warns of."""
    rains = seen.rain is not None and seen.rain >= PROBABLE
    return Observation(
        source="camera",
        stamp_ns=stamp_ns,
        confidence=CAMERA_CONFIDENCE,
        halves_s=CAMERA_HALVES_S,
        visibility_m=_interval(seen.visibility_m),
        rain_mm_h=(_interval(seen.rain_mm_h) or CAMERA_RAIN_MM_H) if rains else None,
        road=_looks(seen),
    )


def _looks(seen: CameraWeather) -> RoadState | None:
    if seen.snow_cover is not None and seen.snow_cover >= PROBABLE:
        return "snow"
    return "wet" if seen.wet_road is not None and seen.wet_road >= PROBABLE else None


def _interval(within: Within | None) -> Interval | None:
    return None if within is None else Interval(within.low, within.high)


def from_car(ego: Ego, abs_mu: float | None, stamp_ns: int, braking: Interval | None = None) -> Observation:
    """What wipers, thermometer, fog lamp, anti-lock system and the slip of braked wheels speak for."""
    return Observation(
        source="car",
        stamp_ns=stamp_ns,
        confidence=CAR_CONFIDENCE,
        halves_s=CAR_HALVES_S,
        rain_mm_h=None if ego.wiper_stage is None else _WIPER_RAIN.get(ego.wiper_stage),
        air_c=_within(ego.outside_temperature_c, OUTSIDE_K),
        visibility_m=Interval(FOG_LAMP_SIGHT_M, 1000.0) if ego.fog_lamp_rear else None,
        mu=braking if abs_mu is None else _within_mu(abs_mu),
    )


def tyre_low(health: Degradation, before: float | None) -> float:
    """The softest of the tyres; where one is unknown no less than `before`: one that falls silent mends no other."""
    tyres = [each.value for each in health.indicators if each.name.startswith(TYRE_LOW)]
    unknown = any(name.startswith(TYRE_LOW) for name in health.unknown)
    return max([*tyres, (before or 0.0) if unknown else 0.0])


def suppose(
    observations: Sequence[Observation], asked: WeatherSensing, wiper_stage: int | None, now_ns: int
) -> tuple[Observation, ...]:
    """The observations as they would be if what is asked were so: it takes the place of what any source says of it."""
    given = from_sensing(asked, now_ns)
    if wiper_stage is not None and given.rain_mm_h is None:
        given = msgspec.structs.replace(given, rain_mm_h=_WIPER_RAIN.get(wiper_stage))
    known = _known(given)
    if not known:
        return tuple(observations)
    return (*(_without(each, known) for each in observations), msgspec.structs.replace(given, source=SUPPOSED))


def supposing(memory: Memory, observations: Sequence[Observation]) -> Memory:
    """The memory without what the observations suppose to be otherwise."""
    known = [name for each in observations if each.source == SUPPOSED for name in _known(each)]
    pieces = tuple(_without(piece, known) for piece in memory.pieces)
    return msgspec.structs.replace(memory, pieces=pieces)


def _known(seen: Observation) -> list[str]:
    return [name for name in FIELDS if getattr(seen, name) is not None]


def _without(seen: Observation, names: Sequence[str]) -> Observation:
    return msgspec.structs.replace(seen, **dict.fromkeys(names))


def _about(value: float | None, error: float = RELATIVE) -> Interval | None:
    if value is None or not math.isfinite(value) or value < 0.0:
        return None
    return Interval((1.0 - error) * value, (1.0 + error) * value)


def _within(value: float | None, error: float) -> Interval | None:
    return None if value is None or not math.isfinite(value) else Interval(value - error, value + error)


def _within_mu(abs_mu: float) -> Interval | None:
    return Interval(abs_mu, abs_mu / ABS_SHARE) if math.isfinite(abs_mu) and abs_mu > 0.0 else None

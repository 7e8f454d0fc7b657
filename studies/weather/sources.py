"""What Weather is told of the true weather: by all its sources, by fewer, by broken and by lying ones."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import msgspec
import numpy as np

from proto.sensors import WeatherSensing
from proto.vehicle import Ego
from services.simulator.environment.weather import Weather
from services.simulator.sensors.measurements import sensed, wiper_stage
from services.weather.observations.observation import NS, Observation
from services.weather.senses import from_car, from_sensing

FOG_LAMP_BELOW_M = 50.0
ABS_UNDER_MU, ABS_CHANCE = 0.35, 0.03
"""On slippery ground a driver now and then brakes into the anti-lock system's range."""
MISSING_S, MISSING_SHARE = 20.0, 0.4
NOISE_TIMES = 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Instant:
    """The true weather at one time of one drive."""

    weather: Weather
    speed_mps: float
    mu: float
    time_s: float
    seed: int

    @property
    def now_ns(self) -> int:
        """On a clock that starts an hour earlier."""
        return int((3600.0 + self.time_s) * NS)

    def chance(self, stream: int, every_s: float = 1.0) -> np.random.Generator:
        """A stream of chance that holds for `every_s`."""
        return np.random.default_rng([self.seed, stream, int(self.time_s // every_s)])


Tells = Callable[[Instant], tuple[Observation, ...]]


def _sensing(instant: Instant) -> WeatherSensing:
    return sensed(instant.weather, instant.chance(3))


def _road(sensing: WeatherSensing, instant: Instant) -> Observation:
    return from_sensing(sensing, instant.now_ns)


def _car(instant: Instant) -> Observation:
    weather, chance = instant.weather, instant.chance(4)
    ego = Ego(
        speed_mps=instant.speed_mps,
        wiper_stage=wiper_stage(max(weather.rain_mm_h, weather.snow_mm_h)),
        outside_temperature_c=round(2.0 * (weather.air_c + 0.4 * float(chance.standard_normal()))) / 2.0,
        fog_lamp_rear=weather.visibility_m < FOG_LAMP_BELOW_M,
    )
    slips = instant.mu < ABS_UNDER_MU and chance.random() < ABS_CHANCE
    abs_mu = instant.mu * float(chance.uniform(0.8, 0.95)) if slips else None
    return from_car(ego, abs_mu, instant.now_ns)


def _all(instant: Instant) -> tuple[Observation, ...]:
    return (_road(_sensing(instant), instant), _car(instant))


def _no_film(instant: Instant) -> tuple[Observation, ...]:
    return (_road(msgspec.structs.replace(_sensing(instant), water_film_mm=None), instant), _car(instant))


def _missing(instant: Instant) -> tuple[Observation, ...]:
    """Each field is silent for two in five spells of 20 s."""
    chance, sensing = instant.chance(5, MISSING_S), _sensing(instant)
    names = [name for name in WeatherSensing.__struct_fields__ if name != "source"]
    lost = {name: None for name in names if chance.random() < MISSING_SHARE}
    return (_road(msgspec.structs.replace(sensing, **lost), instant), _car(instant))


def _noisy(instant: Instant) -> tuple[Observation, ...]:
    """Errors three times as large as the intervals allow for."""
    true = sensed(instant.weather, instant.chance(3))
    changes = {}
    for name in WeatherSensing.__struct_fields__:
        value, about = getattr(true, name), _true(instant.weather, name)
        if isinstance(value, float) and about is not None:
            changes[name] = about + NOISE_TIMES * (value - about)
    return (_road(msgspec.structs.replace(true, **changes), instant), _car(instant))


def _true(weather: Weather, name: str) -> float | None:
    short = {"water_film_mm": "film_mm", "air_temperature_c": "air_c", "road_temperature_c": "road_c"}.get(name, name)
    value = getattr(weather, short, None)
    return float(value) if value is not None else None


def _dead_film(instant: Instant) -> tuple[Observation, ...]:
    """The road sensor says dry whatever lies there."""
    return (_road(msgspec.structs.replace(_sensing(instant), water_film_mm=0.0), instant), _car(instant))


def _warm_road(instant: Instant) -> tuple[Observation, ...]:
    """The road thermometer reads six degrees too much."""
    sensing = _sensing(instant)
    warm = (sensing.road_temperature_c or 0.0) + 6.0
    return (_road(msgspec.structs.replace(sensing, road_temperature_c=warm), instant), _car(instant))


SOURCES: Mapping[str, Tells] = {
    "all": _all,
    "no road film": _no_film,
    "car only": lambda instant: (_car(instant),),
    "nothing": lambda instant: (),
    "missing by turns": _missing,
    "three times the noise": _noisy,
    "film sensor dead": _dead_film,
    "road 6 K too warm": _warm_road,
}

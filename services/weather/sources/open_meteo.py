"""Open-Meteo's forecast: the hour that runs now, in metres per second, degrees Celsius and UTC."""

import msgspec

from drivemcp.errors import MALFORMED
from services.weather.observations.observation import Observation
from services.weather.sources import provider
from services.weather.sources.provider import NS, Place, Provider, UnusableAnswer

ADDRESS = "https://api.open-meteo.com/v1/forecast"
HALVES_S = 3 * provider.HOUR_S
SNOW_CM_PER_MM = 0.7
"""Its rule: 7 cm of snow are 10 mm of water."""
_UNITS = {
    "temperature_2m": "°C",
    "dew_point_2m": "°C",
    "relative_humidity_2m": "%",
    "rain": "mm",
    "showers": "mm",
    "snowfall": "cm",
    "visibility": "m",
    "wind_speed_10m": "m/s",
    "wind_gusts_10m": "m/s",
}

Values = list[float | None]


class _Hourly(msgspec.Struct, frozen=True, kw_only=True):
    time: list[int]
    temperature_2m: Values = []
    dew_point_2m: Values = []
    relative_humidity_2m: Values = []
    rain: Values = []
    showers: Values = []
    snowfall: Values = []
    visibility: Values = []
    wind_speed_10m: Values = []
    wind_gusts_10m: Values = []


class _Answer(msgspec.Struct, frozen=True, kw_only=True):
    hourly: _Hourly
    hourly_units: dict[str, str]


class _Refusal(msgspec.Struct, frozen=True, kw_only=True):
    error: bool = False
    reason: str = ""


def _address(base: str, place: Place) -> str:
    wanted = ",".join(_UNITS)
    return (
        f"{base}?latitude={place.latitude_deg:.2f}&longitude={place.longitude_deg:.2f}&hourly={wanted}"
        "&wind_speed_unit=ms&timeformat=unixtime&timezone=UTC&past_hours=1&forecast_hours=12"
    )


def read(body: bytes, now_ns: int) -> Observation:
    """The present hour: amounts are told for the hour that ends at a time, so the entry that ends the hour is taken."""
    answer = _decoded(body)
    provider.check_units(answer.hourly_units, _UNITS)
    hourly = answer.hourly
    place = _present(hourly.time, now_ns)

    def at(values: Values) -> float | None:
        return values[place] if place < len(values) else None

    snow_cm = at(hourly.snowfall)
    return Observation(
        source="Open-Meteo",
        stamp_ns=min(now_ns, hourly.time[place] * NS),
        confidence=provider.CONFIDENCE,
        halves_s=HALVES_S,
        rain_mm_h=provider.shower(_sum(at(hourly.rain), at(hourly.showers))),
        snow_mm_h=provider.shower(None if snow_cm is None else snow_cm / SNOW_CM_PER_MM),
        visibility_m=provider.sight(at(hourly.visibility)),
        air_c=provider.around(at(hourly.temperature_2m), provider.AIR_K),
        dew_point_c=provider.around(at(hourly.dew_point_2m), provider.AIR_K),
        humidity=provider.share(at(hourly.relative_humidity_2m)),
        wind_mps=provider.gusts(at(hourly.wind_speed_10m)),
        gust_mps=provider.gusts(at(hourly.wind_gusts_10m)),
    )


def _decoded(body: bytes) -> _Answer:
    try:
        refusal = msgspec.json.decode(body, type=_Refusal)
        if refusal.error:
            raise UnusableAnswer(f"it refuses: {refusal.reason[:200]}")
        return msgspec.json.decode(body, type=_Answer)
    except MALFORMED as error:
        raise UnusableAnswer(str(error)) from None


def _present(times_s: list[int], now_ns: int) -> int:
    for place, ends_s in enumerate(times_s):
        if 0 < ends_s * NS - now_ns <= provider.HOUR_S * NS:
            return place
    raise UnusableAnswer(f"none of its {len(times_s)} hours is the present one")


def _sum(*parts: float | None) -> float | None:
    known = [part for part in parts if part is not None]
    return sum(known) if known else None


def open_meteo(base: str = ADDRESS) -> Provider:
    """The service at `base`."""
    return Provider("open_meteo", lambda place: _address(base, place), read)

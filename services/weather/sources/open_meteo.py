"""Open-Meteo's forecast: the hour that runs now, in metres per second, degrees Celsius and UTC."""

from datetime import UTC, datetime
from typing import Any

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


class _Answer(msgspec.Struct, frozen=True, kw_only=True):
    hourly: dict[str, Any]
    """Lists by quantity; one that cannot be read is unknown, and the others count."""
    hourly_units: dict[str, Any] | None = None
    utc_offset_seconds: float | None = None


def _address(base: str, place: Place) -> str:
    wanted = ",".join(_UNITS)
    return (
        f"{base}?latitude={place.latitude_deg:.2f}&longitude={place.longitude_deg:.2f}&hourly={wanted}"
        "&wind_speed_unit=ms&timeformat=unixtime&timezone=UTC&past_hours=1&forecast_hours=12"
    )


def read(body: bytes, now_ns: int) -> Observation:
    """The present hour: amounts are told for the hour that ends at a time, so the entry that ends the hour is taken."""
    answer = _decoded(body)
    if not _UNITS.keys() & answer.hourly.keys():
        raise UnusableAnswer(f"hourly holds none of {', '.join(_UNITS)}")
    refused = provider.refused_units(answer.hourly_units or {}, _UNITS)
    times_s = _times(answer)
    place = _present(times_s, now_ns)

    def at(name: str) -> float | None:
        values = answer.hourly.get(name)
        if not isinstance(values, list) or place >= len(values) or name in refused:
            return None
        return provider.number(values[place])

    snow_cm = at("snowfall")
    return Observation(
        source="Open-Meteo",
        stamp_ns=min(now_ns, times_s[place] * NS),
        confidence=provider.CONFIDENCE,
        halves_s=HALVES_S,
        rain_mm_h=provider.shower(_sum(at("rain"), at("showers"))),
        snow_mm_h=provider.shower(None if snow_cm is None else snow_cm / SNOW_CM_PER_MM),
        visibility_m=provider.sight(at("visibility")),
        air_c=provider.around(at("temperature_2m"), provider.AIR_K),
        dew_point_c=provider.around(at("dew_point_2m"), provider.AIR_K),
        humidity=provider.share(at("relative_humidity_2m")),
        wind_mps=provider.gusts(at("wind_speed_10m")),
        gust_mps=provider.gusts(at("wind_gusts_10m")),
    )


def _decoded(body: bytes) -> _Answer:
    found = provider.json_of(body)
    if isinstance(found, list) and len(found) != 1:
        raise UnusableAnswer(f"it answers for {len(found)} places: ask for one latitude and longitude")
    found = found[0] if isinstance(found, list) else found
    if isinstance(found, dict) and found.get("error"):
        raise UnusableAnswer(f"it refuses: {str(found.get('reason'))[:200]}")
    try:
        return msgspec.convert(found, _Answer)
    except MALFORMED as error:
        raise UnusableAnswer(str(error)) from None


def _times(answer: _Answer) -> list[int]:
    """Seconds since 1970; 0 for an entry that is no time."""
    found = answer.hourly.get("time")
    if not isinstance(found, list) or not any(
        times := [_time(each, answer.utc_offset_seconds or 0.0) for each in found]
    ):
        raise UnusableAnswer("hourly.time holds no times (seconds since 1970, or ISO 8601)")
    return times


def _time(value: Any, offset_s: float) -> int:
    if isinstance(value, str):
        try:
            at = datetime.fromisoformat(value)
        except ValueError:
            return 0
        return round(at.timestamp() if at.tzinfo else at.replace(tzinfo=UTC).timestamp() - offset_s)
    return round(provider.number(value) or 0)


def _present(times_s: list[int], now_ns: int) -> int:
    for place, ends_s in enumerate(times_s):
        if 0 < ends_s * NS - now_ns <= provider.HOUR_S * NS:
            return place
    raise UnusableAnswer(f"none of its {len(times_s)} hours is the present one")


def _sum(*parts: float | None) -> float | None:
    """What is known to fall; 0 only where each part is known, since an unknown one may fall."""
    known = [part for part in parts if part is not None and part >= 0.0]
    return sum(known) or (0.0 if len(known) == len(parts) else None)


def open_meteo(base: str = ADDRESS) -> Provider:
    """The service at `base`."""
    return Provider("open_meteo", lambda place: _address(base, place), read)

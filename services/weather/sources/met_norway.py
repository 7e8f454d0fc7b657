"""MET Norway's Locationforecast 2.0, format `complete`: the hour that runs now.

It asks every client to name itself with an address to write to (User-Agent), to keep to the answer's `Expires`, and to
send If-Modified-Since; both are the fetcher's work.
"""

from datetime import datetime
from typing import Any

import msgspec

from drivemcp.errors import MALFORMED
from services.weather.observations.observation import Interval, Observation
from services.weather.sources import provider
from services.weather.sources.provider import NS, Place, Provider, UnusableAnswer

ADDRESS = "https://api.met.no/weatherapi/locationforecast/2.0/complete"
HALVES_S = 6 * provider.HOUR_S
_STEP_NS = int(provider.HOUR_S) * NS
_FOG_SHARE = 50.0
"""From this fog_area_fraction (%) on, fog is counted as being here."""
_FOG_M = Interval(50.0, 1000.0)
"""Fog is sight below 1,000 m (WMO); how far below, the forecast does not say."""
_UNITS = {
    "air_temperature": "celsius",
    "dew_point_temperature": "celsius",
    "relative_humidity": "%",
    "wind_speed": "m/s",
    "wind_speed_of_gust": "m/s",
    "fog_area_fraction": "%",
    "precipitation_amount": "mm",
}


class _Summary(msgspec.Struct, frozen=True, kw_only=True):
    symbol_code: str = ""


class _NextHour(msgspec.Struct, frozen=True, kw_only=True):
    details: dict[str, Any] = {}
    summary: _Summary = _Summary()


class _InstantRow(msgspec.Struct, frozen=True, kw_only=True):
    details: dict[str, Any] = {}
    """By quantity; one that cannot be read is unknown, and the others count."""


class _Data(msgspec.Struct, frozen=True, kw_only=True):
    instant: _InstantRow
    next_1_hours: _NextHour | None = None


class _Row(msgspec.Struct, frozen=True, kw_only=True):
    time: datetime
    data: _Data


class _Meta(msgspec.Struct, frozen=True, kw_only=True):
    updated_at: datetime
    units: dict[str, str]


class _Properties(msgspec.Struct, frozen=True, kw_only=True):
    meta: _Meta
    timeseries: list[_Row]


class _Answer(msgspec.Struct, frozen=True, kw_only=True):
    properties: _Properties


def _address(base: str, place: Place) -> str:
    return f"{base}?lat={place.latitude_deg:.2f}&lon={place.longitude_deg:.2f}"


def read(body: bytes, now_ns: int) -> Observation:
    """The forecast for the present hour, as old as the model run that it comes from."""
    try:
        properties = msgspec.json.decode(body, type=_Answer).properties
    except MALFORMED as error:
        raise UnusableAnswer(str(error)) from None
    refused = provider.refused_units(properties.meta.units, _UNITS)
    data = _present(properties.timeseries, now_ns).data

    def here(name: str) -> float | None:
        return None if name in refused else provider.number(data.instant.details.get(name))

    rain, snow = _falls(data.next_1_hours, told="precipitation_amount" not in refused)
    fog = here("fog_area_fraction")
    foggy = fog is not None and fog >= _FOG_SHARE
    return Observation(
        source="MET Norway",
        stamp_ns=_ns(properties.meta.updated_at),
        confidence=provider.CONFIDENCE,
        halves_s=HALVES_S,
        rain_mm_h=rain,
        snow_mm_h=snow,
        visibility_m=_FOG_M if foggy else None,
        air_c=provider.around(here("air_temperature"), provider.AIR_K),
        dew_point_c=provider.around(here("dew_point_temperature"), provider.AIR_K),
        humidity=provider.share(here("relative_humidity")),
        wind_mps=provider.gusts(here("wind_speed")),
        gust_mps=provider.gusts(here("wind_speed_of_gust")),
    )


def _present(rows: list[_Row], now_ns: int) -> _Row:
    current = [row for row in rows if 0 <= now_ns - _ns(row.time) < _STEP_NS]
    if not current:
        raise UnusableAnswer(f"none of its {len(rows)} hours is the present one")
    return current[-1]


def _falls(hour: _NextHour | None, *, told: bool) -> tuple[Interval | None, Interval | None]:
    """(rain, snow as water) in mm/h; sleet counts as both, and what has no symbol as rain."""
    if hour is None or not told:
        return None, None
    most, mean = (provider.number(hour.details.get(f"precipitation_amount{end}")) for end in ("_max", ""))
    fall = provider.shower(most or mean)
    symbol = hour.summary.symbol_code
    none = None if fall is None else Interval(0.0, 0.0)
    return (none if "snow" in symbol else fall, fall if "snow" in symbol or "sleet" in symbol else none)


def _ns(time: datetime) -> int:
    if time.tzinfo is None:
        raise UnusableAnswer("a time has no time zone")
    return round(time.timestamp()) * NS


def met_norway(base: str = ADDRESS) -> Provider:
    """The service at `base`."""
    return Provider("met_norway", lambda place: _address(base, place), read)

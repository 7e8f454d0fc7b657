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


class _Meta(msgspec.Struct, frozen=True, kw_only=True):
    updated_at: datetime
    units: dict[str, Any] | None = None


class _Properties(msgspec.Struct, frozen=True, kw_only=True):
    meta: _Meta
    timeseries: list[Any]
    """Hours; of one that cannot be read the others count, and so with its quantities."""


class _Answer(msgspec.Struct, frozen=True, kw_only=True):
    properties: _Properties


def _address(base: str, place: Place) -> str:
    return f"{base}?lat={place.latitude_deg:.2f}&lon={place.longitude_deg:.2f}"


def read(body: bytes, now_ns: int) -> Observation:
    """The forecast for the present hour, as old as the model run that it comes from."""
    try:
        properties = msgspec.convert(provider.json_of(body), _Answer).properties
    except MALFORMED as error:
        raise UnusableAnswer(str(error)) from None
    refused = provider.refused_units(properties.meta.units or {}, _UNITS)
    data = _present(properties.timeseries, now_ns)
    instant, symbol = (
        _below(data, "instant", "details"),
        str(_below(data, "next_1_hours", "summary").get("symbol_code") or ""),
    )

    def here(name: str) -> float | None:
        return None if name in refused else provider.number(instant.get(name))

    rain, snow = _falls(_below(data, "next_1_hours", "details"), symbol, told="precipitation_amount" not in refused)
    fog = here("fog_area_fraction")
    foggy = symbol.startswith("fog") or (fog is not None and fog >= _FOG_SHARE)
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


def _present(rows: list[Any], now_ns: int) -> dict[str, Any]:
    """The newest row of the hour that tells what falls; a nowcast has one each five minutes, and most tell the instant alone."""
    current = [row for row in rows if _is_present(row, now_ns)]
    if not current:
        raise UnusableAnswer(f"none of its {len(rows)} hours is the present one")
    told = [row for row in current if _below(row, "data", "next_1_hours")]
    return _below((told or current)[-1], "data")


def _is_present(row: Any, now_ns: int) -> bool:
    try:
        time = msgspec.convert(row.get("time") if isinstance(row, dict) else None, datetime)
    except MALFORMED:
        return False
    return 0 <= now_ns - _ns(time) < _STEP_NS


def _below(value: Any, *names: str) -> dict[str, Any]:
    """The object at this place; an empty one where something else stands there."""
    for name in names:
        value = value.get(name) if isinstance(value, dict) else None
    return value if isinstance(value, dict) else {}


def _falls(details: dict[str, Any], symbol: str, *, told: bool) -> tuple[Interval | None, Interval | None]:
    """(rain, snow as water) in mm/h; sleet counts as both, and so does what has no symbol, since it may be either."""
    if not told:
        return None, None
    most, mean = (provider.number(details.get(f"precipitation_amount{end}")) for end in ("_max", ""))
    fall = provider.shower(most or mean)
    none = None if fall is None else Interval(0.0, 0.0)
    return (none if "snow" in symbol else fall, fall if not symbol or "snow" in symbol or "sleet" in symbol else none)


def _ns(time: datetime) -> int:
    if time.tzinfo is None:
        raise UnusableAnswer("a time has no time zone")
    return round(time.timestamp()) * NS


def met_norway(base: str = ADDRESS) -> Provider:
    """The service at `base`."""
    return Provider("met_norway", lambda place: _address(base, place), read)

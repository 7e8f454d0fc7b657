"""An airfield's own report (METAR), read by the package `metar`: what was measured there within the last hour."""

import threading
import warnings
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from typing import Any

from metar.Metar import Metar, ParserError

from services.weather.observations.observation import Interval, Observation
from services.weather.sources import provider
from services.weather.sources.provider import NS, Provider, UnusableAnswer

ADDRESS = "https://aviationweather.gov/api/data/metar"
HALVES_S = provider.HOUR_S
OLDEST_NS = 3 * int(provider.HOUR_S) * NS
AHEAD_NS = 600 * NS
_DAY_NS = 86_400 * NS
# Intensity in a report -> mm/h as water: light below 2.5, heavy from 10 (WMO No. 8); its upper end ours.
_RAIN = {"-": Interval(0.1, 2.5), "": Interval(2.5, 10.0), "+": Interval(10.0, 50.0)}
_DRIZZLE = {"-": Interval(0.02, 0.2), "": Interval(0.2, 0.5), "+": Interval(0.5, 2.5)}
_SNOW = {"-": Interval(0.1, 1.0), "": Interval(1.0, 2.5), "+": Interval(2.5, 10.0)}
_FALLS: Mapping[str, tuple[str, Mapping[str, Interval]]] = {
    "RA": ("rain", _RAIN),
    "DZ": ("rain", _DRIZZLE),
    "UP": ("rain", _RAIN),
    "SN": ("snow", _SNOW),
    "SG": ("snow", _SNOW),
    "PL": ("snow", _SNOW),
    "GR": ("rain", _RAIN),
    "GS": ("snow", _SNOW),
}


_BROKEN = (ParserError, LookupError, ValueError, TypeError, AttributeError, ArithmeticError)
"""What the package raises on reports that are none."""
_QUIET = threading.Lock()


def read(body: bytes, now_ns: int) -> Observation:
    """The newest report in a plain text. Its day of the month is taken as the last one that has been."""
    report, stamp_ns = _newest(body, now_ns)
    if not -AHEAD_NS <= now_ns - stamp_ns <= OLDEST_NS:
        raise UnusableAnswer(f"its report is {abs(now_ns - stamp_ns) / NS / 3600:.1f} h from now")
    falls = _falls(report.weather)
    return Observation(
        source=f"METAR {report.station_id or ''}".strip(),
        stamp_ns=stamp_ns,
        confidence=provider.CONFIDENCE,
        halves_s=HALVES_S,
        rain_mm_h=falls["rain"],
        snow_mm_h=falls["snow"],
        visibility_m=provider.sight(_value(report.vis, "M")),
        air_c=provider.around(_value(report.temp, "C"), provider.AIR_K),
        dew_point_c=provider.around(_value(report.dewpt, "C"), provider.AIR_K),
        wind_mps=provider.gusts(_value(report.wind_speed, "MPS")),
        gust_mps=provider.gusts(_value(report.wind_gust, "MPS")),
    )


def _newest(body: bytes, now_ns: int) -> tuple[Any, int]:
    lines = [line.strip() for line in body.decode("ascii", errors="replace").splitlines() if line.strip()]
    problem = "it is empty"
    for line in lines[:20]:
        try:
            return _parsed(line, now_ns)
        except _BROKEN as error:
            problem = str(error)[:120]
    raise UnusableAnswer(f"no report that can be read: {problem}")


def _parsed(line: str, now_ns: int) -> tuple[Any, int]:
    """The report with its time: the package is told this month, and a day that is still to come was last month's."""
    now = datetime.fromtimestamp(now_ns / NS, UTC)
    months = ((now.year, now.month), (now.year - (now.month == 1), (now.month - 2) % 12 + 1))
    report, stamp_ns = None, 0
    for year, month in months:
        report = _lenient(line, year, month)
        if report.time is None:
            raise ParserError("it has no time")
        stamp_ns = round(report.time.replace(tzinfo=UTC).timestamp()) * NS
        if stamp_ns <= now_ns + _DAY_NS:
            break
    return report, stamp_ns


def _lenient(line: str, year: int, month: int) -> Any:
    """A report whose groups that the package does not know are passed over: it warns of each, and nobody reads that."""
    with _QUIET, warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return Metar(line, year=year, month=month, strict=False)


def _falls(weather: list[tuple[str, ...]]) -> dict[str, Interval]:
    """The most that falls of each, as water (mm/h). A report that names none saw none; strange groups count as rain."""
    found = {"rain": Interval(0.0, 0.0), "snow": Interval(0.0, 0.0)}
    for intensity, _, precipitation, _, _ in weather:
        for kind, amount in _amounts(intensity or "", precipitation or ""):
            found[kind] = max(found[kind], amount, key=lambda each: (each.high, each.low))
    return found


def _amounts(intensity: str, precipitation: str) -> Iterator[tuple[str, Interval]]:
    """What each two letters of a group stand for."""
    for start in range(0, len(precipitation), 2):
        kind, amounts = _FALLS.get(precipitation[start : start + 2], ("", {}))
        if kind:
            yield kind, Interval(0.0, 2.5) if intensity == "VC" else amounts.get(intensity, amounts[""])


def _value(quantity: Any, unit: str) -> float | None:
    return None if quantity is None else float(quantity.value(unit))


def metar(station: str, base: str = ADDRESS) -> Provider:
    """The reports of an airfield (four letters, as EDDB)."""
    return Provider(f"metar:{station}", lambda place: f"{base}?ids={station}&format=raw&hours=2", read)

"""An airfield's own report (METAR), read by the package `metar`: what was measured there within the last hour."""

import itertools
import re
import threading
import warnings
from datetime import UTC, datetime
from functools import partial
from typing import Any

from metar.Metar import Metar, ParserError

from services.weather.observations.observation import Interval, Observation
from services.weather.sources import metar_weather, provider
from services.weather.sources.provider import NS, Provider, UnusableAnswer

ADDRESS = "https://aviationweather.gov/api/data/metar"
HALVES_S = provider.HOUR_S
OLDEST_NS = 3 * int(provider.HOUR_S) * NS
AHEAD_NS = 600 * NS
_DAY_NS = 86_400 * NS
_REPORT = re.compile(
    r"\b(?:(?:METAR|SPECI) )?(?:COR )?(?P<station>[A-Z][A-Z0-9]{3}) \d{6}Z\b.*?"
    r"(?==|$|(?=\b(?:METAR|SPECI|TAF)\b|\b[A-Z][A-Z0-9]{3} \d{6}Z))"
)
"""A report in an answer; `=` ends it, or the next one."""
_OTHER = re.compile(r"\bTAF (?:AMD |COR )*$")
"""What stands before a forecast, which is no report; in a bulletin before the first alone."""
_FORECAST = re.compile(r"\d{6}Z (?:[A-Z]{3,4} )*\d{4}(?:/\d{4}|\d\d)\b|\sT[XN]M?\d\d/\d{4}Z\b")
"""What a forecast holds and a report does not: the days and hours that the forecast is for, and its extremes of temperature."""
_CORRECTION = re.compile(r"\b(?:COR|CC[A-Z])\b")
_WIND = re.compile(r"\s(?:\d{3}|VRB|///)P?\d{2,3}(?:GP?\d{2,3})?(?:KTS?|MPS|KMH)\b")
"""The package takes a sight of four digits for a wind where none stands before."""
_TIDIED = (
    (re.compile(r"(?<=\d) (?=(?:SM|KM) )"), ""),
    (re.compile(r"(?<= )O(?=\d{3} )"), "0"),
    (re.compile(r"(?<= )M (?=\d\d/)"), "M"),
    (re.compile(rf"(\d{{6}}Z(?: [A-Z]{{3,4}})*)(?!{_WIND.pattern})(?: [\dV/KT]+)?(?= \d{{4}} )"), r"\1 /////KT"),
    (
        re.compile(
            r" (?:R\d\d[LCR]?/(?:CLRD|SNOCLO|[\d/]{6})\S*|(?:BLACK)?(?:BLU|WHT|GRN|YLO|AMB|RE[A-Z]+)[\d+]*)(?= )"
        ),
        "",
    ),
)
"""What leads the package astray: a sight apart from its unit (`1/2 SM` is a temperature to it), a letter O, a minus apart, no wind.
Behind states of runways, colours and recent weather it reads neither clouds nor temperatures.
"""
STRONGEST_MPS = 115.0
"""More than every gust that an airfield has measured."""
MOST = 100
"""Reports of the airfield that is asked for."""
MOST_NAMED = 5
_NAME = 40
"""Characters before a report in which it may be called a forecast."""

_BROKEN = (ParserError, LookupError, ValueError, TypeError, AttributeError, ArithmeticError)
"""What the package raises on text that is not a report."""
_QUIET = threading.Lock()


def read(body: bytes, now_ns: int, station: str = "") -> Observation:
    """The newest report in a plain text, of that station alone. Its day of the month is taken as the last one that has been."""
    report, text, stamp_ns = _newest(body, now_ns, station)
    if not _of_now(stamp_ns, now_ns):
        raise UnusableAnswer(f"its report is {abs(now_ns - stamp_ns) / NS / 3600:.1f} h from now")
    falls, (air_c, dew_point_c) = _falls(report, text), _temperatures(report)
    return Observation(
        source=f"METAR {report.station_id or ''}".strip(),
        stamp_ns=stamp_ns,
        confidence=provider.CONFIDENCE,
        halves_s=HALVES_S,
        rain_mm_h=falls["rain"],
        snow_mm_h=falls["snow"],
        visibility_m=provider.sight(_sight(report, text)),
        air_c=provider.around(air_c, provider.AIR_K),
        dew_point_c=provider.around(dew_point_c, provider.AIR_K),
        wind_mps=provider.gusts(_wind(text, report.wind_speed)),
        gust_mps=provider.gusts(_wind(text, report.wind_gust)),
        road=metar_weather.road(text),
    )


def _newest(body: bytes, now_ns: int, station: str) -> tuple[Any, str, int]:
    """The newest report that says something: not NIL, not all slashes; of those of one time a correction, else a special report."""
    text = " ".join(body.decode("utf-8-sig", errors="replace").split())
    found: list[tuple[bool, bool, int, str, bool, Any, str]] = []
    problem = "it holds no report" if text else "it is empty"
    stations = {report["station"] for report in _REPORT.finditer(text)}
    if station and stations and station not in stations:
        problem = f"its reports are of {', '.join(sorted(stations)[:MOST_NAMED])}, not of {station}"
    wanted = (report for report in _REPORT.finditer(text) if not station or report["station"] == station)
    for report in itertools.islice(wanted, MOST):
        if _OTHER.search(text[max(0, report.start() - _NAME) : report.start()]) or _FORECAST.search(report[0]):
            problem = f"{report[0].strip()[:40]}: a forecast (TAF), not a report"
            continue
        if re.search(r"\bNIL\b", report[0]):
            problem = f"{report[0].strip()[:40]}: nothing was observed"
            continue
        try:
            parsed, stamp_ns = _parsed(report[0].strip(), now_ns)
        except _BROKEN:
            problem = f"a report in a form that is not known: {report[0].strip()[:60]!r}"
        else:
            told, corrected = _says_something(parsed, report[0]), "".join(_CORRECTION.findall(report[0])[:1])
            special = report[0].startswith("SPECI")
            found.append((_of_now(stamp_ns, now_ns), told, stamp_ns, corrected, special, parsed, report[0]))
    if not found:
        raise UnusableAnswer(f"no report that can be read: {problem}")
    _, _, stamp_ns, _, _, parsed, told_in = max(found, key=lambda each: each[:5])
    return parsed, told_in, stamp_ns


def _of_now(stamp_ns: int, now_ns: int) -> bool:
    return -AHEAD_NS <= now_ns - stamp_ns <= OLDEST_NS


def _tidied(line: str) -> str:
    for pattern, better in _TIDIED:
        line = pattern.sub(better, f"{line} ")
    return line


def _says_something(report: Any, text: str) -> bool:
    """Whether it says what falls, or how far one sees."""
    return any(_falls(report, text).values()) or _sight(report, text) is not None


def _falls(report: Any, text: str) -> dict[str, Interval | None]:
    """mm/h as water; what a report does not name is unknown where it breaks off before, or its sensor is missing."""
    broken_off = report.vis is None and report.temp is None and not report.sky
    blind = broken_off or any(set(each[2] or "") == {"/"} for each in report.weather)
    found = metar_weather.falls(text)
    return {kind: None if blind and amount and not amount.high else amount for kind, amount in found.items()}


def _temperatures(report: Any) -> tuple[float | None, float | None]:
    """Of air and dew point, °C; neither where the dew point is higher, which no air has: it is a sight (`3/4`)."""
    air_c, dew_point_c = _value(report.temp, "C"), _value(report.dewpt, "C")
    absurd = air_c is not None and dew_point_c is not None and dew_point_c - air_c >= 1.0
    return (None, None) if absurd else (air_c, dew_point_c)


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
    """A report; groups that the package does not know are passed over. The package warns of each, and its warnings are ignored."""
    with _QUIET, warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return Metar(_tidied(line), year=year, month=month, strict=False)


def _sight(report: Any, text: str) -> float | None:
    """The shortest of the distances told; the package takes a missing one (`////`) for 10 km."""
    if re.search(r"\s////(SM)?\s", text):
        return None
    told = [each for each in (_value(report.vis, "M"), _value(report.max_vis, "M")) if each is not None]
    return min(told, default=None)


def _wind(text: str, speed: Any) -> float | None:
    """m/s; None where the report holds no wind, or one that does not blow."""
    value_mps = _value(speed, "MPS") if _WIND.search(text) else None
    return value_mps if value_mps is not None and value_mps <= STRONGEST_MPS else None


def _value(quantity: Any, unit: str) -> float | None:
    return None if quantity is None else float(quantity.value(unit))


def metar(station: str, base: str = ADDRESS) -> Provider:
    """The reports of an airfield (four letters, as EDDB)."""
    return Provider(
        f"metar:{station}", lambda place: f"{base}?ids={station}&format=raw&hours=2", partial(read, station=station)
    )

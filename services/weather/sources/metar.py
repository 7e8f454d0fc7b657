"""An airfield's own report (METAR), read by the package `metar`: what was measured there within the last hour."""

import itertools
import re
import threading
import warnings
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from functools import partial
from typing import Any

from metar.Metar import Metar, ParserError

from services.weather.observations.observation import Interval, Observation, RoadState
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
NEARBY = Interval(0.0, 2.5)
_LIFTED = ("DR", "BL")
"""Drifting and blowing snow lay on the ground before; none falls."""
_FALLS: Mapping[str, tuple[tuple[str, Mapping[str, Interval]], ...]] = {
    "RA": (("rain", _RAIN),),
    "DZ": (("rain", _DRIZZLE),),
    "UP": (("rain", _RAIN), ("snow", _SNOW)),  # unknown precipitation may be either
    "SN": (("snow", _SNOW),),
    "SG": (("snow", _SNOW),),
    "PL": (("snow", _SNOW),),
    "GR": (("rain", _RAIN),),
    "GS": (("snow", _SNOW),),
}
_REPORT = re.compile(
    r"\b(?:(?:METAR|SPECI) )?(?:COR )?[A-Z][A-Z0-9]{3} \d{6}Z\b.*?(?==|$|(?=\b(?:METAR|SPECI|TAF)\b|\b[A-Z][A-Z0-9]{3} \d{6}Z))"
)
"""A report in an answer; `=` ends it, or the next one."""
_OTHER = re.compile(r"\bTAF (?:AMD |COR )*$")
"""What stands before a forecast, which is no report; in a bulletin before the first alone."""
_FORECAST = re.compile(r"\d{6}Z (?:[A-Z]{3,4} )*\d{4}(?:/\d{4}|\d\d)\b|\sT[XN]M?\d\d/\d{4}Z\b")
"""What a forecast holds and a report does not: the days and hours that the forecast is for, and its extremes of temperature."""
_CORRECTION = re.compile(r"\b(?:COR|CC[A-Z])\b")
_WIND = re.compile(r"\s(?:\d{3}|VRB|///)P?\d{2,3}(?:GP?\d{2,3})?(?:KTS?|MPS|KMH)\b")
"""The package takes a sight of four digits, or one with a letter O, for a wind."""
STRONGEST_MPS = 115.0
"""More than every gust that an airfield has measured."""
MOST = 100

_BROKEN = (ParserError, LookupError, ValueError, TypeError, AttributeError, ArithmeticError)
"""What the package raises on text that is not a report."""
_QUIET = threading.Lock()


def read(body: bytes, now_ns: int, station: str = "") -> Observation:
    """The newest report in a plain text, of that station alone. Its day of the month is taken as the last one that has been."""
    report, stamp_ns = _newest(body, now_ns, station)
    if not _of_now(stamp_ns, now_ns):
        raise UnusableAnswer(f"its report is {abs(now_ns - stamp_ns) / NS / 3600:.1f} h from now")
    falls = _falls(report)
    return Observation(
        source=f"METAR {report.station_id or ''}".strip(),
        stamp_ns=stamp_ns,
        confidence=provider.CONFIDENCE,
        halves_s=HALVES_S,
        rain_mm_h=falls["rain"],
        snow_mm_h=falls["snow"],
        visibility_m=provider.sight(_sight(report)),
        air_c=provider.around(_value(report.temp, "C"), provider.AIR_K),
        dew_point_c=provider.around(_value(report.dewpt, "C"), provider.AIR_K),
        wind_mps=provider.gusts(_wind(report, report.wind_speed)),
        gust_mps=provider.gusts(_wind(report, report.wind_gust)),
        road=_road(report),
    )


def _newest(body: bytes, now_ns: int, station: str) -> tuple[Any, int]:
    """The newest report that says something: not NIL, not all slashes; of those of one time a correction, else a special report."""
    text = " ".join(body.decode("utf-8-sig", errors="replace").split())
    found: list[tuple[bool, bool, int, str, bool, Any]] = []
    problem = "it holds no report" if text else "it is empty"
    for report in itertools.islice(_REPORT.finditer(text), MOST):
        if _OTHER.search(text[: report.start()]) or _FORECAST.search(report[0]):
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
            if station and parsed.station_id != station:
                problem = f"its reports are of {parsed.station_id}, not of {station}"
                continue
            told, corrected = _says_something(parsed), "".join(_CORRECTION.findall(report[0])[:1])
            special = report[0].startswith("SPECI")
            found.append((_of_now(stamp_ns, now_ns), told, stamp_ns, corrected, special, parsed))
    if not found:
        raise UnusableAnswer(f"no report that can be read: {problem}")
    _, _, stamp_ns, _, _, parsed = max(found, key=lambda each: each[:5])
    return parsed, stamp_ns


def _of_now(stamp_ns: int, now_ns: int) -> bool:
    return -AHEAD_NS <= now_ns - stamp_ns <= OLDEST_NS


def _says_something(report: Any) -> bool:
    """Whether it says what falls, or how far one sees."""
    return _falls(report)["rain"] is not None or _sight(report) is not None


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
        return Metar(line, year=year, month=month, strict=False)


def _falls(report: Any) -> dict[str, Interval | None]:
    """The most that falls of each, as water (mm/h). A report that names none saw none, unless its sensor is missing (`//`, in
    the United States `PWINO`), or it breaks off before.
    """
    found = {"rain": Interval(0.0, 0.0), "snow": Interval(0.0, 0.0)}
    for intensity, descriptor, precipitation, _, _ in report.weather:
        for kind, amount in _amounts(intensity or "", descriptor or "", precipitation or ""):
            found[kind] = max(found[kind], amount, key=lambda each: (each.high, each.low))
    broken_off = report.vis is None and report.temp is None and not report.sky
    blind = broken_off or " PWINO" in report.code or any(set(each[2] or "") == {"/"} for each in report.weather)
    return {kind: None if blind and not amount.high else amount for kind, amount in found.items()}


def _amounts(intensity: str, descriptor: str, precipitation: str) -> Iterator[tuple[str, Interval]]:
    """What each two letters of a group stand for. A shower or a storm nearby may reach the road."""
    if descriptor in _LIFTED:
        return
    if intensity == "VC" and descriptor in ("SH", "TS") and not precipitation:
        yield "rain", NEARBY
    for start in range(0, len(precipitation), 2):
        letters = precipitation[start : start + 2]
        for kind, amounts in _FALLS.get(letters, ()):
            yield kind, NEARBY if intensity == "VC" else amounts.get(intensity, amounts[""])


def _road(report: Any) -> RoadState | None:
    """What freezes (`FZ`) freezes on the road, whatever the thermometer says, also if it fell within the last hour (`RE`)."""
    freezing = [each for each in (*report.weather, *report.recent) if each[1] == "FZ"]
    if any(each[2] for each in freezing):
        return "ice"
    return "frost" if freezing else None


def _sight(report: Any) -> float | None:
    """The shortest of the distances told; the package takes a missing one (`////`) for 10 km."""
    if re.search(r"\s////(SM)?\s", report.code):
        return None
    told = [each for each in (_value(report.vis, "M"), _value(report.max_vis, "M")) if each is not None]
    return min(told, default=None)


def _wind(report: Any, speed: Any) -> float | None:
    """m/s; None where the report holds no wind, or one that does not blow."""
    value_mps = _value(speed, "MPS") if _WIND.search(report.code) else None
    return value_mps if value_mps is not None and value_mps <= STRONGEST_MPS else None


def _value(quantity: Any, unit: str) -> float | None:
    return None if quantity is None else float(quantity.value(unit))


def metar(station: str, base: str = ADDRESS) -> Provider:
    """The reports of an airfield (four letters, as EDDB)."""
    return Provider(
        f"metar:{station}", lambda place: f"{base}?ids={station}&format=raw&hours=2", partial(read, station=station)
    )

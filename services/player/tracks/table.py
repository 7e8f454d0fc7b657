"""Tracks as tables (CSV): columns by the names in the header."""

import contextlib
import csv
import itertools
import math
import re
import statistics
from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import UTC, datetime
from typing import NamedTuple

from drivemcp.files.since_1970 import are_days, counts_per_s, dated_s
from drivemcp.files.time_of_day import Clock, second_of_day, second_of_digits
from services.player.can_log import SPEED_UNITS
from services.player.tracks.coordinates import degrees, in_minutes, of_minutes
from services.player.tracks.fix import Fix, Left, number

_AND_UNIT = r"[ _]*[(\[]?(?:utc|gmt|(?P<unit>s|sec|seconds|ms|msec|milliseconds?|us|µs|microseconds?|ns))?[)\]]?"
COLUMNS: Mapping[str, str] = {
    "time": r"(?:gps|unix|utc|local|device|system|fix)?[ _]?(?:time|timestamp|t|secs?|seconds|elapsed[a-z _]*?|utc|epoch(?:[ _]time)?"
    r"|fly[ _]?time|time[ _]since[ _][a-z]+|date.?time|zeit|zeitstempel|uhrzeit|temps|heure|horodatage|tijd|tijdstip|hora|tiempo"
    rf"|ora|tempo|czas){_AND_UNIT}",
    "latitude": r"(?:gps[ _]?)?lat(?:[ _]?e7)?|(?:gps[ _]?)?latitu.*|lat[ _]?\(?d.*|gps[ _]?\(lat\.?\).*"
    r"|breite(?:ngrad)?.*|breedte(?:graad)?.*|szeroko[sś][cć].*",
    "longitude": r"(?:gps[ _]?)?(?:lon|lng|long)(?:[ _]?e7)?|(?:gps[ _]?)?longitu.*|lon[ _]?\(?d.*|gps[ _]?\(long?\.?\).*"
    r"|l(?:ä|ae)nge(?:ngrad)?.*"
    r"|lengte(?:graad)?.*|d[lł]ugo[sś][cć].*",
    "course": r"course.*|(?:compass[ _]?)?heading.*|bearing.*"
    r"|track(?:[ _(\[]*(?:deg|angle|made|true).*)?|direction(?:[ _]*[(\[]?(?:°|deg).*)?|kurs.*|richtung.*|cap|koers|rumbo.*|rotta.*",
    "nanoseconds": r"(?:.*[ _])?n(?:ano)?sec(?:s|onds)?",
    "date": r"date|datum|utc[ _]?date|gps[ _]?date|fecha|data",
    "north or south": r"n[/_ ]?s.*|lat(?:itude)?[ _]?(?:dir|hemi|ref|n[/_ ]?s).*",
    "east or west": r"e[/_ ]?w.*|lon(?:g|gitude)?[ _]?(?:dir|hemi|ref|e[/_ ]?w).*",
}
SPEEDS = "speed|velocity|geschwindigkeit|vitesse|snelheid|velocidad|velocit[aà]|pr[eę]dko[sś][cć]"
BESIDE = re.compile("accuracy|error|limit|sigma|std|genauigkeit|pr[eé]cision|nauwkeurigheid")
"""What a column says beside a quantity."""
NEGATIVE = ("s", "w")
_PREFIX = re.compile(r"^(?:%|(?:\w+\.)+)")
"""Before the names of a recorded message's fields: `field.latitude`."""
SIDES = frozenset("NSEW")
TIME_UNITS = {
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), 1e3),
    **dict.fromkeys(("us", "µs", "microsecond", "microseconds"), 1e6),
    "ns": 1e9,
}
HEAD_LINES = 50
"""Among these the header stands; some programs write about the file before it."""
LONGEST_STEP_S = 5.0
"""Between the fixes of a track that is of use; a longer one may be of another unit."""
ENOUGH = 10
"""So many times with a decimal point show by their steps that they are no seconds."""
SUMMER_TIME_S = (3_540.0, 3_600.0)
"""A clock that falls back by so much, once, was put back from summer time."""
SINCE_1970 = 9e8


class OtherTableError(Exception):
    """A table without the columns of a track."""


class _Row(NamedTuple):
    where: str
    time: str
    latitude_deg: float
    longitude_deg: float
    speed_mps: float | None
    course_deg: float | None


def fixes(text: str, left: Left) -> Iterator[Fix]:
    """Columns by the names in the first line that names those of a track. Raises ValueError naming the column, or OtherTableError."""
    lines = text.splitlines()
    first = _header_at(lines)
    delimiter = _delimiter(lines[first]) if lines else ","
    table = csv.reader(lines[first:], delimiter=delimiter)
    header = next(table, [])
    columns = _columns([name for name in header if name])
    named = re.fullmatch(COLUMNS["time"], _PREFIX.sub("", columns["time"].strip().lower()))
    lines_of_cells = list(enumerate(table, first + 2))
    units = _units_row(lines_of_cells, header, columns)
    below = units.get(columns["time"], "").lower()
    unit = (named["unit"] if named else "") or (below if below in TIME_UNITS else "")
    rows = list(_rows(lines_of_cells, delimiter, header, columns, _speed_column(header, units, left), left))
    as_sentences = in_minutes([(row.latitude_deg, row.longitude_deg) for row in rows])
    if not as_sentences and not unit:
        _check_unit(columns["time"], [row.time for row in rows])
    clock, of_day = Clock(), as_sentences or all(second_of_digits(row.time) is not None for row in rows)
    times = [_time(row.time, unit, delimiter, clock, digits=of_day) for row in rows]
    for row, at_s in zip(rows, _without_summer_time(times), strict=True):
        if at_s is None:
            left.add("neither seconds, a time of day nor an ISO 8601 time", f"{row.where}: time {row.time!r}")
            continue
        latitude, longitude = row.latitude_deg, row.longitude_deg
        if as_sentences:
            latitude, longitude = of_minutes(latitude), of_minutes(longitude)
        yield Fix(at_s, latitude, longitude, row.speed_mps, row.course_deg)


def _without_summer_time(times: Sequence[float | None]) -> list[float | None]:
    """Times in the order of the file, of which an hour's last part comes twice, as one clock."""
    known = [each for each in times if each is not None]
    falls = [before - after for before, after in itertools.pairwise(known) if after < before]
    least, most = SUMMER_TIME_S
    if len(falls) != 1 or not least <= falls[0] <= most:
        return list(times)
    found, gone_s, last_s = list[float | None](), 0.0, -math.inf
    for each in times:
        if each is not None and each < last_s:
            gone_s = most
        last_s = each if each is not None else last_s
        found.append(each + gone_s if each is not None else None)
    return found


def _header_at(lines: Sequence[str]) -> int:
    """The first line that names the columns of a track, else the first that is no remark."""
    told = [at for at, line in enumerate(lines[:HEAD_LINES]) if line.strip() and not re.match(r"\s*(#|sep=)", line)]
    for at in told:
        with contextlib.suppress(OtherTableError):
            _columns([name for name in next(csv.reader([lines[at]], delimiter=_delimiter(lines[at]))) if name])
            return at
    return told[0] if told else 0


def _delimiter(line: str) -> str:
    return max(",;\t|", key=line.count)


def _check_unit(name: str, times: Sequence[str]) -> None:
    """That the times of a column without a unit count seconds. Raises ValueError where they may count something else."""
    numbers = [value for each in times if (value := number(each, ";")) is not None]
    if len(numbers) == len(times) and are_days(numbers):
        raise ValueError(f"column {name!r} counts days, as spreadsheets do: format it as date and time with seconds")
    if len(times) > 1 and all(re.fullmatch(r"\d{1,3}:\d\d", each) for each in times):
        raise ValueError(f"column {name!r} has times of two parts: write hours, minutes and seconds")
    values = sorted(numbers)
    whole = all(each.isdigit() for each in times)
    if len(values) < max(2 if whole else ENOUGH, len(times)) or values[-1] > SINCE_1970:
        return
    step = statistics.median(after - before for before, after in itertools.pairwise(values))
    if step > LONGEST_STEP_S:
        raise ValueError(f"column {name!r} has numbers in steps of {step:g}: name their unit, as in time_ms or time_s")


def _columns(names: list[str]) -> dict[str, str]:
    """The name of the column for each quantity, empty where the table has no such column. Raises OtherTableError."""
    columns = {what: _column(names, pattern) for what, pattern in COLUMNS.items()}
    for place, side in (("latitude", "north or south"), ("longitude", "east or west")):
        if columns[place] == columns[side]:  # `latitude_ref` before `latitude`
            others = _column([name for name in names if name != columns[side]], COLUMNS[place])
            columns[place], columns[side] = (others, columns[side]) if others else (columns[place], "")
    if not columns["time"]:  # some programs write date and time under the name of the date
        columns["time"], columns["date"] = columns["date"], ""
    missing = [what for what in ("time", "latitude", "longitude") if not columns[what]]
    if missing:
        raise OtherTableError(f"no column {' nor '.join(missing)} among {', '.join(names)}")
    return columns


def _units_row(lines: list[tuple[int, list[str]]], header: list[str], columns: Mapping[str, str]) -> Mapping[str, str]:
    """The units that rows below the header name by column, as RaceChrono and AiM write them; these rows are taken out of the lines."""
    units: dict[str, str] = {}
    while lines:
        row = {name: cell.strip() for name, cell in zip(header, lines[0][1], strict=False)}
        of_degrees = all(_UNIT_OF_DEGREES.fullmatch(row.get(columns[what], "")) for what in PLACE)
        if not any(row.values()) or not of_degrees or re.search(r"\d", row.get(columns["time"], "")):
            break
        units |= {name: cell for name, cell in row.items() if name and cell and name not in units}
        del lines[0]
    return units


_UNIT_OF_DEGREES = re.compile(r"deg.*|°|\d+:.*", re.I)
"""What such a row says of a place, or by which sensor it was measured."""
PLACE = ("latitude", "longitude")


def _rows(
    lines: Iterable[tuple[int, list[str]]],
    delimiter: str,
    header: list[str],
    columns: Mapping[str, str],
    of_speed: tuple[str, float],
    left: Left,
) -> Iterator[_Row]:
    """The rows that have a place; numbers in minutes are still as they stand."""
    names = [name for name in header if name]
    speed, factor = of_speed
    for count, cells in lines:
        if not any(each.strip() for each in cells):
            continue
        where = f"line {count}"
        joined = _with_sides(cells, len(names))
        row = dict(zip(header if joined is cells else names, joined, strict=False)) | {"": ""}
        said = {what: row.get(name, "").strip() for what, name in columns.items()}
        latitude = _side(columns["latitude"], said["latitude"], "latitude", said["north or south"])
        longitude = _side(columns["longitude"], said["longitude"], "longitude", said["east or west"])
        second, part = said["time"], said["nanoseconds"]
        second += f".{int(part):09d}" if second.isdigit() and part.isdigit() else ""
        time = " ".join(filter(None, (said["date"], second)))
        if latitude is None or longitude is None:
            told = [f"{columns[what]} {said[what]!r}" for what in ("latitude", "longitude")]
            clear = _time(time, "", delimiter, Clock()) is not None
            kind = (
                "no degrees, with minutes and seconds or without"
                if clear
                else "neither seconds, a time of day nor an ISO 8601 time"
            )
            left.add(kind, f"{where}: {', '.join(told)}" if clear else f"{where}: time {time!r}")
            continue
        mps = number(row.get(speed), delimiter)
        if mps is None and (cell := (row.get(speed) or "").strip()):
            left.add("its speed is no number; the speed is taken from the places", f"{where}: {speed} {cell!r}")
        yield _Row(
            where,
            time,
            latitude,
            longitude,
            mps * factor if mps is not None else None,
            _of_radians(columns["course"], number(said["course"], delimiter)),
        )


def _with_sides(cells: list[str], wanted: int) -> list[str]:
    """A row whose N, S, E or W stand in cells that the header does not name, with these taken into the cell before."""
    if len(cells) <= wanted:
        return cells
    joined: list[str] = []
    for cell in cells:
        if cell.strip().upper() in SIDES and joined:
            joined[-1] += f" {cell.strip()}"
        else:
            joined.append(cell)
    return joined if len(joined) == wanted else cells


def _of_radians(name: str, value: float | None) -> float | None:
    in_radians = re.search(r"(?:\b|_)rad(?:ian)?s?\W*$", name.lower())  # no `Breitengrad`
    return math.degrees(value) if value is not None and in_radians else value


def _side(name: str, text: str, axis: str, side: str) -> float | None:
    whole = re.fullmatch(r"[+-]?\d+", text) if name.lower().endswith("e7") else None
    value = int(text) / 1e7 if whole else _of_radians(name, degrees(text, axis))
    return -abs(value) if value is not None and side.lower().startswith(NEGATIVE) else value


def _column(names: Sequence[str], pattern: str) -> str:
    known = (name for name in names if re.fullmatch(pattern, _PREFIX.sub("", name.strip().lower())))
    return next((name for name in known if not BESIDE.search(name.lower())), "")


def _speed_column(header: list[str], units: Mapping[str, str], left: Left) -> tuple[str, float]:
    """The column of the speed, which may be named by its unit alone, and what turns it into m/s; no name: no column of a known unit."""
    names, unknown = [name for name in header if name], ""
    for name in names:
        found = re.match(rf"(?:gps|ground)?[ _(]*(?:[23]d[ _]?)?(?:{SPEEDS})(?P<unit>.*)", name.strip().lower())
        if found and not BESIDE.search(name.lower()):
            unit = re.sub(r"over[ _]ground|[ _()\[\]]", "", found["unit"] or units.get(name, "").strip().lower())
            if unit in SPEED_UNITS:
                return name, SPEED_UNITS[unit]
            unknown = unknown or name
    if unknown:
        left.add("it names no unit, as speed_kmh does; the speed is taken from the places", f"column {unknown!r}")
        return "", 1.0
    bare = ((name, re.sub(r"[ ()\[\]]", "", name.lower())) for name in names)
    return next(((name, SPEED_UNITS[unit]) for name, unit in bare if unit in SPEED_UNITS), ("", 1.0))


def _time(text: str, unit: str, delimiter: str, clock: Clock, *, digits: bool = False) -> float | None:
    """Seconds; of a date that is not ISO 8601 the time of day counts, since day and month may stand in either order.

    `digits`: 100059 is one second before 100100, as it is behind a date.
    """
    if (digits or " " in text) and not unit and (second := second_of_digits(text.rpartition(" ")[2])) is not None:
        return clock.after(second)
    if not unit and (at_s := dated_s(text)) is not None:
        return at_s
    value = number(text, delimiter)
    if value is not None:
        return value / TIME_UNITS.get(unit, counts_per_s(value))
    try:
        at = datetime.fromisoformat(re.sub(r"\s*UTC$", "+00:00", text.strip()))
    except ValueError:
        second = second_of_day(text)
        return clock.after(second) if second is not None else None
    return (at if at.tzinfo is not None else at.replace(tzinfo=UTC)).timestamp()

"""A position track beside a recording (GPX, NMEA 0183, CSV) or inside its video: ego speed and position at the recording's pace."""

import contextlib
import csv
import math
import re
from collections.abc import Callable, Iterator, Mapping
from datetime import UTC, date, datetime, time
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

import gpxpy
import gpxpy.gpx
import pynmea2

from drivemcp.errors import UserError
from drivemcp.files.encodings import encoding_of
from drivemcp.files.folders import files_beside
from proto import topics
from proto.sensors import GnssFix
from proto.vehicle import Ego
from services.player.can_log import SPEED_UNITS
from services.player.embedded_track import SUFFIXES, embedded_rows
from services.player.recording import TimedMessage

RATE_HZ = 10.0
MOST_GAP_S = 5.0
"""Between fixes farther apart nothing is interpolated: speed and position are unknown there."""
SIGMA_M = 5.0
"""Of a phone's or a dashcam's receiver under open sky."""
EARTH_M = 6_371_000.0
MOST_MPS = 100.0
"""A faster fix is a receiver's jump."""


class Fix(NamedTuple):
    """One fix: seconds since the track's first, degrees (WGS 84), and what the receiver says of the motion."""

    at_s: float
    latitude_deg: float
    longitude_deg: float
    speed_mps: float | None = None
    course_deg: float | None = None
    """Clockwise from north."""


class NoTrackError(UserError):
    """A table of something else."""


class Left:
    """What of a file was not read: by kind how often, and the first of it."""

    def __init__(self) -> None:
        self._kinds: dict[str, list[str]] = {}

    def add(self, kind: str, where: str) -> None:
        """Count one more."""
        self._kinds.setdefault(kind, []).append(where)

    def __str__(self) -> str:
        return "; ".join(f"{len(found)} not read, first {found[0]}: {kind}" for kind, found in self._kinds.items())


def track_beside(source: Path) -> Path | None:
    """The track of the same name beside a file, else the file itself if it holds one, or the one inside a folder.

    A table of something else is passed over. Raises UserError for a track that cannot be read, or several.
    """
    found = [file for file in files_beside(source, READERS) if _is_track(file)]
    if len(found) > 1:
        names = ", ".join(file.name for file in found)
        raise UserError(f"{source} has several position tracks: {names}; name one with --track, or --track none")
    if not found and source.suffix.lower() in SUFFIXES and source.is_file():
        with contextlib.suppress(UserError):  # most videos hold no positions
            found = [source] if read_track(source) else []
    return found[0] if found else None


def _is_track(file: Path) -> bool:
    try:
        return bool(read_track(file))
    except NoTrackError:
        return False
    except UserError as error:
        raise UserError(f"{error}; mend it, name another with --track, or --track none") from None


def read_track(path: Path) -> tuple[Fix, ...]:
    """The fixes of a file in the order of their times, inside a video from its start. Raises UserError naming file and field."""
    return _read(path)[0]


def not_read(path: Path) -> str:
    """What of a track was not read, in words; empty where all was. Raises UserError."""
    return "" if path.suffix.lower() in SUFFIXES else str(_read(path)[1])


def _read(path: Path) -> tuple[tuple[Fix, ...], Left]:
    try:
        at = path.stat()
    except OSError as error:
        raise UserError(f"cannot read {path}: {error.strerror}") from None
    return _read_once(path, at.st_mtime_ns, at.st_size)


@lru_cache(2)
def _read_once(path: Path, written_ns: int, size: int) -> tuple[tuple[Fix, ...], Left]:
    """A track is asked for when it is looked for, played, and told of: it is read once, as long as the file stays as it is."""
    inside = path.suffix.lower() in SUFFIXES
    reader = READERS.get(path.suffix.lower())
    left = Left()
    if reader is None and not inside:
        raise UserError(
            f"{path}: a position track is one of {', '.join(READERS)}, or a video with positions ({', '.join(SUFFIXES)})"
        )
    try:
        found = [Fix(*row) for row in embedded_rows(path)] if reader is None else list(reader(_text(path), left))
    except OSError as error:
        raise UserError(f"cannot read {path}: {error.strerror}") from None
    except gpxpy.gpx.GPXException as error:
        raise UserError(
            f"{path}: no GPX, or one that is cut or damaged: {' '.join(str(error).split())[:200]}"
        ) from None
    except (csv.Error, ValueError, OverflowError) as error:
        raise UserError(f"{path}: {' '.join(str(error).split())[:200]}") from None
    except _OtherTableError as error:
        raise NoTrackError(f"{path}: {error}") from None
    timed = sorted((fix for fix in found if math.isfinite(fix.at_s)), key=lambda fix: fix.at_s)
    good = [fix for fix in timed if _is_place(fix, left)]
    if len(good) < 2:
        told = f"; {left}" if str(left) else ""
        raise UserError(f"{path} holds {len(good)} fixes with time, latitude and longitude; a track needs two{told}")
    start_s = 0.0 if inside else timed[0].at_s
    return tuple(_moving([fix._replace(at_s=fix.at_s - start_s) for fix in good])), left


def _text(path: Path) -> str:
    content = path.read_bytes()
    return content.decode(encoding_of(content), errors="replace")


def _is_place(fix: Fix, left: Left) -> bool:
    latitude, longitude = fix.latitude_deg, fix.longitude_deg
    if abs(latitude) > 90.0 or abs(longitude) > 180.0:
        left.add("no place on earth (are these degrees?)", f"latitude {latitude:g}, longitude {longitude:g}")
        return False
    if latitude == longitude == 0.0:
        left.add("what a receiver writes that has no fix", "latitude 0, longitude 0")
        return False
    return True


# -- formats -------------------------------------------------------------------------------------------------------------


def _gpx(text: str, left: Left) -> Iterator[Fix]:
    file = gpxpy.parse(re.sub(r"^\s*<\?xml.*?\?>", "", text))
    points = (point for track in file.tracks for part in track.segments for point in part.points)
    number = 0
    for number, point in enumerate(points, 1):
        if point.time is None:
            left.add("it has no time", f"point {number}")
            continue
        told = [
            *(child.text for child in _children(point) if child.tag.rpartition("}")[2] == "speed"),
            str(point.speed),
        ]
        speed = next((value for each in told if (value := _number(each)) is not None), None)
        yield Fix(point.time.timestamp(), point.latitude, point.longitude, speed, point.course)
    if not number:
        for kind, others in (
            ("route point", [each for route in file.routes for each in route.points]),
            ("waypoint", file.waypoints),
        ):
            for each in range(1, len(others) + 1):
                left.add("it is of no track", f"{kind} {each}")


def _children(point: gpxpy.gpx.GPXTrackPoint) -> Iterator[Element]:
    for extension in point.extensions:
        yield from extension.iter()


RECEIVERS_START = 2000
"""A receiver that has no time yet writes an earlier year."""


def _nmea(text: str, left: Left) -> Iterator[Fix]:
    """RMC sentences that the receiver calls valid; sentences of another kind are not missed where there are some."""
    others: list[str] = []
    known = False
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip():
            continue
        try:
            said = pynmea2.parse(line[line.find("$") :] if "$" in line else line)
        except pynmea2.ParseError:
            left.add("no NMEA sentence, or its checksum is wrong", f"line {number}")
            continue
        if not isinstance(said, pynmea2.types.talker.RMC):
            others.append(f"line {number}")
            continue
        known = True
        if said.status != "A" or not said.lat or not said.lon:
            left.add("the receiver had no fix", f"line {number}")
            continue
        day, clock = said.datestamp, said.timestamp  # left as text where they do not parse
        if not isinstance(day, date) or not isinstance(clock, time) or day.year < RECEIVERS_START:
            left.add("it has no date or time", f"line {number}")
            continue
        at = datetime.combine(day, clock.replace(tzinfo=UTC))
        knots, course = _number(said.data[6]), _number(said.data[7])
        speed = knots * SPEED_UNITS["kn"] if knots is not None else None
        yield Fix(at.timestamp(), said.latitude, said.longitude, speed, course)
    for where in others if not known else ():
        left.add("no RMC, which alone tells date, place and speed; have the receiver write RMC", where)


_AND_UNIT = r"[ _]*[(\[]?(?:utc|gmt|(?P<unit>s|sec|seconds|ms|msec|milliseconds?|us|µs|microseconds?|ns))?[)\]]?"
COLUMNS: Mapping[str, str] = {
    "time": rf"(?:gps|unix)?[ _]?(?:time|timestamp|t|seconds|elapsed[a-z _]*?|utc|date.?time|zeit|zeitstempel){_AND_UNIT}",
    "latitude": r"(?:gps[ _]?)?lat|(?:gps[ _]?)?latitude.*|lat[ _]?\(?deg.*|breite(?:ngrad)?.*",
    "longitude": r"(?:gps[ _]?)?(?:lon|lng|long)|(?:gps[ _]?)?longitude.*|lon[ _]?\(?deg.*|l(?:ä|ae)nge(?:ngrad)?.*",
    "course": r"course.*|heading.*|bearing.*|track(?:[ _(\[]*(?:deg|angle|made|true).*)?|kurs.*|richtung.*",
    "date": r"date|datum|utc[ _]?date|gps[ _]?date",
    "north or south": r"n[/_ ]?s.*|lat(?:itude)?[ _]?(?:dir|hemi|ref|n[/_ ]?s).*",
    "east or west": r"e[/_ ]?w.*|lon(?:g|gitude)?[ _]?(?:dir|hemi|ref|e[/_ ]?w).*",
}
BESIDE = re.compile("accuracy|error|limit|sigma|std|genauigkeit")
"""What a column says beside a quantity."""
NEGATIVE = ("s", "w")
TIME_UNITS = {
    **dict.fromkeys(("ms", "msec", "millisecond", "milliseconds"), 1e3),
    **dict.fromkeys(("us", "µs", "microsecond", "microseconds"), 1e6),
    "ns": 1e9,
}


class _OtherTableError(Exception):
    """A table without the columns of a track."""


def _csv(text: str, left: Left) -> Iterator[Fix]:
    """Columns by the names in the first line that is no remark. Raises ValueError naming the column."""
    lines = text.splitlines()
    first = next((at for at, line in enumerate(lines) if line.strip() and not re.match(r"\s*(#|sep=)", line)), 0)
    delimiter = max(",;\t", key=lines[first].count) if lines else ","
    rows = csv.DictReader(lines[first:], delimiter=delimiter)
    names = [name for name in rows.fieldnames or () if name]
    columns = {what: _column(names, pattern) for what, pattern in COLUMNS.items()}
    for place, side in (("latitude", "north or south"), ("longitude", "east or west")):
        if columns[place] == columns[side]:  # `latitude_ref` before `latitude`
            columns[place] = _column([name for name in names if name != columns[side]], COLUMNS[place])
    missing = [what for what in ("time", "latitude", "longitude") if not columns[what]]
    if missing:
        raise _OtherTableError(f"no column {' nor '.join(missing)} among {', '.join(names)}")
    unit = re.fullmatch(COLUMNS["time"], columns["time"].strip().lower())
    speed, factor = _speed_column(names)
    for row in rows:
        where = f"line {first + rows.line_num}"
        said = {what: (row.get(name) or "").strip() for what, name in columns.items()}
        if not any((each or "").strip() for each in row.values() if not isinstance(each, list)):
            continue
        at_s = _time(" ".join(filter(None, (said["date"], said["time"]))), unit["unit"] if unit else "", delimiter)
        if at_s is None:
            left.add("neither seconds nor an ISO 8601 time", f"{where}: time {said['time']!r}")
            continue
        latitude, longitude = (_number(said[what], delimiter) for what in ("latitude", "longitude"))
        if latitude is None or longitude is None:
            where = f"{where}: {columns['latitude']} {said['latitude']!r}, {columns['longitude']} {said['longitude']!r}"
            left.add("no degrees as numbers", where)
            continue
        latitude = -abs(latitude) if said["north or south"].lower().startswith(NEGATIVE) else latitude
        longitude = -abs(longitude) if said["east or west"].lower().startswith(NEGATIVE) else longitude
        told, course = _number(row.get(speed), delimiter), _number(said["course"], delimiter)
        yield Fix(at_s, latitude, longitude, told * factor if told is not None else None, course)


def _column(names: list[str], pattern: str) -> str:
    known = (name for name in names if re.fullmatch(pattern, name.strip().lower()))
    return next((name for name in known if not BESIDE.search(name.lower())), "")


def _speed_column(names: list[str]) -> tuple[str, float]:
    """The column of the speed and what turns it into m/s; none: no name."""
    unknown = ""
    for name in names:
        found = re.match(r"(?:gps|ground)?[ _]?(?:speed|velocity|geschwindigkeit)(?P<unit>.*)", name.strip().lower())
        if found and not BESIDE.search(name.lower()):
            unit = re.sub(r"over[ _]ground|[ _()\[\]]", "", found["unit"])
            if unit in SPEED_UNITS:
                return name, SPEED_UNITS[unit]
            unknown = unknown or name
    if unknown:
        raise ValueError(f"column {unknown!r}: name its unit, as in speed_kmh ({', '.join(SPEED_UNITS)})")
    return "", 1.0


def _number(text: str | None, delimiter: str = "") -> float | None:
    """A finite number; where no comma stands between numbers it may be the decimal one."""
    text = text or "nan"
    try:
        value = float(text.replace(",", ".") if delimiter and delimiter != "," else text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


SINCE_1970 = ((1e17, 1e9), (1e14, 1e6), (1e11, 1e3))
"""Nano-, micro- and milliseconds since 1970 by their magnitude."""


def _time(text: str, unit: str | None, delimiter: str) -> float | None:
    number = _number(text, delimiter)
    if number is not None:
        scale = next((scale for least, scale in SINCE_1970 if number > least), 1.0)
        return number / TIME_UNITS.get(unit or "", scale)
    try:
        at = datetime.fromisoformat(re.sub(r"\s*UTC$", "+00:00", text.strip()))
    except ValueError:
        return None
    return (at if at.tzinfo is not None else at.replace(tzinfo=UTC)).timestamp()


READERS: Mapping[str, Callable[[str, Left], Iterator[Fix]]] = {".gpx": _gpx, ".nmea": _nmea, ".csv": _csv}


# -- motion --------------------------------------------------------------------------------------------------------------


def metres(origin: Fix, fix: Fix) -> tuple[float, float]:
    """East and north of an origin; flat, good for some ten kilometres."""
    degrees = (fix.longitude_deg - origin.longitude_deg + 180.0) % 360.0 - 180.0
    east = math.radians(degrees) * math.cos(math.radians(origin.latitude_deg))
    return EARTH_M * east, EARTH_M * math.radians(fix.latitude_deg - origin.latitude_deg)


def _moving(fixes: list[Fix]) -> Iterator[Fix]:
    """With speed and course from the neighbours where the receiver says none; an impossible speed is unknown."""
    for number, fix in enumerate(fixes):
        before, after = fixes[max(0, number - 1)], fixes[min(len(fixes) - 1, number + 1)]
        (east, north), took_s = metres(before, after), after.at_s - before.at_s
        way_m = math.hypot(east, north)
        derived = way_m / took_s if 0.0 < took_s <= 2 * MOST_GAP_S else None
        speed = fix.speed_mps if fix.speed_mps is not None else derived
        course = fix.course_deg
        if course is None and way_m > SIGMA_M:
            course = math.degrees(math.atan2(east, north)) % 360.0
        yield fix._replace(
            speed_mps=speed if speed is not None and 0.0 <= speed <= MOST_MPS else None, course_deg=course
        )


def track_messages(fixes: tuple[Fix, ...], offset_s: float) -> Iterator[TimedMessage]:
    """Ego speed and position ten times a second; the recording starts `offset_s` after the track's first fix."""
    for before, after in pairwise(fixes):
        gap_s = after.at_s - before.at_s
        steps = max(1, round(gap_s * RATE_HZ)) if _goes_on(before, after) else 1
        for step in range(steps):
            share = step / steps
            at_s = before.at_s + share * gap_s - offset_s
            if at_s >= 0.0:
                yield from _messages(fixes[0], _between(before, after, share), at_s)


def _goes_on(before: Fix, after: Fix) -> bool:
    """Whether the way between two fixes is one that a car drove: no gap, no jump."""
    gap_s, way_m = after.at_s - before.at_s, math.hypot(*metres(before, after))
    return gap_s <= MOST_GAP_S and way_m <= MOST_MPS * gap_s + SIGMA_M


def _between(before: Fix, after: Fix, share: float) -> Fix:
    speed = before.speed_mps
    if speed is not None and after.speed_mps is not None:
        speed += share * (after.speed_mps - speed)
    east_deg = (after.longitude_deg - before.longitude_deg + 180.0) % 360.0 - 180.0
    return before._replace(
        latitude_deg=before.latitude_deg + share * (after.latitude_deg - before.latitude_deg),
        longitude_deg=(before.longitude_deg + share * east_deg + 180.0) % 360.0 - 180.0,
        speed_mps=speed,
    )


def _messages(origin: Fix, fix: Fix, at_s: float) -> Iterator[TimedMessage]:
    x_m, y_m = metres(origin, fix)
    heading = math.radians(90.0 - fix.course_deg) if fix.course_deg is not None else 0.0
    yield TimedMessage(at_s, topics.EGO, Ego(speed_mps=fix.speed_mps))
    yield TimedMessage(
        at_s,
        topics.GNSS,
        GnssFix(
            x_m=x_m, y_m=y_m, heading_rad=heading, sigma_m=SIGMA_M, latitude_deg=fix.latitude_deg, longitude_deg=fix.longitude_deg
        ),
    )  # fmt: skip

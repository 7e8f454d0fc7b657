"""A position track beside a recording (GPX, NMEA 0183, CSV) or inside its video: ego speed and position at the recording's pace."""

import csv
import math
import re
from collections.abc import Callable, Iterator, Mapping
from datetime import UTC, date, datetime, time
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

import gpxpy
import gpxpy.gpx
import pynmea2

from drivemcp.errors import UserError
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


def track_beside(source: Path) -> Path | None:
    """The track of the same name beside a file, else the file itself if it holds one, or the first by name inside a folder.

    A file that is no track is passed over.
    """
    if source.is_dir():
        files = sorted(file for file in source.iterdir() if file.suffix.lower() in READERS)
    else:
        files = [file for suffix in READERS if (file := source.with_suffix(suffix)).is_file()]
        files += [source] if source.suffix.lower() in SUFFIXES else []
    return next((file for file in files if _is_track(file)), None)


def _is_track(file: Path) -> bool:
    try:
        return bool(read_track(file))
    except UserError:
        return False


def read_track(path: Path) -> tuple[Fix, ...]:
    """The fixes of a file in the order of their times, inside a video from its start. Raises UserError naming file and field."""
    inside = path.suffix.lower() in SUFFIXES
    reader = READERS.get(path.suffix.lower())
    if reader is None and not inside:
        raise UserError(
            f"{path}: a position track is one of {', '.join(READERS)}, or a video with positions ({', '.join(SUFFIXES)})"
        )
    try:
        found = (
            [Fix(*row) for row in embedded_rows(path)]
            if reader is None
            else list(reader(path.read_text(encoding="utf-8-sig")))
        )
    except OSError as error:
        raise UserError(f"cannot read {path}: {error.strerror}") from None
    except (gpxpy.gpx.GPXException, csv.Error, ValueError, OverflowError) as error:
        raise UserError(f"{path}: {' '.join(str(error).split())[:200]}") from None
    good = sorted((fix for fix in found if _is_place(fix)), key=lambda fix: fix.at_s)
    if len(good) < 2:
        raise UserError(f"{path} holds {len(good)} fixes with time, latitude and longitude; a track needs two")
    start_s = 0.0 if inside else good[0].at_s
    return tuple(_moving([fix._replace(at_s=fix.at_s - start_s) for fix in good]))


def _is_place(fix: Fix) -> bool:
    return math.isfinite(fix.at_s) and abs(fix.latitude_deg) <= 90.0 and abs(fix.longitude_deg) <= 180.0


# -- formats -------------------------------------------------------------------------------------------------------------


def _gpx(text: str) -> Iterator[Fix]:
    for point in (point for track in gpxpy.parse(text).tracks for part in track.segments for point in part.points):
        if point.time is not None:
            told = [*(child.text for child in _children(point) if child.tag.rpartition("}")[2] == "speed"), point.speed]
            speed = next((float(each) for each in told if each is not None), None)
            yield Fix(point.time.timestamp(), point.latitude, point.longitude, speed, point.course)


def _children(point: gpxpy.gpx.GPXTrackPoint) -> Iterator[Element]:
    for extension in point.extensions:
        yield from extension.iter()


def _nmea(text: str) -> Iterator[Fix]:
    """RMC sentences that the receiver calls valid; a sentence that is broken or of another kind says nothing."""
    for line in text.splitlines():
        try:
            said = pynmea2.parse(line[line.find("$") :] if "$" in line else line)
        except pynmea2.ParseError:
            continue
        if isinstance(said, pynmea2.types.talker.RMC) and said.status == "A" and said.lat and said.lon:
            day, clock = said.datestamp, said.timestamp  # left as text where they do not parse
            if isinstance(day, date) and isinstance(clock, time):
                at = datetime.combine(day, clock.replace(tzinfo=UTC))
                knots, course = _number(said.data[6]), _number(said.data[7])
                speed = knots * SPEED_UNITS["kn"] if knots is not None else None
                yield Fix(at.timestamp(), said.latitude, said.longitude, speed, course)


COLUMNS: Mapping[str, str] = {
    "time": r"time|timestamp|t|seconds|time[ _]?\(?s\)?|elapsed.*|utc|date.?time",
    "latitude": r"lat|latitude.*|lat[ _]?\(?deg.*",
    "longitude": r"lon|lng|long|longitude.*|lon[ _]?\(?deg.*",
    "course": r"course.*|heading.*|bearing.*|track.*",
}


def _csv(text: str) -> Iterator[Fix]:
    """Columns by the names in the first line. Raises ValueError naming the column."""
    lines = text.splitlines()
    rows = csv.DictReader(lines, delimiter=max(",;\t", key=lines[0].count) if lines else ",")
    names = [name for name in rows.fieldnames or () if name]
    columns = {what: _column(names, pattern) for what, pattern in COLUMNS.items()}
    missing = [what for what in ("time", "latitude", "longitude") if not columns[what]]
    if missing:
        raise ValueError(f"no column {' nor '.join(missing)} among {', '.join(names)}")
    speed, factor = _speed_column(names)
    for number, row in enumerate(rows, 2):
        if any(row.get(columns[what]) is None for what in ("time", "latitude", "longitude")):
            continue  # a line that was cut
        at_s, course = _time(row[columns["time"]], number), _number(row.get(columns["course"]))
        latitude, longitude = _number(row[columns["latitude"]]), _number(row[columns["longitude"]])
        told = _number(row.get(speed))
        if latitude is not None and longitude is not None:
            yield Fix(at_s, latitude, longitude, told * factor if told is not None else None, course)


def _column(names: list[str], pattern: str) -> str:
    return next((name for name in names if re.fullmatch(pattern, name.strip().lower())), "")


def _speed_column(names: list[str]) -> tuple[str, float]:
    """The column of the speed and what turns it into m/s; none: no name."""
    for name in names:
        if name.strip().lower().startswith(("speed", "velocity")):
            unit = re.sub(r"speed|velocity|[ _()\[\]]", "", name.strip().lower())
            if unit not in SPEED_UNITS:
                raise ValueError(f"column {name!r}: name its unit, as in speed_kmh ({', '.join(SPEED_UNITS)})")
            return name, SPEED_UNITS[unit]
    return "", 1.0


def _number(text: str | None) -> float | None:
    try:
        value = float(text or "nan")
    except ValueError:
        return None
    return value if math.isfinite(value) else None


SINCE_1970 = ((1e17, 1e9), (1e14, 1e6), (1e11, 1e3))
"""Nano-, micro- and milliseconds since 1970 by their magnitude."""


def _time(text: str, line: int) -> float:
    number = _number(text)
    if number is not None:
        return number / next((scale for least, scale in SINCE_1970 if number > least), 1.0)
    try:
        at = datetime.fromisoformat(text.strip())
    except ValueError:
        raise ValueError(f"line {line}: time {text!r} is neither seconds nor an ISO 8601 time") from None
    return (at if at.tzinfo is not None else at.replace(tzinfo=UTC)).timestamp()


READERS: Mapping[str, Callable[[str], Iterator[Fix]]] = {".gpx": _gpx, ".nmea": _nmea, ".csv": _csv}


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

"""Tracks in GPX, read by gpxpy."""

import re
from collections.abc import Iterator
from xml.etree.ElementTree import Element

import gpxpy
import gpxpy.gpx

from services.player.can_log import SPEED_UNITS
from services.player.tracks.fix import Fix, Left, number

_UNIT = re.compile(r"""<(?:\w+:)?speed\s+unit=["']([^"']*)""", re.I)
_BESIDE = re.compile(r"<(?:speed|course)\b", re.I)
_COMMA = re.compile(r"(<(?:\w+:)?(?:(?:speed|course)\b[^>]*>\s*-?\d+|time>[^<,]+)),(?=\d)", re.I)
"""A decimal comma, which gpxpy takes for damage or for no time."""
_ROOT = re.compile(r"<((?:\w+:)?)(\w+)")
Point = gpxpy.gpx.GPXTrackPoint


def fixes(text: str, left: Left) -> Iterator[Fix]:
    """The points of all tracks that have a time. Of two tracks at one time the first counts. Raises gpxpy.gpx.GPXException, or
    ValueError for another kind of XML.
    """
    root = _ROOT.search(text)
    if root and root[2] != "gpx":
        raise ValueError(
            f"it begins with <{root[1]}{root[2]}> and is no GPX; GPSBabel turns other kinds, as .kml and .tcx, into .gpx"
        )
    if root and root[1]:  # gpxpy knows the names without a prefix alone
        text = re.sub(rf"(</?){root[1]}", r"\1", text).replace(f"xmlns:{root[1][:-1]}=", "xmlns=")
    text = _COMMA.sub(r"\1.", re.sub(r"^\s*<\?xml.*?\?>", "", text))
    file = gpxpy.parse(text)
    motion = _Motion(file, text, left)
    taken: list[tuple[float, float]] = []
    told = 0
    for which, track in enumerate(file.tracks, 1):
        points = [(told := told + 1, point) for part in track.segments for point in part.points]
        timed = [(count, point) for count, point in points if point.time is not None]
        for count, point in points:
            if point.time is None:
                left.add("it has no time", f"point {count}")
        stamps = [point.time.timestamp() for _, point in timed if point.time is not None]
        if stamps and any(min(stamps) < end and start < max(stamps) for start, end in taken):
            left.add("it runs at the same time as another; keep one", f"track {which}")
            continue
        if stamps:
            taken.append((min(stamps), max(stamps)))
        zoned = all(point.time is not None and point.time.tzinfo is not None for _, point in timed)
        for at_s, (count, point) in zip(stamps, timed, strict=True):
            yield Fix(at_s, point.latitude, point.longitude, *motion.of(count - 1, point), at_s if zoned else None)
    if not told:
        for kind, others in (
            ("route point", [each for route in file.routes for each in route.points]),
            ("waypoint", file.waypoints),
        ):
            for each in range(1, len(others) + 1):
                left.add("it is of no track; record or export the track itself", f"{kind} {each}")


class _Motion:
    """Speed and course of points. Version 1.1 has both in extensions, but some programs write them beside the place, as 1.0 does."""

    def __init__(self, file: gpxpy.gpx.GPX, text: str, left: Left) -> None:
        reads_all = file.version == "1.0" or not _BESIDE.search(text)
        old = file if reads_all else gpxpy.parse(text, version="1.0")
        self._old = [point for track in old.tracks for part in track.segments for point in part.points]
        units = {each.lower() for each in _UNIT.findall(text)}
        self._factor = SPEED_UNITS.get(units.pop(), 0.0) if len(units) == 1 else 0.0 if units else 1.0
        if not self._factor:
            left.add(f"its speeds are in none of {', '.join(SPEED_UNITS)}; they are taken from the places", "unit")

    def of(self, at: int, point: Point) -> tuple[float | None, float | None]:
        """m/s and degrees clockwise from north of the point at a place in the file; None: not said."""
        beside = self._old[at] if at < len(self._old) else point
        speed, course = _first(point, "speed", beside.speed), _first(point, "course", beside.course)
        return speed * self._factor if speed is not None and self._factor else None, course


def _first(point: Point, name: str, beside: float | None) -> float | None:
    said = [*(child.text for child in _children(point) if child.tag.rpartition("}")[2] == name), str(beside)]
    return next((value for each in said if (value := number(each)) is not None), None)


def _children(point: Point) -> Iterator[Element]:
    for extension in point.extensions:
        yield from extension.iter()

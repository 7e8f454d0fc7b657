"""Tracks in GPX, read by gpxpy."""

import re
from collections.abc import Iterator
from xml.etree.ElementTree import Element

import gpxpy
import gpxpy.gpx

from services.player.tracks.fix import Fix, Left, number

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
    file = gpxpy.parse(re.sub(r"^\s*<\?xml.*?\?>", "", text))
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
        for at_s, (_, point) in zip(stamps, timed, strict=True):
            yield Fix(at_s, point.latitude, point.longitude, _speed(point), point.course, at_s if zoned else None)
    if not told:
        for kind, others in (
            ("route point", [each for route in file.routes for each in route.points]),
            ("waypoint", file.waypoints),
        ):
            for each in range(1, len(others) + 1):
                left.add("it is of no track; record or export the track itself", f"{kind} {each}")


def _speed(point: Point) -> float | None:
    said = [*(child.text for child in _children(point) if child.tag.rpartition("}")[2] == "speed"), str(point.speed)]
    return next((value for each in said if (value := number(each)) is not None), None)


def _children(point: Point) -> Iterator[Element]:
    for extension in point.extensions:
        yield from extension.iter()

"""A position track beside a recording (GPX, NMEA 0183, CSV, VBO) or inside its video: ego speed and position at the recording's pace."""

import contextlib
import csv
import math
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from itertools import groupby, pairwise
from pathlib import Path
from statistics import median

import gpxpy.gpx

from drivemcp.errors import UserError
from drivemcp.files.encodings import encoding_of
from drivemcp.files.folders import files_beside
from drivemcp.files.time_of_day import DAY_S
from proto import topics
from proto.sensors import GnssFix
from proto.vehicle import Ego
from services.player.embedded_track import SUFFIXES, embedded_rows
from services.player.recording import TimedMessage
from services.player.tracks import gpx, nmea, table, vbo
from services.player.tracks.fix import Fix, Left, heading_deg

RATE_HZ = 10.0
MOST_GAP_S = 5.0
"""Between fixes farther apart nothing is interpolated: speed and position are unknown there."""
SIGMA_M = 5.0
"""Of a phone's or a dashcam's receiver under open sky."""
EARTH_M = 6_371_000.0
FEW = 0.1
"""Fixes with a time of their own, as a share of the most with one."""
ALONE_S = 600.0
"""A fix farther from all others is the last place that a phone remembered, or one with the old date at midnight."""
EPOCH_S = 366 * DAY_S
"""Fixes so far apart in time are of no one drive: receivers count weeks from 0 after 1024."""
HELD_S = 2.5
"""So long a slow receiver's place may be written again in rows that come faster."""
SURE_MPS = 5.0
"""From this speed on two places show it in spite of their errors."""
FEWEST_COMPARED = 5
CONTRADICTS = 1.7
"""Times too fast or too slow: knots are 1.94, miles an hour 2.24, and km/h 3.6 times m/s."""
MOST_MPS = 100.0
"""A faster fix is a receiver's jump."""


class NoTrackError(UserError):
    """A table of something else."""


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
        raise UserError(f"{path}: {_what_to_do(path)}")
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
    except table.OtherTableError as error:
        raise NoTrackError(f"{path}: {error}") from None
    found = [fix._replace(course_deg=heading_deg(fix.course_deg)) for fix in found if math.isfinite(fix.at_s)]
    timed = sorted(_on_one_clock(found, left), key=lambda fix: fix.at_s)
    timed = _not_alone(_spread(timed), left)
    good = _without_jumps([fix for fix in timed if _is_place(fix, left)], left)
    if len(good) < 2:
        told = f"; {left}" if str(left) else ""
        raise UserError(f"{path} holds {len(good)} fixes with time, latitude and longitude; a track needs two{told}")
    start_s = 0.0 if inside else timed[0].at_s
    return tuple(_moving(_of_one_unit([fix._replace(at_s=fix.at_s - start_s) for fix in good], left))), left


def _what_to_do(path: Path) -> str:
    """With a file of another ending."""
    with contextlib.suppress(OSError), path.open("rb") as file:
        if file.read(2) in (b"$G", b"!A"):
            return f"its lines are sentences of NMEA 0183: rename it to {path.stem}.nmea"
    return (
        f"a position track is one of {', '.join(READERS)}, or a video with positions ({', '.join(SUFFIXES)}); "
        "GPSBabel turns other kinds, as .kml, .fit and .tcx, into .gpx"
    )


def _text(path: Path) -> str:
    content = path.read_bytes()
    return content.decode(encoding_of(content), errors="replace")


def _on_one_clock(found: list[Fix], left: Left) -> list[Fix]:
    """Without the few fixes whose time lies days from those beside them: the receiver did not know it yet, or lost it."""
    runs: list[list[Fix]] = []
    for fix in found:
        near = next((run for run in runs if abs(fix.at_s - run[-1].at_s) <= DAY_S), None)
        if near is None:
            runs.append([fix])
        else:
            near.append(fix)
    longest = max(runs, key=len, default=[])
    kept: list[Fix] = []
    for run in runs:
        few = len(run) < max(2, FEW * len(longest)) and len(run) < len(longest)
        if few or (run is not longest and abs(run[0].at_s - longest[0].at_s) > EPOCH_S):
            for fix in run:
                left.add(
                    "its time lies days from that of the others",
                    f"latitude {fix.latitude_deg:g}, longitude {fix.longitude_deg:g}",
                )
        else:
            kept += run
    return kept


def _spread(timed: list[Fix]) -> list[Fix]:
    """With the fixes of one second spread over it, where most seconds have several: their clock shows whole seconds."""
    seconds = [list(each) for _, each in groupby(timed, key=lambda fix: fix.at_s)]
    several = [each for each in seconds if len({fix[1:3] for fix in each}) > 1]
    if len(several) <= len(seconds) / 2:
        return timed
    starts_s = [each[0].at_s for each in seconds]
    lasts_s = [after - before for before, after in pairwise(starts_s)]
    lasts_s.append(min(lasts_s, default=1.0))
    return [
        fix._replace(at_s=fix.at_s + at / len(each) * min(last_s, 1.0))
        for each, last_s in zip(seconds, lasts_s, strict=True)
        for at, fix in enumerate(each)
    ]


def _not_alone(timed: list[Fix], left: Left) -> list[Fix]:
    """Without a fix that no other is near in time."""
    kept = list[Fix]()
    for number, fix in enumerate(timed):
        beside = timed[max(0, number - 1) : number] + timed[number + 1 : number + 2]
        if len(timed) > 2 and all(abs(fix.at_s - each.at_s) > ALONE_S for each in beside):
            left.add(
                "no other fix is near it in time", f"latitude {fix.latitude_deg:g}, longitude {fix.longitude_deg:g}"
            )
        else:
            kept.append(fix)
    return kept


def _without_jumps(good: list[Fix], left: Left) -> list[Fix]:
    """Without a fix that no car reaches from the fixes on both sides, which it reaches from one another."""
    kept = list[Fix]()
    for number, fix in enumerate(good):
        if 0 < number < len(good) - 1:
            before, after = good[number - 1], good[number + 1]
            if not _reached(before, fix) and not _reached(fix, after) and _reached(before, after):
                left.add(
                    "a receiver's jump; no car is so fast",
                    f"latitude {fix.latitude_deg:g}, longitude {fix.longitude_deg:g}",
                )
                continue
        kept.append(fix)
    return kept


def _is_place(fix: Fix, left: Left) -> bool:
    latitude, longitude = fix.latitude_deg, fix.longitude_deg
    if abs(latitude) > 90.0 or abs(longitude) > 180.0:
        left.add("no place on earth (are these degrees?)", f"latitude {latitude:g}, longitude {longitude:g}")
        return False
    if latitude == longitude == 0.0:
        left.add("what a receiver writes that has no fix", "latitude 0, longitude 0")
        return False
    return True


READERS: Mapping[str, Callable[[str, Left], Iterator[Fix]]] = {
    ".gpx": gpx.fixes, ".nmea": nmea.fixes, ".csv": table.fixes, ".vbo": vbo.fixes,
}  # fmt: skip


# -- motion --------------------------------------------------------------------------------------------------------------


def metres(origin: Fix, fix: Fix) -> tuple[float, float]:
    """East and north of an origin; flat, good for some ten kilometres."""
    degrees = (fix.longitude_deg - origin.longitude_deg + 180.0) % 360.0 - 180.0
    east = math.radians(degrees) * math.cos(math.radians(origin.latitude_deg))
    return EARTH_M * east, EARTH_M * math.radians(fix.latitude_deg - origin.latitude_deg)


def _of_one_unit(fixes: list[Fix], left: Left) -> list[Fix]:
    """Without the speeds, where the places show them to be in another unit than the file says or its format has."""
    shares = [
        fix.speed_mps / derived
        for number, fix in enumerate(fixes)
        if fix.speed_mps is not None
        and fix.speed_mps >= 0.0
        and (derived := _derived(*_neighbours(fixes, number)) or 0.0) >= SURE_MPS
    ]
    share = median(shares) if len(shares) >= FEWEST_COMPARED else 1.0
    if 1.0 / CONTRADICTS < share < CONTRADICTS:
        return fixes
    left.add(f"its speeds are {share:.3g} times those from place to place (km/h for m/s?); the places count", "speed")
    return [fix._replace(speed_mps=None) for fix in fixes]


def _derived(before: Fix, after: Fix) -> float | None:
    """m/s from one fix to another; None where they are too far apart in time."""
    took_s = after.at_s - before.at_s
    return math.hypot(*metres(before, after)) / took_s if 0.0 < took_s <= 2 * MOST_GAP_S else None


def _moving(fixes: list[Fix]) -> Iterator[Fix]:
    """With speed and course from the neighbours where the receiver says none; an impossible speed is unknown."""
    for number, fix in enumerate(fixes):
        before, after = _neighbours(fixes, number)
        east, north = metres(before, after)
        way_m, derived = math.hypot(east, north), _derived(before, after)
        speed = fix.speed_mps if fix.speed_mps is not None else derived
        course = fix.course_deg
        if course is None and way_m > SIGMA_M:
            course = math.degrees(math.atan2(east, north)) % 360.0
        yield fix._replace(
            speed_mps=speed if speed is not None and 0.0 <= speed <= MOST_MPS else None, course_deg=course
        )


def _neighbours(fixes: list[Fix], number: int) -> tuple[Fix, Fix]:
    """The fixes beside one; where a slow receiver's place stands in several rows, the first row of this place and of the next."""
    here = fixes[number]
    before, after = fixes[max(0, number - 1)], fixes[min(len(fixes) - 1, number + 1)]
    if here[1:3] not in (before[1:3], after[1:3]) or len(fixes) < 3:
        return before, after
    first, following = _first_row(fixes, number), number
    while (
        following < len(fixes) - 1
        and fixes[following][1:3] == here[1:3]
        and fixes[following].at_s - here.at_s <= HELD_S
    ):
        following += 1
    if fixes[following][1:3] == here[1:3] and first > 0:  # the last place: as fast as to it, for as long as that took
        earlier = _first_row(fixes, first - 1)
        if here.at_s - fixes[first].at_s >= fixes[first].at_s - fixes[earlier].at_s:
            return before, after
        first, following = earlier, first
    if fixes[following].at_s - fixes[first].at_s > HELD_S:
        return before, after
    return fixes[first], fixes[following]


def _first_row(fixes: list[Fix], number: int) -> int:
    """Where the place of a row began to stand, as far back as a slow receiver holds it: a car may stand for hours."""
    first = number
    while (
        first > 0 and fixes[first - 1][1:3] == fixes[number][1:3] and fixes[number].at_s - fixes[first].at_s <= HELD_S
    ):
        first -= 1
    return first


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
    return after.at_s - before.at_s <= MOST_GAP_S and _reached(before, after)


def _reached(before: Fix, after: Fix) -> bool:
    """Whether a car may have driven from one fix to the other."""
    return math.hypot(*metres(before, after)) <= MOST_MPS * (after.at_s - before.at_s) + SIGMA_M


def _between(before: Fix, after: Fix, share: float) -> Fix:
    speed = before.speed_mps
    if speed is not None and after.speed_mps is not None:
        speed += share * (after.speed_mps - speed)
    east_deg = (after.longitude_deg - before.longitude_deg + 180.0) % 360.0 - 180.0
    return before._replace(
        latitude_deg=before.latitude_deg + share * (after.latitude_deg - before.latitude_deg),
        longitude_deg=(before.longitude_deg + share * east_deg + 180.0) % 360.0 - 180.0,
        speed_mps=speed,
        utc_s=before.utc_s + share * (after.at_s - before.at_s) if before.utc_s is not None else None,
    )


def _messages(origin: Fix, fix: Fix, at_s: float) -> Iterator[TimedMessage]:
    x_m, y_m = metres(origin, fix)
    heading = math.radians(90.0 - fix.course_deg) if fix.course_deg is not None else 0.0
    yield TimedMessage(at_s, topics.EGO, Ego(speed_mps=fix.speed_mps))
    yield TimedMessage(
        at_s,
        topics.GNSS,
        GnssFix(
            x_m=x_m, y_m=y_m, heading_rad=heading, sigma_m=SIGMA_M,
            latitude_deg=fix.latitude_deg, longitude_deg=fix.longitude_deg, utc_s=fix.utc_s,
        ),
    )  # fmt: skip

"""Tracks in NMEA 0183, read by pynmea2."""

from collections.abc import Iterator
from datetime import UTC, date, datetime, time
from typing import Any

import pynmea2

from domain.units import MPS_PER_KNOT
from drivemcp.files.time_of_day import Clock
from services.player.tracks.fix import Fix, Left, number

RECEIVERS_START = 2000
"""A receiver that has no time yet writes an earlier year."""
POSITIONS = ("GGA", "GNS", "GLL")
"""Without RMC the first of these kinds that a file has: they tell time of day and place."""
NO_FIX = ("", "0", "N", "V", "NN", "NNN", "NNNN")


def fixes(text: str, left: Left) -> Iterator[Fix]:
    """RMC sentences that the receiver calls valid; without any, positions with a time of day."""
    said = list(_sentences(text, left))
    own = [where for where, each in said if not isinstance(each, pynmea2.TalkerSentence)]
    said = [(where, each) for where, each in said if isinstance(each, pynmea2.TalkerSentence)]
    moving = [(where, each) for where, each in said if each.sentence_type == "RMC"]
    if moving:
        yield from _moving(moving, left)
        return
    kind = next((kind for kind in POSITIONS if any(each.sentence_type == kind for _, each in said)), "")
    if kind:
        yield from _standing([(where, each) for where, each in said if each.sentence_type == kind], left)
        return
    for where, _ in said:
        left.add("no RMC, GGA, GNS or GLL, which tell time and place; have the receiver write RMC", where)
    for where in own:
        left.add("of the receiver's maker alone; have it write RMC", where)


def _sentences(text: str, left: Left) -> Iterator[tuple[str, Any]]:
    """Each sentence of a receiver with its line."""
    for count, line in enumerate(text.splitlines(), 1):
        if not line.strip():
            continue
        try:
            said = pynmea2.parse(line[line.find("$") :] if "$" in line else line)
        except (pynmea2.ParseError, ValueError):
            left.add("no NMEA sentence, or its checksum is wrong", f"line {count}")
            continue
        yield f"line {count}", said


def _moving(said: list[tuple[str, Any]], left: Left) -> Iterator[Fix]:
    """By date and time; by the time of day over midnight where no sentence has a date."""
    dated, clock = any(_has_date(each) for _, each in said), Clock()
    for where, each in said:
        place = _place(each) if each.status == "A" else None
        if place is None:
            left.add("the receiver had no fix", where)
            continue
        of_day = each.timestamp  # left as text where it does not parse
        if not isinstance(of_day, time) or (dated and not _has_date(each)):
            left.add("it has no date or time", where)
            continue
        at_s = (
            datetime.combine(each.datestamp, of_day.replace(tzinfo=UTC)).timestamp()
            if dated
            else clock.after(_second(of_day))
        )
        knots = number(each.data[6])
        speed_mps = knots * MPS_PER_KNOT if knots is not None else None
        yield Fix(at_s, *place, speed_mps, number(each.data[7]), at_s if dated else None)


def _has_date(said: Any) -> bool:
    return isinstance(said.datestamp, date) and said.datestamp.year >= RECEIVERS_START


def _second(of_day: time) -> float:
    return of_day.hour * 3600 + of_day.minute * 60 + of_day.second + of_day.microsecond / 1e6


def _standing(said: list[tuple[str, Any]], left: Left) -> Iterator[Fix]:
    """By the time of day, over midnight."""
    clock = Clock()
    for where, each in said:
        quality = next(
            (getattr(each, name) for name in ("gps_qual", "mode_indicator", "status") if hasattr(each, name)), ""
        )
        place = _place(each) if str(quality or "") not in NO_FIX else None
        if place is None:
            left.add("the receiver had no fix", where)
        elif not isinstance(each.timestamp, time):
            left.add("it has no date or time", where)
        else:
            yield Fix(clock.after(_second(each.timestamp)), *place)


def _place(said: Any) -> tuple[float, float] | None:
    """Latitude and longitude in degrees; None where the sentence has none that can be read."""
    try:
        sided = said.lat_dir in ("N", "S") and said.lon_dir in ("E", "W")  # without a side pynmea2 gives 0
        return (said.latitude, said.longitude) if said.lat and said.lon and sided else None
    except (ValueError, TypeError, IndexError):
        return None

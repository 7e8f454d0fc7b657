"""Tracks of data loggers in Racelogic's VBO: sections of text, places in minutes, west positive."""

import re
from collections.abc import Iterator, Mapping

from drivemcp.files.time_of_day import Clock, second_of_digits
from services.player.can_log import SPEED_UNITS
from services.player.tracks.fix import Fix, Left, number

NAMES, ROWS = "column names", "data"
MOST_LATITUDE_MIN, MOST_LONGITUDE_MIN = 90.0 * 60.0, 180.0 * 60.0
SPEED = re.compile(r"(velocity|speed)(?:[-_ ]*[(\[]?([a-z/]+)[)\]]?)?")
LOGGED_IN = "km/h"
"""The speed's unit where the header names none."""


def fixes(text: str, left: Left) -> Iterator[Fix]:
    """The rows of the section `[data]` by its `[column names]`. Raises ValueError naming what is missing."""
    sections = _sections(text)
    names = " ".join(line for _, line in sections.get(NAMES, ())).lower().split()
    missing = [name for name in ("time", "lat", "long") if name not in names]
    if missing or ROWS not in sections:
        raise ValueError(
            f"no {', '.join(missing) or '[data]'} under [column names], as a VBO file has: export it again"
        )
    speed = next((name for name in names if SPEED.fullmatch(name)), "")
    factor, clock = _mps_per_unit(speed, [line for _, line in sections.get("header", ())]), Clock()
    for count, line in sections[ROWS]:
        row = dict(zip(names, line.split(), strict=False))
        second = second_of_digits(row.get("time", ""))
        latitude, longitude = number(row.get("lat")), number(row.get("long"))
        if second is None or latitude is None or longitude is None:
            left.add("no time of day and place in minutes", f"line {count}")
        elif abs(latitude) > MOST_LATITUDE_MIN or abs(longitude) > MOST_LONGITUDE_MIN:
            left.add("no place in minutes", f"line {count}")
        elif number(row.get("sats")) == 0.0:
            left.add("the receiver had no fix", f"line {count}")
        else:
            value = number(row.get(speed))
            mps = value * factor if value is not None else None
            yield Fix(clock.after(second), latitude / 60.0, -longitude / 60.0, mps, number(row.get("heading")))


def _sections(text: str) -> Mapping[str, list[tuple[int, str]]]:
    """Name -> its lines that are not empty, each with its number in the file."""
    found, name = dict[str, list[tuple[int, str]]](), ""
    for count, line in enumerate(text.splitlines(), 1):
        if heads := re.fullmatch(r"\[(.+)\]\s*", line):
            name = heads[1].strip().lower()
            found.setdefault(name, [])
        elif line.strip():
            found.setdefault(name, []).append((count, line.strip()))
    return found


def _mps_per_unit(column: str, header: list[str]) -> float:
    """By the unit in the column's name or beside the speed's name in the header. Raises ValueError for an unknown one."""
    told = (SPEED.fullmatch(name.lower()) for name in (column, *header))
    unit = next((found[2] for found in told if found and found[2]), LOGGED_IN)
    if unit not in SPEED_UNITS:
        raise ValueError(f"[header] has the speed in {unit!r}: one of {', '.join(SPEED_UNITS)} can be read")
    return SPEED_UNITS[unit]

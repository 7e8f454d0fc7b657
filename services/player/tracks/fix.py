"""One fix of a position track, and what of a track was not read."""

import math
from typing import NamedTuple


class Fix(NamedTuple):
    """One fix: seconds since the track's first, degrees (WGS 84), and what the receiver says of the motion."""

    at_s: float
    latitude_deg: float
    longitude_deg: float
    speed_mps: float | None = None
    course_deg: float | None = None
    """Clockwise from north."""
    utc_s: float | None = None
    """Since 1970; None: the file tells no date, or a time that may be local."""


def heading_deg(value: float | None) -> float | None:
    """A course that is one; None for the codes of receivers that know none (-1, 511)."""
    return value if value is not None and value != -1.0 and -180.0 <= value <= 360.0 else None


class Left:
    """What of a file was not read: by kind how often, and the first of it."""

    def __init__(self) -> None:
        self._kinds: dict[str, list[str]] = {}

    def add(self, kind: str, where: str) -> None:
        """Count one more."""
        self._kinds.setdefault(kind, []).append(where)

    def __str__(self) -> str:
        return "; ".join(f"{len(found)} not read, first {found[0]}: {kind}" for kind, found in self._kinds.items())


def number(text: str | None, delimiter: str = "") -> float | None:
    """A finite number; where no comma stands between numbers it may be the decimal one."""
    text = text or "nan"
    try:
        value = float(text.replace(",", ".") if delimiter and delimiter != "," else text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None

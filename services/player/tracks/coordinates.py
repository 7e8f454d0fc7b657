"""Latitudes and longitudes as people and receivers write them: degrees, degrees and minutes, degrees, minutes and seconds."""

import re
from collections.abc import Sequence

from services.player.tracks.fix import number

_PART = r"(\d+(?:[.,]\d+)?)"
_NEXT = rf"(?<=[^\d.,]){_PART}\s*"
_WRITTEN = re.compile(
    rf"([NSEW])?\s*([-+−])?\s*{_PART}\s*(?:[°º˚d:]|deg)?\s*"
    rf"(?:{_NEXT}(?:['′’m:]|min)?\s*)?(?:{_NEXT}(?:[\"″”]|''|′′|sec)?\s*)?([NSEW])?"
)
"""Letters in capitals alone: an `s` may be seconds or south, and `O` is east in German and west in French."""
AXES = {"latitude": "NS", "longitude": "EW"}


def degrees(text: str, axis: str) -> float | None:
    """The angle in degrees that a text gives for an `axis` (latitude, longitude); None without an angle, or with one of the other axis."""
    power = re.fullmatch(r"[+-]?\d+,\d+E[+-]?\d+", text.strip(), re.I)
    if (value := number(text, ";" if power else "")) is not None:
        return value
    found = _WRITTEN.fullmatch(text.strip())
    if found is None:
        return None
    before, sign, *parts, after = found.groups()
    letter = before or after or ""
    if (before and after) or letter not in AXES[axis]:
        return None
    values = [float(part.replace(",", ".")) for part in parts if part]
    whole = all(each.is_integer() for each in values[:-1])
    if not whole or any(each >= 60.0 for each in values[1:]):
        return None
    value = sum(each / 60.0**power for power, each in enumerate(values))
    negative = letter in ("S", "W") or sign in ("-", "−")
    return -value if negative else value


def in_minutes(places: Sequence[tuple[float, float]]) -> bool:
    """Whether (latitude, longitude) is written as a receiver's sentences do: 4830.5 for 48 degrees and 30.5 minutes.

    No pair may be in degrees, and each must be a place in minutes.
    """
    return bool(places) and all(
        (abs(latitude) > 90.0 or abs(longitude) > 180.0)
        and all(
            abs(each) % 100.0 < 60.0 and abs(each) // 100.0 <= most
            for each, most in ((latitude, 90.0), (longitude, 180.0))
        )
        for latitude, longitude in places
    )


def of_minutes(value: float) -> float:
    """4830.5 in degrees."""
    whole, minutes = divmod(abs(value), 100.0)
    return (whole + minutes / 60.0) * (1.0 if value >= 0.0 else -1.0)

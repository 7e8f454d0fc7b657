"""The numbers on plates, in a closed grammar: hours of the day, distances and lengths; any other text gives no number.

What is read here is read out of letters that a machine guessed from a picture: a text is taken whole and in one of these
forms, with numbers that plates show, or the plate stays unread.
"""

import re
from collections.abc import Callable, Mapping
from types import MappingProxyType

HOURS, DISTANCE, LENGTH = "plate:time", "plate:distance", "plate:length"
MOST_CHARS = 24
_DASHES = {ord("–"): "-", ord("—"): "-"}
_HOUR = r"([0-9]{1,2})(?:[:.]00)?"
_SPAN = re.compile(rf"{_HOUR} ?(?:h|uhr|u|uur)? ?- ?{_HOUR} ?(h|uhr|u|uur)\.?", re.IGNORECASE | re.ASCII)
_CLOCK = re.compile(r"([0-9]{1,2})[:.]00 ?- ?([0-9]{1,2})[:.]00", re.ASCII)
_ENGLISH = re.compile(r"([0-9]{1,2}) ?(am|pm) ?(?:-|to) ?([0-9]{1,2}) ?(am|pm)", re.IGNORECASE | re.ASCII)
_WAY = re.compile(
    r"(?:in )?([0-9]{1,4}|[0-9]{1,2}[.,][0-9]|[13]/[24]) ?(m|km|yds?|yards|miles?|ft|feet)", re.IGNORECASE | re.ASCII
)
_UNITS = {"yd": "yds", "yards": "yds", "mile": "miles", "feet": "ft"}
_STEPS: Mapping[str, tuple[int, int, int]] = MappingProxyType(
    {"m": (10, 2000, 10), "km": (1, 9, 1), "yds": (10, 900, 10), "miles": (1, 9, 1), "ft": (100, 2500, 50)}
)
"""Unit to the least and the greatest number taken, and the step between them. No two digits of kilometres and miles: a lost
comma or stroke would make 13 of 1,3 and 12 of 1/2."""
_PARTS = ("1/4", "1/2", "3/4")


def number_of(plate: str, text: str) -> str:
    """What the text of a plate says: `22-6 h`, `200 m`, `1.5 km`, `1/2 miles`. Empty unless all of it is of a known form."""
    said = " ".join(text.translate(_DASHES).split())
    if not said.isascii() or len(said) > MOST_CHARS or plate not in _FORMS:
        return ""
    return _FORMS[plate](said)


def _hours(said: str) -> str:
    if match := _SPAN.fullmatch(said) or _CLOCK.fullmatch(said):
        return _span(int(match[1]), int(match[2]))
    if match := _ENGLISH.fullmatch(said):
        begin, end = _on_24(int(match[1]), match[2]), _on_24(int(match[3]), match[4])
        return _span(begin, end) if begin is not None and end is not None else ""
    return ""


def _span(begin: int, end: int) -> str:
    return f"{begin}-{end} h" if max(begin, end) <= 24 and begin % 24 != end % 24 else ""


def _on_24(hour: int, half: str) -> int | None:
    return hour % 12 + (12 if half.lower() == "pm" else 0) if 1 <= hour <= 12 else None


def _way(said: str) -> str:
    match = _WAY.fullmatch(said)
    if match is None:
        return ""
    number, unit = match[1].replace(",", "."), _UNITS.get(match[2].lower(), match[2].lower())
    return f"{number} {unit}" if _shown(number, unit) else ""


def _shown(number: str, unit: str) -> bool:
    """Whether a plate shows such a number of such a unit."""
    if "/" in number:
        return unit == "miles" and number in _PARTS
    if "." in number:
        return unit == "km" and number[0] != "0"
    least, most, step = _STEPS[unit]
    return number[0] != "0" and least <= int(number) <= most and int(number) % step == 0


_FORMS: Mapping[str, Callable[[str], str]] = MappingProxyType({HOURS: _hours, DISTANCE: _way, LENGTH: _way})
PLATES_WITH_NUMBERS = frozenset(_FORMS)
"""Classes of plates that may be read further."""

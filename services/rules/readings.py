"""Sign codes of the readers (`limit:50`, `plate:when_wet:de`, `led:60`) taken apart."""

import math
import re

import msgspec

_NUMBER = re.compile(r"[0-9]{1,3}(?:\.[0-9])?")
_HOURS = re.compile(r"([0-9]{1,2})(?::[0-9]{2})?\s*-\s*([0-9]{1,2})(?::[0-9]{2})?(?:\s*h)?")
_ALIASES = {"end": "limit_end", "limit-end": "limit_end", "give_way": "yield", "priority": "priority_road"}
MAX_LENGTH = 64
"""Longer texts are no codes of ours."""


class Reading(msgspec.Struct, frozen=True):
    """A code, and the number or word behind its colon."""

    code: str
    value: float | None = None
    word: str = ""

    @property
    def names(self) -> tuple[str, ...]:
        """Codes under which the sign table may know it, the most specific first."""
        return (f"{self.code}:{self.word}", self.code) if self.word else (self.code,)


def parse_reading(text: str) -> Reading:
    """`limit:50` → code `limit`, value 50; `plate:when_wet:de` → code `plate:when_wet`, word `de`. Never raises.

    Codes and numbers are plain ASCII; what only looks like one (other scripts' letters and digits) is none.
    """
    if not text.isascii():
        return Reading("")
    parts = [part.strip() for part in text.strip()[:MAX_LENGTH].split(":")]
    head = _ALIASES.get(parts[0].lower(), parts[0].lower())
    if head == "plate" and len(parts) > 1:
        return Reading(f"plate:{parts[1].lower()}", None, ":".join(parts[2:]))
    rest = ":".join(parts[1:])
    if _NUMBER.fullmatch(rest):
        return Reading(head, float(rest))
    return Reading(head, None, rest)


def hours_of(text: str) -> tuple[float, float] | None:
    """The times on a plate: `22-6 h` → (22, 6); None where there are none."""
    match = _HOURS.search(text)
    if not match or int(match[1]) > 24 or int(match[2]) > 24:
        return None
    return float(match[1]), float(match[2])


def within_hours(hours: tuple[float, float], time_of_day_h: float) -> bool:
    """Whether a time of day lies in a span that may run over midnight. No number counts as within."""
    begin, end = hours
    if not math.isfinite(time_of_day_h):
        return True
    return begin <= time_of_day_h < end if begin <= end else time_of_day_h >= begin or time_of_day_h < end

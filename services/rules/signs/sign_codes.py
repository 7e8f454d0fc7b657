"""Sign codes of the readers (`limit:50`, `plate:when_wet:de`, `led:60`) taken apart."""

import math
import re

import msgspec

_NUMBER = re.compile(r"[0-9]{1,3}(?:\.[0-9])?")
_CLOCK = r"([0-9]{1,2})(?:[:.]([0-9]{2}))?\s*(am|pm|a\.m\.|p\.m\.)?\s*(?:h|hrs|uhr)?"
_SPAN = re.compile(rf"{_CLOCK}\s*(?:-|to|bis)\s*{_CLOCK}", re.I)
_BETWEEN = re.compile(r"\s*(?:[,;&+/]|and|und|et|en|i)?\s*", re.I)
_PLATE = re.compile(r"\s*(?:plate:)?(?:time)?\s*:?\s*", re.I)
_ALIASES = {"end": "limit_end", "limit-end": "limit_end", "give_way": "yield", "priority": "priority_road"}
CANDIDATE_FLOOR = 0.1
"""Readings less likely than this are no candidates."""
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
        detail = self.word if self.value is None else f"{self.value:g}"
        return (f"{self.code}:{detail}", self.code) if detail else (self.code,)


def parse_reading(text: str) -> Reading:
    """`limit:50` → code `limit`, value 50; `plate:when_wet:de` → code `plate:when_wet`, word `de`. Never raises.

    Codes and numbers are plain ASCII; what only looks like one (other scripts' letters and digits) does not count.
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


def hours_of(text: str) -> tuple[tuple[float, float], ...]:
    """The times on a plate: `22-6 h` → ((22, 6),), `7:30-8:30, 4-6 PM` → ((7.5, 8.5), (16, 18)).

    Empty without times, or where anything stands beside them that is not understood: then the sign may be in force.
    """
    spans: list[tuple[float, float]] = []
    start = _PLATE.match(text)
    at = start.end() if start else 0
    while at < len(text):
        match = _SPAN.match(text, at)
        span = _span(match) if match else None
        if match is None or span is None:
            return ()
        spans.append(span)
        between = _BETWEEN.match(text, match.end())
        at = between.end() if between else match.end()
    return tuple(spans)


def within_hours(hours: tuple[float, float], time_of_day_h: float) -> bool:
    """Whether a time of day lies in a span that may run over midnight. No number counts as within, and so does any in an empty span."""
    begin, end = hours
    if not math.isfinite(time_of_day_h) or begin == end:
        return True
    return begin <= time_of_day_h < end if begin <= end else time_of_day_h >= begin or time_of_day_h < end


def _span(match: re.Match[str]) -> tuple[float, float] | None:
    """`4-6 PM` begins in the afternoon, `11-1 PM` in the morning."""
    end = _hour(match[4], match[5], match[6])
    begin = _hour(match[1], match[2], match[3] or match[6])
    if not match[3] and match[6] and begin is not None and end is not None and begin >= end:
        begin = _hour(match[1], match[2], "am" if match[6][0] in "pP" else "pm")
    return None if begin is None or end is None else (begin, end)


def _hour(hours: str, minutes: str | None, half: str | None) -> float | None:
    hour, minute = int(hours), int(minutes or 0)
    if minute > 59 or hour + minute / 60 > 24 or (half and not 1 <= hour <= 12):
        return None
    if half:
        hour = hour % 12 + (12 if half[0] in "pP" else 0)
    return (hour * 60 + minute) / 60  # to the last bit what a time in whole minutes is

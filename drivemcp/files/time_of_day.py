"""A time of day as programs and people write it, behind a date or alone."""

import re

DAY_S = 86_400.0
_WRITTEN = re.compile(
    r"(?:.*[\sT])?(\d{1,2}):([0-5]\d)(?::([0-5]\d|60)(?:[.,:](\d+))?)?\s*(?:([ap])\.?m\.?)?"
    r"\s*(?:[A-Z]{1,5}\b)?\s*(?:[+-]\d\d:?\d\d)?(?:\s+\d{4})?",
    re.I,
)
"""Hour, minute, second, its fraction, half of the day; then a zone, which is passed over, and a year."""

_DIGITS = re.compile(r"([01]\d|2[0-3])([0-5]\d)([0-5]\d(?:\.\d+)?)")


def second_of_digits(text: str) -> float | None:
    """Seconds since midnight of `hhmmss`, with or without a fraction; None: the text is no such time."""
    found = _DIGITS.fullmatch(text)
    return int(found[1]) * 3600 + int(found[2]) * 60 + float(found[3]) if found is not None else None


def second_of_day(text: str) -> float | None:
    """Seconds since midnight as the text says it, whatever its zone; None: no time of day ends it."""
    found = _WRITTEN.fullmatch(text.strip())
    if found is None:
        return None
    hour = int(found[1])
    if found[5]:
        hour = hour % 12 + (12 if found[5].lower() == "p" else 0)
    return hour * 3600 + int(found[2]) * 60 + float(f"{found[3] or 0}.{found[4] or 0}") if hour < 24 else None


class Clock:
    """Times of day as one clock: what falls back by more than half a day is the next day's."""

    def __init__(self) -> None:
        self._last_s, self._midnights_s = 0.0, 0.0

    def after(self, second_of_day: float) -> float:
        """Seconds since the first midnight."""
        at_s = self._midnights_s + second_of_day
        if at_s < self._last_s - DAY_S / 2:
            self._midnights_s += DAY_S
            at_s += DAY_S
        self._last_s = at_s
        return at_s

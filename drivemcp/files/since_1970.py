"""Times since 1970 whose unit their magnitude tells, and dates that are written as one number."""

import re
from datetime import UTC, datetime

_LEAST = ((1e17, 1e9), (1e14, 1e6), (1e11, 1e3))
UNTOLD_TO = _LEAST[-1][0]
"""Up to this number a time may count anything from any beginning."""
_DATE = re.compile(r"((?:19|20)\d{12})(\d{3})?(?:[.,](\d+))?", re.ASCII)
"""Year, month, day, hour, minute, second, perhaps milliseconds: as a count since 1970 it would be of a later century."""


def counts_per_s(value: float) -> float:
    """How many of a time's unit are in a second: of nano-, micro- and milliseconds since 1970; 1 for every smaller number."""
    return next((per_s for least, per_s in _LEAST if value > least), 1.0)


def dated_s(text: str) -> float | None:
    """Seconds since 1970 of a date that is one number, as 20240501100000; None: the text is no such number."""
    found = _DATE.fullmatch(text.strip())
    if found is None:
        return None
    try:
        whole = datetime.strptime(found[1], "%Y%m%d%H%M%S").replace(tzinfo=UTC).timestamp()
    except ValueError:
        return None
    return whole + float(f"0.{found[2] or found[3] or 0}")

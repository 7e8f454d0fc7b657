"""Times since 1970 whose unit their magnitude tells, and dates that are written as one number."""

import re
from collections.abc import Sequence
from datetime import UTC, datetime

_LEAST = ((1e17, 1e9), (1e14, 1e6), (1e11, 1e3))
_TICKS = ((1.2e17, 1.4e17), (6.2e17, 6.6e17))
"""Of 100 ns since 1601, as Windows counts, in the years 1981 to 2044, and since the year 1, as .NET does, in the years 1965 to 2092."""
UNTOLD_TO = _LEAST[-1][0]
"""Up to this number a time may count anything from any beginning."""
_DATE = re.compile(r"((?:19|20)\d{12})(\d{3})?(?:[.,](\d+))?", re.ASCII)
"""Year, month, day, hour, minute, second, perhaps milliseconds: as a count since 1970 it would be of a later century."""
_DAYS = ((20_000.0, 80_000.0), (700_000.0, 770_000.0), (2_430_000.0, 2_490_000.0))
"""Days since 1900 as spreadsheets count them, since the year 0 as MATLAB does, and Julian days, of the years from 1941 on."""


def counts_per_s(value: float) -> float:
    """How many of a time's unit are in a second: of nano-, micro- and milliseconds since 1970, and of ticks; 1 for smaller numbers."""
    if any(least < value < most for least, most in _TICKS):
        return 1e7
    return next((per_s for least, per_s in _LEAST if value > least), 1.0)


def are_days(numbers: Sequence[float]) -> bool:
    """Whether times count days, of which one drive takes a part."""
    inside = any(all(least <= each <= most and not each.is_integer() for each in numbers) for least, most in _DAYS)
    return len(numbers) > 1 and inside and max(numbers) - min(numbers) < 1.0


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

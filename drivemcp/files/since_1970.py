"""Times since 1970 whose unit their magnitude tells."""

_LEAST = ((1e17, 1e9), (1e14, 1e6), (1e11, 1e3))
UNTOLD_TO = _LEAST[-1][0]
"""Up to this number a time may count anything from any beginning."""


def counts_per_s(value: float) -> float:
    """How many of a time's unit are in a second: of nano-, micro- and milliseconds since 1970; 1 for every smaller number."""
    return next((per_s for least, per_s in _LEAST if value > least), 1.0)

"""The vehicle identification number: its letters (ISO 3779) and its check digit (49 CFR 565.15)."""

import re

SHAPE = re.compile(r"[A-HJ-NPR-Z0-9]{17}")
_VALUES = {
    **{str(digit): digit for digit in range(10)},
    **{letter: place for place, letter in enumerate("ABCDEFGH", 1)},
    **{letter: place for place, letter in enumerate("JKLMN", 1)},
    "P": 7,
    "R": 9,
    **{letter: place for place, letter in enumerate("STUVWXYZ", 2)},
}
_WEIGHTS = (8, 7, 6, 5, 4, 3, 2, 10, 0, 9, 8, 7, 6, 5, 4, 3, 2)
CHECK_PLACE = 8


def check_digit_valid(vin: str) -> bool | None:
    """Whether the ninth place is the check digit of the others; None for what is no such number. Only North America and
    China require the digit: elsewhere False says little.
    """
    if SHAPE.fullmatch(vin) is None:
        return None
    rest = sum(_VALUES[letter] * weight for letter, weight in zip(vin, _WEIGHTS, strict=True)) % 11
    return vin[CHECK_PLACE] == ("X" if rest == 10 else str(rest))

"""What the text of a DBC says that cantools does not tell."""

import re

_MESSAGE = re.compile(r"\s*BO_\s+(\d+)\s")
_MULTIPLEXED = re.compile(r"\s*SG_\s+(\w+)\s+m(\d+)M?\s*:")
EXTENDED = 1 << 31
"""Set in the number of a message whose id has 29 bits."""
SHORT = 32
"""Letters of a name in a DBC; longer names stand in an attribute."""


def multiplexed(text: str) -> dict[tuple[tuple[bool, int], str], int]:
    """(message, first 32 letters of the signal) -> selector value, of the signals that are written as multiplexed (`m1`)."""
    found: dict[tuple[tuple[bool, int], str], int] = {}
    number = 0
    for line in text.splitlines():
        if message := _MESSAGE.match(line):
            number = int(message[1])
        elif signal := _MULTIPLEXED.match(line):
            found[(bool(number & EXTENDED), number % EXTENDED), signal[1][:SHORT]] = int(signal[2])
    return found

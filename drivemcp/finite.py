"""Numbers that are none: JSON cannot carry them, so that no log that holds one can be read again."""

import math

import msgspec


def finite(value: object) -> bool:
    """Whether a message's data holds no number that is none: JSON cannot carry those, and nobody can reckon with them."""
    inside = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else (value,)
    for each in inside:  # a loop, since thousands a second come through here
        if isinstance(each, float):
            if not math.isfinite(each):
                return False
        elif isinstance(each, dict | list | tuple) and not finite(each):
            return False
    return True


def is_data(message: msgspec.Struct) -> bool:
    """Whether a message holds finite numbers alone."""
    return finite(msgspec.to_builtins(message))

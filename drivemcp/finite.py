"""Numbers that are not finite: JSON cannot carry them, so that no log that holds one can be read again."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, TypeVar

import msgspec

from proto.perception import Tracks
from proto.scene import Facts

M = TypeVar("M", bound=msgspec.Struct)
_PARTS: Mapping[type[Any], str] = MappingProxyType({Tracks: "tracks", Facts: "facts"})
"""What such a message is a list of: one that is no data costs the others nothing."""


def finite(value: object) -> bool:
    """Whether all numbers in a message's data are finite: JSON cannot carry others, and no service can calculate with them."""
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


def sound(message: M) -> M | None:
    """The message, without the tracks or facts in it that are not data; `None` where the message itself is not data."""
    if is_data(message):
        return message
    part = _PARTS.get(type(message))
    if part is None:
        return None
    kept = tuple(each for each in getattr(message, part) if is_data(each))
    rest = msgspec.structs.replace(message, **{part: kept})
    return rest if is_data(rest) else None

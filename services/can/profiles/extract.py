"""Reads signals out of a frame's bytes: compiled once from the description, then only slices, shifts and masks.

A signal becomes an expression of numbers alone, as `(number(data[2:4], 'little') >> 0 & 65535) * 0.01 + 0`, so that all
signals of a message are read by one call.
"""

import math
import struct
from collections.abc import Callable, Iterable
from functools import cache
from typing import Any, Literal, NamedTuple

from drivemcp.errors import UserError
from drivemcp.files.bus_description import selections
from services.can.errors import ProfileError
from services.can.profiles.void import FLOAT_EXPONENT, Void, void_of

Raw = Callable[[bytes], int]
Read = Callable[[bytes], float]

NAMES: dict[str, Any] = {
    "__builtins__": {},
    "number": int.from_bytes,
    "float16": struct.Struct(">e").unpack,
    "float32": struct.Struct(">f").unpack,
    "float64": struct.Struct(">d").unpack,
}
"""All that an expression may call."""


class Place(NamedTuple):
    """Where a signal lies: bytes first to end (not included) as one number, shifted right, then masked."""

    first: int
    end: int
    shift: int
    mask: int
    order: Literal["little", "big"]


class Extractor(NamedTuple):
    """One signal of one message. Reads frames of at least `end` bytes."""

    name: str
    end: int
    raw: Raw
    read: Read
    """The physical value, named values as numbers."""
    expression: str
    """Of the physical value, in `data`."""
    here: tuple[tuple[Raw, frozenset[int]], ...] = ()
    """Selectors, and for which of their values a multiplexed signal is in the frame."""
    void: Void | None = None
    """Whether a raw value says that there is no measurement."""

    def in_frame(self, data: bytes) -> bool:
        """Whether the selectors select this signal."""
        return all(raw(data) in values for raw, values in self.here)


def extractor(message: Any, signal: Any, *, j1939: bool = False) -> Extractor:
    """For a signal of a message, both as cantools describes them. Raises ProfileError for a scale that is no number, a
    float of no known size, and selectors that are absent or go round in a circle.
    """
    raw, text = _raw(signal), _physical(message, signal)
    selectors, void = _selectors(message, signal), void_of(signal, j1939=j1939)
    return Extractor(signal.name, _end(message, signal), _compiled(raw), _compiled(text), text, selectors, void)


def read_all(extractors: Iterable[Extractor]) -> Callable[[bytes], dict[str, float]]:
    """Signal name -> physical value, of a frame that is long enough for all."""
    pairs = ", ".join(f"{each.name!r}: {each.expression}" for each in extractors)
    found: Callable[[bytes], dict[str, float]] = _compiled(f"{{{pairs}}}")
    return found


def place_of(signal: Any) -> Place:
    """Intel start bits count from the least significant bit, Motorola ones name the most significant one."""
    mask = (1 << signal.length) - 1
    if signal.byte_order == "little_endian":
        last = signal.start + signal.length - 1
        return Place(signal.start // 8, last // 8 + 1, signal.start % 8, mask, "little")
    first = 8 * (signal.start // 8) + 7 - signal.start % 8
    last = first + signal.length - 1
    return Place(first // 8, last // 8 + 1, 7 - last % 8, mask, "big")


def _bits(signal: Any) -> str:
    """The signal's bits as a whole number without a sign."""
    first, end, shift, mask, order = place_of(signal)
    word = f"data[{first}]" if end - first == 1 else f"number(data[{first}:{end}], {order!r})"
    return f"({word} >> {shift} & {mask})" if shift else f"({word} & {mask})"


def _raw(signal: Any) -> str:
    bits, sign = _bits(signal), 1 << (signal.length - 1)
    return f"(({bits} ^ {sign}) - {sign})" if signal.is_signed and not signal.is_float else bits


def _physical(message: Any, signal: Any) -> str:
    scale, offset = signal.conversion.scale, signal.conversion.offset
    if not (math.isfinite(scale) and math.isfinite(offset)):
        raise ProfileError(f"{message.name}.{signal.name}: scale and offset must be numbers")
    if signal.is_float and signal.length not in FLOAT_EXPONENT:
        raise ProfileError(f"{message.name}.{signal.name}: a float has 16, 32 or 64 bits, not {signal.length}")
    bits = _raw(signal)
    raw = f"float{signal.length}({bits}.to_bytes({signal.length // 8}, 'big'))[0]" if signal.is_float else bits
    return raw if (scale, offset) == (1, 0) else f"{raw} * {scale!r} + {offset!r}"


@cache
def _compiled(expression: str) -> Any:
    """Made of numbers that were parsed as such and of names that are quoted: a description cannot bring in code."""
    return eval(f"lambda data: {expression}", NAMES)


def _selected(message: Any, signal: Any) -> tuple[tuple[Any, Any], ...]:
    """(signal, its selector), and so on. Raises ProfileError."""
    try:
        return tuple(selections(message, signal))
    except UserError as error:
        raise ProfileError(str(error)) from error


def signal_of(message: Any, name: str) -> Any:
    """The signal of that name (cantools). Raises ProfileError."""
    for signal in message.signals:
        if signal.name == name:
            return signal
    raise ProfileError(f"{name} is not in message {message.name}")


def _selectors(message: Any, signal: Any) -> tuple[tuple[Raw, frozenset[int]], ...]:
    """A selector's value is that of its bits, whatever its sign and scale."""
    return tuple(
        (_compiled(_bits(selector)), frozenset(selected.multiplexer_ids))
        for selected, selector in _selected(message, signal)
    )


def _end(message: Any, signal: Any) -> int:
    """So many bytes a frame must have: for the signal and its selectors."""
    return max(place_of(each).end for each in (signal, *(selector for _, selector in _selected(message, signal))))

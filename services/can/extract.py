"""Reads one signal out of a frame's bytes: made once from the description, then only a slice, a shift and a mask."""

import struct
from collections.abc import Callable
from typing import Any, Literal, NamedTuple

Raw = Callable[[bytes], int]
Read = Callable[[bytes], float]
Void = Callable[[int], bool]

FLOATS = {16: ">e", 32: ">f", 64: ">d"}
VOID_NAMES = frozenset(
    {
        "sna",
        "notavailable",
        "signalnotavailable",
        "datanotavailable",
        "unavailable",
        "invalid",
        "signalinvalid",
        "invaliddata",
        "invalidvalue",
        "nichtverfuegbar",
        "ungueltig",
        "fehlerwert",
        "initwert",
    }
)
"""What value tables call a raw value that is no measurement, in small letters without blanks and signs."""


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
    here: tuple[tuple[Raw, frozenset[int]], ...] = ()
    """Selectors, and for which of their values a multiplexed signal is in the frame."""
    void: Void | None = None
    """Whether a raw value says that there is no measurement."""

    def in_frame(self, data: bytes) -> bool:
        """Whether the selectors select this signal."""
        return all(raw(data) in values for raw, values in self.here)


def extractor(message: Any, signal: Any, *, j1939: bool = False) -> Extractor:
    """For a signal of a message, both as cantools describes them."""
    place, here = place_of(signal), _selectors(message, signal)
    raw = _raw(place, signal)
    return Extractor(signal.name, _end(message, signal), raw, _read(raw, signal), here, _void(signal, j1939))


def place_of(signal: Any) -> Place:
    """Intel start bits count from the least significant bit, Motorola ones name the most significant one."""
    mask = (1 << signal.length) - 1
    if signal.byte_order == "little_endian":
        last = signal.start + signal.length - 1
        return Place(signal.start // 8, last // 8 + 1, signal.start % 8, mask, "little")
    first = 8 * (signal.start // 8) + 7 - signal.start % 8
    last = first + signal.length - 1
    return Place(first // 8, last // 8 + 1, 7 - last % 8, mask, "big")


def _raw(place: Place, signal: Any) -> Raw:
    first, end, shift, mask, order = place
    if end - first == 1:
        unsigned: Raw = lambda data: data[first] >> shift & mask  # noqa: E731
    else:
        from_bytes = int.from_bytes
        unsigned = lambda data: from_bytes(data[first:end], order) >> shift & mask  # noqa: E731
    if not signal.is_signed or signal.is_float:
        return unsigned
    sign = 1 << (signal.length - 1)
    return lambda data: (unsigned(data) ^ sign) - sign


def _read(raw: Raw, signal: Any) -> Read:
    scale, offset = signal.conversion.scale, signal.conversion.offset
    if signal.is_float:
        form, size = struct.Struct(FLOATS[signal.length]), signal.length // 8
        return lambda data: form.unpack(raw(data).to_bytes(size, "big"))[0] * scale + offset
    if scale == 1 and offset == 0:
        return raw
    return lambda data: raw(data) * scale + offset


def _selectors(message: Any, signal: Any) -> tuple[tuple[Raw, frozenset[int]], ...]:
    """Extended multiplexing: a selector may itself be selected by another."""
    found = []
    while signal.multiplexer_signal:
        selector = message.get_signal_by_name(signal.multiplexer_signal)
        found.append((_raw(place_of(selector), selector), frozenset(signal.multiplexer_ids)))
        signal = selector
    return tuple(found)


def _end(message: Any, signal: Any) -> int:
    """So many bytes a frame must have: for the signal and its selectors."""
    end = place_of(signal).end
    while signal.multiplexer_signal:
        signal = message.get_signal_by_name(signal.multiplexer_signal)
        end = max(end, place_of(signal).end)
    return end


def _void(signal: Any, j1939: bool) -> Void | None:
    named = frozenset(raw for raw, text in (signal.choices or {}).items() if _plain(str(text)) in VOID_NAMES)
    floor = _j1939_floor(signal) if j1939 else None
    if floor is not None:
        return lambda raw: raw >= floor or raw in named
    return named.__contains__ if named else None


def _j1939_floor(signal: Any) -> int | None:
    """From this raw value on there is no measurement: error, not available, reserved (SAE J1939-71, table 1)."""
    if signal.is_signed or signal.is_float:
        return None
    if signal.length >= 8:
        return 0xFB << (int(signal.length) - 8)
    return {2: 0b10, 4: 0xE}.get(int(signal.length))


def _plain(text: str) -> str:
    return "".join(each for each in text.lower() if each.isalnum())

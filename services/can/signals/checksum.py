"""Checksums of messages, by name. A profile or a description names the kind and, where one is needed, the data ids.

The AUTOSAR ones are by the E2E Protocol Specification (AUTOSAR FO PRS_E2EProtocol, profiles 1, 2 and 5: CRC first,
counter after it); the makers' ones are as the public opendbc project found them. Kinds that mix single signals of one
message (GM, Ford, Mazda) are not here.
"""

from binascii import crc_hqx
from collections.abc import Callable
from functools import reduce
from operator import xor
from typing import Any, NamedTuple

from services.can.errors import ProfileError
from services.can.profiles.extract import Place, place_of


class Covered(NamedTuple):
    """What a checksum is worked out from."""

    blank: bytes
    """The frame with the checksum's bits 0."""
    rest: bytes
    """The frame without the checksum's bytes."""
    arbitration_id: int
    ids: tuple[int, ...]
    """Data ids, start value or final value, as the kind has it."""

    @property
    def id_bytes(self) -> bytes:
        """The arbitration id, low byte first."""
        return self.arbitration_id.to_bytes(4, "little")

    @property
    def counter(self) -> int:
        """Where AUTOSAR's profiles 1 and 2 have it: low half of byte 1."""
        return self.blank[1] & 0x0F


Kind = Callable[[Covered], int]


def checker(kind: str, message: Any, signal: Any, ids: tuple[int, ...] = ()) -> Callable[[bytes], bool]:
    """Whether a frame of the described length carries the right checksum. Raises ProfileError."""
    if kind not in KINDS:
        raise ProfileError(f"{message.name}.{signal.name}: no checksum kind {kind!r}; known are {', '.join(KINDS)}")
    if kind in NEED_IDS and not ids:
        raise ProfileError(f"{message.name}.{signal.name}: checksum kind {kind!r} needs data_ids")
    work, place, arbitration_id = KINDS[kind], place_of(signal), message.frame_id
    if place.end > message.length or (kind.startswith("e2e-p") and message.length < 3):
        raise ProfileError(f"{message.name}.{signal.name}: does not fit in {message.length} bytes")
    hole = _hole(place, message.length)

    def right(data: bytes) -> bool:
        stated = int.from_bytes(data[place.first : place.end], place.order) >> place.shift & place.mask
        blank = (int.from_bytes(data, "big") & hole).to_bytes(len(data), "big")
        rest = data[: place.first] + data[place.end :]
        return work(Covered(blank, rest, arbitration_id, ids)) & place.mask == stated

    return right


def _hole(place: Place, length: int) -> int:
    """All bits of a frame but the checksum's, first byte highest."""
    field = (place.mask << place.shift).to_bytes(place.end - place.first, place.order)
    bits = bytes(place.first) + field + bytes(length - place.end)
    return ~int.from_bytes(bits, "big") & ((1 << 8 * length) - 1)


def _crc8_table(polynomial: int) -> bytes:
    table = bytearray(range(256))
    for _ in range(8):
        table = bytearray((each << 1 & 0xFF) ^ (polynomial if each & 0x80 else 0) for each in table)
    return bytes(table)


J1850, H2F = _crc8_table(0x1D), _crc8_table(0x2F)


def _crc8(table: bytes, data: bytes, start: int) -> int:
    for each in data:
        start = table[start ^ each]
    return start


def _nibbles(data: bytes) -> int:
    return sum((each >> 4) + (each & 0xF) for each in data)


def _honda(frame: Covered) -> int:
    extended = 3 if frame.arbitration_id > 0x7FF else 0
    return 8 + extended - _nibbles(frame.blank) - _nibbles(frame.id_bytes)


def _profile_1(mode: str) -> Kind:
    def work(frame: Covered) -> int:
        low, high = frame.ids[0] & 0xFF, frame.ids[0] >> 8 & 0xFF
        turn = high if frame.counter & 1 else low
        prefix = {"both": (low, high), "alt": (turn,), "low": (low,), "nibble": (low, 0)}[mode]
        return _crc8(J1850, bytes(prefix) + frame.rest, 0)

    return work


def _profile_2(frame: Covered) -> int:
    ids = frame.ids and (frame.ids[frame.counter % len(frame.ids)],)
    return _crc8(H2F, frame.rest + bytes(ids), 0xFF) ^ 0xFF


def _profile_5(frame: Covered, data_id: int | None = None) -> int:
    chosen = frame.ids[0] if data_id is None else data_id
    return crc_hqx(frame.rest + chosen.to_bytes(2, "little"), 0xFFFF)


def _first(ids: tuple[int, ...], default: int) -> int:
    return ids[0] if ids else default


KINDS: dict[str, Kind] = {
    "sum": lambda frame: sum(frame.rest) + sum(frame.ids),
    "xor": lambda frame: reduce(xor, frame.rest, _first(frame.ids, 0)),
    "sum-id": lambda frame: sum(frame.rest) + sum(frame.id_bytes),
    "crc8-j1850": lambda frame: _crc8(J1850, frame.rest, 0xFF) ^ 0xFF,
    "crc8-h2f": lambda frame: _crc8(H2F, frame.rest, 0xFF) ^ 0xFF,
    "e2e-p1-both": _profile_1("both"),
    "e2e-p1-alt": _profile_1("alt"),
    "e2e-p1-low": _profile_1("low"),
    "e2e-p1-nibble": _profile_1("nibble"),
    "e2e-p2": _profile_2,
    "e2e-p5": _profile_5,
    "toyota": lambda frame: sum(frame.rest) + sum(frame.id_bytes) + len(frame.blank),
    "honda": _honda,
    "psa": lambda frame: _first(frame.ids, 0xB) - _nibbles(frame.blank),
    "hyundai": lambda frame: _crc8(J1850, frame.rest, 0x22) ^ 0xDF,
    "hyundai-canfd": lambda frame: _profile_5(frame, (frame.arbitration_id & 0xFFFF) ^ 0xF800),
    "fca-giorgio": lambda frame: _crc8(J1850, frame.rest, 0) ^ _first(frame.ids, 0x0A),
}
_ALIASES = {
    "chrysler": "crc8-j1850", "nissan": "crc8-j1850", "vw-mqb": "e2e-p2", "vw-pq": "xor", "subaru": "sum-id",
    "tesla": "sum-id",
}  # fmt: skip
KINDS |= {alias: KINDS[kind] for alias, kind in _ALIASES.items()}
NEED_IDS = frozenset({"e2e-p1-both", "e2e-p1-alt", "e2e-p1-low", "e2e-p1-nibble", "e2e-p5"})

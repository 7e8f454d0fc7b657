"""SAE J1939 as numbers: what a 29-bit id says, and what DM1 tells of faults (J1939-21, J1939-73)."""

from typing import NamedTuple

import msgspec

from services.can.errors import MalformedFrame
from services.can.profiles.dbc import pgn_of

GLOBAL = 0xFF
TOOL_ADDRESS = 0xF9
"""Off-board diagnostic tool 1."""
ACKNOWLEDGEMENT, REQUEST, DM1, VEHICLE_IDENTIFICATION = 0xE800, 0xEA00, 0xFECA, 0xFEEC
PGN_LIMIT = 1 << 18
PADDING = b"\xff\xff\xff\xff"

LAMPS = ("malfunction", "red_stop", "amber_warning", "protect")
"""From the highest bit pair of DM1's first byte to the lowest."""
LAMP_STATES = ("off", "on", "error", "not available")
ANSWERS = {1: "refused", 2: "access denied", 3: "busy: ask again later"}


class Header(NamedTuple):
    """A J1939 id: `destination` is 255 where all units are meant."""

    priority: int
    pgn: int
    destination: int
    source: int


class SpnFault(msgspec.Struct, frozen=True, kw_only=True):
    """One active fault: suspect parameter number, failure mode, and how often it occurred (None: not counted)."""

    spn: int
    fmi: int
    occurrences: int | None
    old_conversion: bool = False
    """The sender counts its bits the old way; the SPN may be another."""


class Dm1(msgspec.Struct, frozen=True, kw_only=True):
    """The lamps that a unit asks for, and its active faults."""

    lamps: dict[str, str]
    flashing: tuple[str, ...]
    faults: tuple[SpnFault, ...]


def header(arbitration_id: int) -> Header:
    """What a 29-bit id says. Below 0xF000 the group is for one address (PDU1), else for all (PDU2)."""
    pgn = pgn_of(arbitration_id)
    to_one = pgn & 0xFF00 < 0xF000
    destination = arbitration_id >> 8 & 0xFF if to_one else GLOBAL
    return Header(arbitration_id >> 26 & 0x7, pgn, destination, arbitration_id & 0xFF)


def id_of(pgn: int, source: int, destination: int = GLOBAL, priority: int = 6) -> int:
    """The 29-bit id of a group; the destination counts for PDU1 groups alone."""
    to_one = pgn & 0xFF00 < 0xF000
    return priority << 26 | pgn << 8 | (destination << 8 if to_one else 0) | source


def request_data(pgn: int) -> bytes:
    """The three bytes that ask for a group."""
    return pgn.to_bytes(3, "little")


def dm1(data: bytes) -> Dm1:
    """DM1's lamps and faults. Raises MalformedFrame where bytes are missing."""
    rows = data[2:]
    if len(data) < 6 or (len(rows) % 4 and data[6:] != b"\xff" * (len(data) - 6)):
        raise MalformedFrame(f"a DM1 of {len(data)} bytes")
    parts = (rows[place : place + 4] for place in range(0, len(rows) - 3, 4))
    lamps = {name: LAMP_STATES[_pair(data[0], place)] for place, name in enumerate(LAMPS)}
    return Dm1(
        lamps=lamps,
        flashing=tuple(n for place, n in enumerate(LAMPS) if lamps[n] == "on" and _pair(data[1], place) in (0, 1)),
        faults=tuple(_fault(row) for row in parts if row not in (b"\0\0\0\0", PADDING)),
    )


def _pair(byte: int, place: int) -> int:
    return byte >> (6 - 2 * place) & 0x3


def _fault(row: bytes) -> SpnFault:
    count = row[3] & 0x7F
    return SpnFault(
        spn=row[0] | row[1] << 8 | (row[2] >> 5) << 16,
        fmi=row[2] & 0x1F,
        occurrences=None if count == 0x7F else count,
        old_conversion=bool(row[3] & 0x80),
    )

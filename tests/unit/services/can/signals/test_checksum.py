"""Checksums against published values: AUTOSAR's profiles, and what opendbc's own functions give."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from cantools.database import load_string
from hypothesis import given, settings
from hypothesis import strategies as st

from services.can.errors import ProfileError
from services.can.profiles.extract import place_of
from services.can.signals.checksum import KINDS, Covered, checker


@cache
def described(length: int, place: str, arbitration_id: int = 0x1A0) -> Any:
    """A message with one signal, the checksum, at `start|bits@order`."""
    text = f'VERSION "1"\nBS_:\nBU_: A\nBO_ {arbitration_id} M: {length} A\n SG_ C : {place}+ (1,0) [0|0] "" A\n'
    database: Any = load_string(text, "dbc")
    return database.messages[0]


def right(kind: str, data: bytes, place: str, ids: tuple[int, ...] = (), arbitration_id: int = 0x1A0) -> bool:
    message = described(len(data), place, arbitration_id)
    return checker(kind, message, message.signals[0], ids)(data)


# Made with the reference implementation `autosar-e2e` 1.0.0: all data 0, counters 1 to 3; the first is the standard's own.
PROFILES = [
    ("e2e-p1-both", (0x123,), "0|8@1", ["cc00000000000000", "9101000000000000", "7602000000000000"]),
    ("e2e-p1-alt", (0x123,), "0|8@1", ["0201000000000000", "7402000000000000", "b803000000000000"]),
    ("e2e-p1-low", (0x123,), "0|8@1", ["9301000000000000", "7402000000000000", "2903000000000000"]),
    ("e2e-p1-nibble", (0x123,), "0|8@1", ["7711000000000000", "9012000000000000", "cd13000000000000"]),
    ("e2e-p2", tuple(range(1, 17)), "0|8@1", ["1b01000000000000", "9802000000000000", "3103000000000000"]),
    ("e2e-p5", (0x1234,), "0|16@1", ["cf8d010000000000", "ba45020000000000", "6902030000000000"]),
]


@pytest.mark.parametrize(("kind", "ids", "place", "frames"), PROFILES)
def test_autosar_profiles_give_the_published_values(
    kind: str, ids: tuple[int, ...], place: str, frames: list[str]
) -> None:
    assert all(right(kind, bytes.fromhex(each), place, ids) for each in frames)


MAKERS = [
    ("toyota", "car.toyota.toyotacan:toyota_checksum", "63|8@0", 8),
    ("honda", "car.honda.hondacan:honda_checksum", "59|4@0", 8),
    ("subaru", "car.subaru.subarucan:subaru_checksum", "0|8@1", 8),
    ("tesla", "car.tesla.teslacan:tesla_checksum", "56|8@1", 8),
    ("chrysler", "car.chrysler.chryslercan:chrysler_checksum", "63|8@0", 8),
    ("fca-giorgio", "car.chrysler.chryslercan:fca_giorgio_checksum", "63|8@0", 8),
    ("vw-mqb", "car.volkswagen.mqbcan:volkswagen_mqb_meb_checksum", "0|8@1", 8),
    ("vw-pq", "car.volkswagen.mqbcan:xor_checksum", "0|8@1", 8),
    ("psa", "car.psa.psacan:psa_checksum", "59|4@0", 8),
    ("hyundai-canfd", "car.hyundai.hyundaicanfd:hkg_can_fd_checksum", "0|16@1", 8),
    ("hyundai-canfd", "car.hyundai.hyundaicanfd:hkg_can_fd_checksum", "0|16@1", 32),
]


def theirs(where: str) -> Callable[[int, Any, bytearray], int]:
    module, name = where.split(":")
    found: Callable[[int, Any, bytearray], int] = getattr(pytest.importorskip(f"opendbc.{module}"), name)
    return found


@pytest.mark.parametrize(("kind", "where", "place", "length"), MAKERS)
@settings(max_examples=25, deadline=None)
@given(st.data())
def test_makers_checksums_are_those_of_opendbc(kind: str, where: str, place: str, length: int, data: Any) -> None:
    message = described(length, place)
    signal = message.signals[0]
    empty = put(data.draw(st.binary(min_size=length, max_size=length)), signal, 0)
    stated = theirs(where)(0x1A0, SimpleNamespace(start_bit=signal.start), bytearray(empty))
    assert right(kind, put(empty, signal, stated), place)
    assert not right(kind, put(empty, signal, stated ^ 1), place)


def put(data: bytes, signal: Any, value: int) -> bytes:
    """`data` with the signal's bits set to `value`."""
    little = signal.byte_order == "little_endian"
    shift: int = (
        signal.start if little else 8 * (len(data) - 1 - signal.start // 8) + signal.start % 8 - signal.length + 1
    )
    mask: int = ((1 << signal.length) - 1) << shift
    number = int.from_bytes(data, "little" if little else "big") & ~mask
    return (number | value << shift).to_bytes(len(data), "little" if little else "big")


def test_plain_crcs_give_the_check_values_of_their_standards() -> None:
    assert right("crc8-j1850", b"\x4b123456789", "0|8@1")
    assert right("crc8-h2f", b"\xdf123456789", "0|8@1")


IDS = {kind: (0x1234,) for kind in KINDS if kind.startswith(("e2e-p1", "e2e-p5"))}


@pytest.mark.parametrize("kind", sorted(KINDS))
@settings(max_examples=20, deadline=None)
@given(data=st.binary(min_size=8, max_size=8), bit=st.integers(0, 63))
def test_no_kind_takes_a_frame_with_one_flipped_bit(kind: str, data: bytes, bit: int) -> None:
    place = "0|16@1" if kind in ("e2e-p5", "hyundai-canfd") else "59|4@0" if kind in ("honda", "psa") else "0|8@1"
    message = described(8, place)
    signal, ids = message.signals[0], IDS.get(kind, ())
    judge, lies, blank = checker(kind, message, signal, ids), place_of(signal), put(data, signal, 0)
    value = KINDS[kind](Covered(blank, blank[: lies.first] + blank[lies.end :], 0x1A0, ids)) & lies.mask
    whole = put(blank, signal, value)
    assert judge(whole)
    flipped = (int.from_bytes(whole, "big") ^ 1 << bit).to_bytes(8, "big")
    assert not judge(flipped)


def test_an_unknown_kind_and_a_missing_data_id_are_named() -> None:
    with pytest.raises(ProfileError, match=r"M\.C: no checksum kind 'crc9'; known are sum"):
        right("crc9", bytes(8), "0|8@1")
    with pytest.raises(ProfileError, match=r"M\.C: checksum kind 'e2e-p5' needs data_ids"):
        right("e2e-p5", bytes(8), "0|16@1")


def test_the_docs_name_every_kind() -> None:
    text = (Path(__file__).parents[5] / "docs" / "explanation" / "can.md").read_text(encoding="utf-8")
    assert [kind for kind in KINDS if f"`{kind}`" not in text] == []

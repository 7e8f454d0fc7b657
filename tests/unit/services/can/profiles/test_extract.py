"""Our extractors read what cantools reads, from every signal of every public description."""

import math
import random
from pathlib import Path
from typing import Any

import pytest
from cantools.database import load_string
from cantools.database.errors import DecodeError
from hypothesis import given
from hypothesis import strategies as st

from services.can.errors import ProfileError
from services.can.profiles.dbc import Dbc
from services.can.profiles.extract import extractor, place_of, read_all
from services.can.profiles.profile import find_description

opendbc = pytest.importorskip("opendbc")
FOLDER = Path(opendbc.__file__).parent / "dbc"
FILES = sorted(FOLDER.glob("*.dbc"))


def same(ours: float, theirs: float) -> bool:
    return ours == theirs or (math.isnan(ours) and math.isnan(theirs))


def check(message: Any, data: bytes) -> int:
    """Compare all signals that cantools finds in the frame; how many."""
    try:
        theirs = message.decode(data, decode_choices=False)
    except DecodeError:  # a selector has a value that nothing is described for
        return 0
    each = {signal.name: extractor(message, signal) for signal in message.signals if selectable(message, signal)}
    assert {name for name, one in each.items() if one.in_frame(data)} == set(theirs)
    ours = read_all(each[name] for name in theirs)(data)
    assert all(same(ours[name], value) for name, value in theirs.items())
    return len(theirs)


def selectable(message: Any, signal: Any) -> bool:
    """Cantools leaves out what is selected by a signal that is not marked as a selector."""
    selector = signal.multiplexer_signal
    return not selector or message.get_signal_by_name(selector).is_multiplexer


def inside(message: Any) -> bool:
    """Whether all signals fit in the described length; cantools has no answer for others."""
    return not message.is_container and all(place_of(each).end <= message.length for each in message.signals)


def test_every_signal_of_every_public_description_is_read_as_cantools_reads_it() -> None:
    chance, compared, files = random.Random(7), 0, 0
    for path in FILES:
        try:
            dbc = Dbc(path)
        except ProfileError:
            continue
        files += 1
        for key, message in dbc.messages.items():
            if key not in dbc.broken and message.signals and inside(message):
                compared += check(message, chance.randbytes(message.length))
    assert files > 40
    assert compared > 20_000


WIDE = """VERSION "1"
BS_:
BU_: A
BO_ 1 Wide: 64 A
 SG_ Mux M : 0|8@1+ (1,0) [0|0] "" A
 SG_ Inner m1M : 8|4@1+ (1,0) [0|0] "" A
 SG_ Deep m2 : 12|9@1- (0.5,-3) [0|0] "" A
 SG_ F32 : 32|32@1- (1,0) [0|0] "" A
 SG_ F64 : 71|64@0- (2,1) [0|0] "" A
 SG_ Tail : 503|12@0+ (0.1,0) [0|0] "" A
 SG_ Skew : 131|21@0- (0.1,5) [0|0] "" A
SIG_VALTYPE_ 1 F32 : 1;
SIG_VALTYPE_ 1 F64 : 2;
SG_MUL_VAL_ 1 Inner Mux 1-3;
SG_MUL_VAL_ 1 Deep Inner 2-2, 5-6;
"""


def wide() -> Any:
    database: Any = load_string(WIDE, "dbc")
    return database.messages[0]


@given(st.binary(min_size=64, max_size=64), st.sampled_from([1, 2, 3]), st.sampled_from([2, 5, 6]))
def test_floats_skewed_and_twice_multiplexed_signals_of_can_fd_are_read_as_cantools_reads_them(
    data: bytes, outer: int, inner: int
) -> None:
    message = wide()
    assert check(message, bytes([outer, data[1] & 0xF0 | inner]) + data[2:]) == 7


@given(st.binary(min_size=64, max_size=64))
def test_a_signal_that_its_selector_does_not_select_is_not_in_the_frame(data: bytes) -> None:
    message = wide()
    deep = extractor(message, message.get_signal_by_name("Deep"))
    assert deep.in_frame(data) == (data[0] in (1, 2, 3) and data[1] & 0xF in (2, 5, 6))


def test_a_description_cannot_bring_in_code() -> None:
    message = wide()
    tail = message.get_signal_by_name("Tail")
    tail.name = """x': __import__('os').abort(), \\"""
    one = extractor(message, tail)
    assert list(read_all([one])(bytes(64))) == [tail.name]
    tail.conversion.scale = float("inf")
    with pytest.raises(ProfileError, match="scale and offset must be numbers"):
        extractor(message, tail)


def test_the_public_descriptions_are_found_for_tests() -> None:
    assert find_description("vw_pq.dbc", Path("none/profile.toml")).is_file()


@pytest.mark.parametrize(
    ("scale", "number", "heard"), [("@1- (1,0)", 255, 0xFF), ("@1+ (1,1)", 1, 1), ("@1+ (0.5,0)", 3, 3)]
)
def test_a_selector_selects_by_its_bits_whatever_its_sign_and_scale(scale: str, number: int, heard: int) -> None:
    signals = f' SG_ S M : 0|8{scale} [0|0] "" A\n SG_ Speed m{number} : 8|16@1+ (0.01,0) [0|0] "km/h" A\n'
    database: Any = load_string(f'VERSION ""\nBU_: A\nBO_ 291 M: 8 A\n{signals}', "dbc")
    message = database.messages[0]
    speed = extractor(message, message.get_signal_by_name("Speed"))
    assert [speed.in_frame(bytes([each]) + bytes(7)) for each in (heard, heard - 1)] == [True, False]

"""A car's number leaves only as a hash that no other installation can tell."""

from pathlib import Path
from typing import Any

import pytest
from cantools.database import load_string
from hypothesis import given
from hypothesis import strategies as st

from services.can.errors import ProfileError
from services.can.profiles.privacy import Privacy, hashed_vin, held_back, installation_salt, spells_vin

VIN = "1HGCM82633A004352"
VINS = st.text("ABCDEFGHJKLMNPRSTUVWXYZ0123456789", min_size=17, max_size=17)


@given(VINS, VINS, st.binary(min_size=32, max_size=32), st.binary(min_size=32, max_size=32))
def test_a_hash_tells_cars_apart_on_one_installation_and_nothing_across_two(
    one: str, other: str, salt: bytes, foreign: bytes
) -> None:
    told = hashed_vin(one, salt)
    assert told.startswith("sha256-salted:")
    assert one not in told
    assert (told == hashed_vin(other, salt)) == (one == other)
    assert (told == hashed_vin(one, foreign)) == (salt == foreign)


def test_the_number_is_told_only_where_the_installation_allows_it() -> None:
    assert Privacy(salt=b"x" * 32).vin(VIN) == hashed_vin(VIN, b"x" * 32)
    assert Privacy(salt=b"x" * 32, allow_vin=True).vin(VIN) == VIN


def test_the_salt_is_made_once_and_kept_for_its_owner_alone(tmp_path: Path) -> None:
    path = tmp_path / "state" / "vin.salt"
    salt = installation_salt(path)
    assert installation_salt(path) == salt
    assert path.stat().st_mode & 0o077 == 0
    assert installation_salt(None) != installation_salt(None)


def test_a_salt_that_is_none_is_told_by_its_file(tmp_path: Path) -> None:
    path = tmp_path / "vin.salt"
    path.write_bytes(b"short")
    with pytest.raises(ProfileError, match=r"vin\.salt: 5 bytes, not 32"):
        installation_salt(path)
    with pytest.raises(ProfileError, match="vin_salt_file"):
        installation_salt(tmp_path)


@pytest.mark.parametrize(
    ("name", "signal", "spells"),
    [
        ("DCDC", 'DCDC_Vin : 0|16@1+ (0.01,0) [0|655] "V"', False),
        ("DCDC_Vin", 'Input : 0|16@1+ (1,0) [0|655] "mV"', False),
        ("Body", 'VIN_1 : 0|56@1+ (1,0) [0|0] ""', True),
        ("Body", 'VIN_1 : 0|8@1+ (1,0) [0|0] "ASCII"', True),
        ("VIN", 'Part : 0|8@1+ (1,0) [0|0] ""', True),
        ("VIN", 'Part : 0|8@1+ (1,0) [0|0] "-"', True),
        ("Body", 'VinScaled : 0|8@1+ (0.5,0) [0|0] ""', True),
        ("Body", 'Winding : 0|8@1+ (1,0) [0|0] ""', False),
    ],
)
def test_a_measured_voltage_is_no_identification_number(name: str, signal: str, spells: bool) -> None:
    database: Any = load_string(f'VERSION ""\nBU_: A\nBO_ 291 {name}: 8 A\n SG_ {signal} A\n', "dbc")
    assert spells_vin(database.messages[0]) is spells


def test_the_messages_that_are_hidden_for_the_number_are_named() -> None:
    assert held_back(Privacy(salt=b"x", raw_access=True), ["Body", "Body"]).endswith("allow_vin is off: Body")
    assert held_back(Privacy(salt=b"x", raw_access=True), []) == ""
    assert "raw_access is off" in held_back(Privacy(salt=b"x"), ["Body"])

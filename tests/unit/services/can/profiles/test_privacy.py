"""A car's number leaves only as a hash that no other installation can tell."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.can.errors import ProfileError
from services.can.profiles.privacy import Privacy, hashed_vin, installation_salt

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

"""A profile is read whole or refused in one line that names file and field."""

from pathlib import Path

import pytest

from services.can.errors import ProfileError
from services.can.profiles.curated import FIELDS, curated
from services.can.profiles.profile import FieldRule, find_description, find_descriptions, load_profile, transform

HEAD = """
name = "car"
[buses.chassis]
description = ["a.dbc", "b.dbc"]
[buses.body]
description = "c.kcd"
[vehicle]
tyre_nominal_bar = [2.4, 2.4, 2.4, 2.4]
[fields]
"""
SPEED = 'signal = "V", vss = "Vehicle.Speed", unit = "m/s", minimum = 0, maximum = 80'


def _write(folder: Path, fields: str, head: str = HEAD) -> Path:
    path = folder / "car" / "profile.toml"
    path.parent.mkdir(exist_ok=True)
    path.write_text(head + fields, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("fields", "complaint"),
    [
        (f"speed_mps = {{ {SPEED} }}", "field speed_mps: which bus\\? one of chassis, body"),
        (f'speed_mps = {{ bus = "x", {SPEED} }}', "field speed_mps: no bus 'x'"),
        (f'sped_mps = {{ bus = "body", {SPEED} }}', "no curated field 'sped_mps'; did you mean 'speed_mps'"),
        ('seat_heater = { bus = "body", signal = "S", vss = "x" }', "no curated field 'seat_heater'"),
        (f'speed_mps = {{ bus = "body", {SPEED.replace("Vehicle.Speed", "")} }}', "vss is Vehicle.Speed, not ''"),
        (f'speed_mps = {{ bus = "body", {SPEED.replace("m/s", "km/h")} }}', "unit is 'm/s', not 'km/h'"),
        (f'speed_mps = {{ bus = "body", {SPEED.replace("80", "-1")} }}', "minimum lies above maximum"),
        (f'speed_mps = {{ bus = "body", {SPEED.replace("80", "nan")} }}', "minimum and maximum must be numbers"),
        (f'speed_mps = {{ bus = "body", {SPEED}, sign = 2 }}', "fields"),
        (f'speed_mps = {{ bus = "body", {SPEED}, colour = 2 }}', "colour"),
        (f'speed_mps = {{ bus = "body", {SPEED}, values = {{ 0 = 1 }}, factor = 2 }}', "stand for themselves"),
        (f'speed_mps = {{ bus = "body", {SPEED}, otherwise = 2 }}', "otherwise says nothing"),
        (f'speed_mps = {{ bus = "body", {SPEED}, valid_values = [1] }}', "valid_values says nothing"),
        (f'speed_mps = {{ bus = "body", {SPEED}, weights = [1, 2] }}', "2 weights for 1 signals"),
        ("speed_mps = ", "profile.toml"),
    ],
)
def test_a_wrong_profile_is_told_in_one_line_that_names_file_and_field(
    tmp_path: Path, fields: str, complaint: str
) -> None:
    with pytest.raises(ProfileError, match=complaint) as raised:
        load_profile(_write(tmp_path, fields))
    assert "profile.toml" in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("encoding", ["utf-16", "cp1252"])
def test_a_profile_that_is_not_written_in_utf_8_is_told(tmp_path: Path, encoding: str) -> None:
    path = _write(tmp_path, "")
    path.write_bytes(f"# Größe\n{HEAD}".encode(encoding))
    with pytest.raises(ProfileError, match=r"profile.toml: it is not written in UTF-8; save it so"):
        load_profile(path)


def test_a_field_that_is_not_curated_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(ProfileError, match="'tyre_pressure_fl_bar'"):
        curated("tire_pressure_fl_bar")


def test_every_curated_field_has_a_path_of_its_own_and_a_purpose() -> None:
    paths = [field.vss for field in FIELDS.values()]
    assert len(paths) == len(set(paths))
    assert all(path.startswith("Vehicle.") for path in paths)
    assert all(field.purpose for field in FIELDS.values())


def test_descriptions_are_looked_for_beside_the_profile_and_then_in_the_folders_named(tmp_path: Path) -> None:
    path = _write(tmp_path, f'speed_mps = {{ bus = "body", {SPEED} }}')
    other = tmp_path / "descriptions"
    other.mkdir()
    for folder, name in ((path.parent, "a.dbc"), (other, "a.dbc"), (other, "b.dbc"), (other, "c.kcd")):
        (folder / name).touch()
    found = find_descriptions(load_profile(path), path, (other,))
    assert found == {"chassis": (path.parent / "a.dbc", other / "b.dbc"), "body": (other / "c.kcd",)}
    with pytest.raises(ProfileError, match=r"no description 'd.dbc' in .*description_folders"):
        find_description("d.dbc", path, (other,))


def test_sign_factor_and_offset_come_after_the_unit() -> None:
    scale, offset = transform("km/h", FieldRule(signal="X", unit="m/s", sign=-1, factor=2.0, offset=1.5))
    assert (36.0 * scale + offset) == pytest.approx(-18.5)


def test_a_unit_given_in_the_profile_overrides_the_description() -> None:
    scale, _ = transform("", FieldRule(signal="X", unit="m/s", dbc_unit="km/h"))
    assert scale == pytest.approx(1 / 3.6)

"""A byte order mark, as editors write it, is no part of a text file."""

from pathlib import Path

from drivemcp.files.bus_description import load_description
from drivemcp.files.models import load_table
from drivemcp.paths import data
from services.can.profiles.profile import load_profile


def marked(path: Path, source: Path) -> Path:
    path.write_text(source.read_text(encoding="utf-8"), encoding="utf-8-sig")
    return path


def test_a_profile_and_a_bus_description_are_read_behind_a_mark(tmp_path: Path) -> None:
    profile = data("vehicles/sim/profile.toml")
    assert load_profile(marked(tmp_path / "profile.toml", profile)) == load_profile(profile)
    dbc = data("vehicles/sim/sim.dbc")
    names = [message.name for message in load_description(marked(tmp_path / "sim.dbc", dbc)).messages]
    assert names == [message.name for message in load_description(dbc).messages]


def test_a_users_table_of_models_is_read_behind_a_mark(tmp_path: Path) -> None:
    row = 'file = "own.onnx"\npublisher = "p"\nlicence = "l"\ngood_for = "g"\ninput = "i"\nclasses = "c"\nurl = "https://x"\n'
    (tmp_path / "table.toml").write_text(f'[own]\n{row}sha256 = "{"0" * 64}"\nsize_bytes = 1\n', encoding="utf-8-sig")
    assert "own" in load_table(tmp_path)

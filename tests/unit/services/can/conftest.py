"""The simulated car's description, loaded once."""

import re
from pathlib import Path

import pytest

from drivemcp.paths import data
from services.can.diagnostics.trouble_codes import DtcBook
from services.can.profiles.dbc import Dbc
from services.can.profiles.profile import Profile, load_profile


@pytest.fixture(scope="session")
def dbc_path() -> Path:
    return data("vehicles/sim/sim.dbc")


@pytest.fixture(scope="session")
def dbc(dbc_path: Path) -> Dbc:
    return Dbc(dbc_path)


@pytest.fixture(scope="session")
def profile() -> Profile:
    return load_profile(data("vehicles/sim/profile.toml"))


@pytest.fixture(scope="session")
def patient(dbc_path: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    """The simulated car's profile, but for ages: on a machine that stalls no value is unknown for being late."""
    text = data("vehicles/sim/profile.toml").read_text(encoding="utf-8")
    text = text.replace('description = "sim.dbc"', f'description = "{dbc_path}"')
    path = tmp_path_factory.mktemp("patient") / "profile.toml"
    path.write_text(re.sub(r"max_age_s = [\d.]+", "max_age_s = 600.0", text), encoding="utf-8")
    return str(path)


@pytest.fixture(scope="session")
def book() -> DtcBook:
    return DtcBook.load(data("vehicles/dtc.toml"))

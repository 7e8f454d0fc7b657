"""The simulated car's description, loaded once."""

from pathlib import Path

import pytest

from drivemcp.paths import data
from services.can.dbc import Dbc
from services.can.dtc import DtcBook
from services.can.profile import Profile, load_profile


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
def book() -> DtcBook:
    return DtcBook.load(data("vehicles/dtc.toml"))

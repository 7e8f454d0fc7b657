"""The rule books that the tests ask."""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from drivemcp.paths import data
from services.rules.book import RuleBook, load_book
from tests.unit.services.rules.quotes import every_quotation_checked

PACKS = ("DEU-v1", "DEU-v1-VSL", "GBR-v1")


@pytest.fixture(scope="session", autouse=True)
def quotations() -> Iterator[None]:
    """No answer of any test here cites what does not stand at the offsets it names."""
    with every_quotation_checked():
        yield


@pytest.fixture(scope="session")
def book() -> RuleBook:
    loaded, refused = load_book([data(f"rulepacks/{name}") for name in PACKS])
    assert refused == ()
    return loaded


@pytest.fixture
def copy_pack(tmp_path: Path) -> Callable[[str], Path]:
    def copy(name: str) -> Path:
        return Path(shutil.copytree(data(f"rulepacks/{name}"), tmp_path / name))

    return copy

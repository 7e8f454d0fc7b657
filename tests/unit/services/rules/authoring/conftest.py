"""A small pack of one's own, to break and to change."""

from pathlib import Path

import pytest

from tests.unit.services.rules.editing import adopted


@pytest.fixture
def pack(tmp_path: Path) -> Path:
    adopted(tmp_path / "ITA-v1", "ITA")
    return tmp_path / "ITA-v1"

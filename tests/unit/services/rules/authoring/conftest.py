"""A small pack of one's own, to break and to change."""

from pathlib import Path

import pytest

from services.rules.authoring.scaffold import scaffold


@pytest.fixture
def pack(tmp_path: Path) -> Path:
    scaffold(tmp_path / "ITA-v1", "ITA")
    return tmp_path / "ITA-v1"

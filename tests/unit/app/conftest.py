"""The logger's small log files."""

from pathlib import Path

import pytest

from services.logger.format import signing
from services.logger.verification import trust
from tests.unit.services.logger.conftest import closed_log, signer, unclosed

__all__ = ["closed_log", "signer", "unclosed"]


@pytest.fixture
def trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, signer: signing.Signer) -> Path:
    """A trust file of this user that names the key of the test logs."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    trust.add(trust.own_file(), trust.Trusted(public_key=signer.public_hex, since="2026-01-02"))
    return trust.own_file()

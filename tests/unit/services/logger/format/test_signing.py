"""The key that signs the log."""

import errno
import os
from pathlib import Path
from typing import Any

import pytest

from services.logger.format import signing


def test_the_key_is_made_once_for_its_owner_alone(tmp_path: Path) -> None:
    made = signing.load_or_make(tmp_path / "secrets")
    assert signing.load_or_make(tmp_path / "secrets").key_id == made.key_id
    assert sorted(path.name for path in (tmp_path / "secrets").iterdir()) == ["log-key.pem", "log-key.pub"]
    assert (tmp_path / "secrets" / "log-key.pem").stat().st_mode & 0o777 == 0o600
    assert (tmp_path / "secrets" / "log-key.pub").read_text().strip() == made.public_hex


def test_a_disk_that_was_full_leaves_nothing_and_the_key_is_made_once_there_is_space(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(number: int, *_: Any) -> Any:
        os.close(number)
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(os, "fdopen", full)
        with pytest.raises(OSError, match="No space"):
            signing.load_or_make(tmp_path)
    assert list(tmp_path.iterdir()) == []
    assert signing.load_or_make(tmp_path).public_hex

"""How the system behaves today, as one digest: the behaviour lock's."""

import hashlib
from functools import cache
from importlib.metadata import version
from pathlib import Path

LOCK = Path(__file__).parents[2] / "tests" / "replay" / "lock.json"
"""Digests of what the locked drives decide (`make replay`). Absent in an installed wheel."""


@cache
def behaviour() -> str:
    """The first 12 hex digits of the lock's SHA-256; the project's version where there is no lock."""
    if LOCK.is_file():
        return hashlib.sha256(LOCK.read_bytes()).hexdigest()[:12]
    return version("drivemcp")

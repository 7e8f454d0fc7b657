"""The arbiter's own small file: what feedback has moved, and what was braked recently, kept between drives and restarts."""

import os
from pathlib import Path

import msgspec

from drivemcp.errors import MALFORMED
from services.arbiter.memory.adapt import within_bounds
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import Adapted, Owed


class Stored(msgspec.Struct, frozen=True, kw_only=True):
    """The file's content; values learnt under one profile say nothing under another."""

    profile: str
    delta: float
    c_min: float
    owed: Owed = Owed()


def load(path: Path, profile: Profile) -> Adapted:
    """What the file says, within bounds; the calibrated values where the file is missing or damaged."""
    calibrated = Adapted(delta=profile.delta, c_min=profile.c_min)
    stored = _read(path)
    if stored is None or stored.profile != profile.name:
        return calibrated
    return within_bounds(Adapted(delta=stored.delta, c_min=stored.c_min), profile)


def load_owed(path: Path) -> Owed:
    """What braking before the restart still counts for, under whichever profile; nothing where there is no file."""
    stored = _read(path)
    return stored.owed if stored is not None else Owed()


def _read(path: Path) -> Stored | None:
    try:
        return msgspec.json.decode(path.read_bytes(), type=Stored)
    except (OSError, *MALFORMED):
        return None


def save(path: Path, adapted: Adapted, profile: Profile, owed: Owed = Owed()) -> None:
    """Write beside and rename: a cut never leaves half a file. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_suffix(".new")
    stored = Stored(profile=profile.name, delta=adapted.delta, c_min=adapted.c_min, owed=owed)
    beside.write_bytes(msgspec.json.encode(stored, order="sorted"))
    os.replace(beside, path)

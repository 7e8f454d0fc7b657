"""The arbiter's own small file: what feedback has moved, kept between drives."""

import os
from pathlib import Path

import msgspec

from drivemcp.errors import MALFORMED
from services.arbiter.memory.adapt import within_bounds
from services.arbiter.profiles.profile import Profile
from services.arbiter.state import Adapted


class Stored(msgspec.Struct, frozen=True, kw_only=True):
    """The file's content; values learnt under one profile say nothing under another."""

    profile: str
    delta: float
    c_min: float


def load(path: Path, profile: Profile) -> Adapted:
    """What the file says, within bounds; the calibrated values where there is none or it is damaged."""
    calibrated = Adapted(delta=profile.delta, c_min=profile.c_min)
    try:
        stored = msgspec.json.decode(path.read_bytes(), type=Stored)
    except (OSError, *MALFORMED):
        return calibrated
    if stored.profile != profile.name:
        return calibrated
    return within_bounds(Adapted(delta=stored.delta, c_min=stored.c_min), profile)


def save(path: Path, adapted: Adapted, profile: Profile) -> None:
    """Write beside and rename: a cut never leaves half a file. Raises OSError."""
    path.parent.mkdir(parents=True, exist_ok=True)
    beside = path.with_suffix(".new")
    beside.write_bytes(
        msgspec.json.encode(Stored(profile=profile.name, delta=adapted.delta, c_min=adapted.c_min), order="sorted")
    )
    os.replace(beside, path)

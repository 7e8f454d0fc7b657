"""The trust file: whose keys may sign logs. A line a key: vehicle (`*`: any), public key (hex), since when, a note."""

import os
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

import msgspec

from drivemcp.paths import own_state
from proto.keys import chunk

ANY = "*"
_KEY = re.compile(r"[0-9a-f]{64}")
Standing = Literal["known", "unknown", "changed since"]


class Trusted(msgspec.Struct, frozen=True, kw_only=True):
    """One line of it."""

    public_key: str
    vehicle: str = ANY
    since: str = ""
    note: str = ""


class Judgement(msgspec.Struct, frozen=True, kw_only=True):
    """What a trust file says of the key of a log. `since`: when the line that decides was added."""

    standing: Standing
    since: str = ""

    def __str__(self) -> str:
        return f"{self.standing} {self.since}".rstrip() if self.standing == "changed since" else self.standing


def own_file() -> Path:
    """This user's trust file. Raises UserError where the user has no home."""
    return own_state("trusted-log-keys")


def judge(trusted: Sequence[Trusted], vehicle: str, public_key: str) -> Judgement:
    """`known`: a line names the key, for this vehicle or any. `changed since`: the vehicle has lines, all with other keys."""
    mine = [one for one in trusted if one.vehicle in (vehicle, ANY) and one.public_key == public_key]
    if mine:
        return Judgement(standing="known", since=mine[0].since)
    others = [one for one in trusted if one.vehicle == vehicle]
    if others:
        return Judgement(standing="changed since", since=max(one.since for one in others))
    return Judgement(standing="unknown")


def read(path: Path) -> tuple[Trusted, ...]:
    """The lines of a trust file. Raises OSError, and ValueError that names the first line that is damaged."""
    found = []
    for number, line in enumerate(path.read_text(encoding="utf-8-sig").splitlines(), 1):
        fields = line.split("#", 1)[0].split(maxsplit=3)
        if not fields:
            continue
        if len(fields) < 2 or not _KEY.fullmatch(fields[1].lower()):
            raise ValueError(f"line {number} is not a vehicle, a key of 64 hex digits, a date and a note")
        vehicle, key, since, note = (*fields, "", "")[:4]
        found.append(Trusted(vehicle=vehicle, public_key=key.lower(), since=since, note=note.strip()))
    return tuple(found)


def add(path: Path, one: Trusted) -> None:
    """Append a line; today's date unless it has one. Raises OSError, and ValueError for an impossible vehicle or key."""
    if not _KEY.fullmatch(one.public_key) or (one.vehicle != ANY and chunk(one.vehicle) != one.vehicle):
        raise ValueError(f"{one.vehicle!r} and {one.public_key!r} are not a vehicle and a key")
    since = one.since or datetime.now(UTC).strftime("%Y-%m-%d")
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    descriptor = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, 0o600)
    with os.fdopen(descriptor, "a", encoding="utf-8") as file:
        file.write(
            f"{one.vehicle} {one.public_key} {since} {' '.join(one.note.replace('#', ' ').split())}".rstrip() + "\n"
        )

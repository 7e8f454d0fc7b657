"""What may leave the service: curated signals, and the vehicle's identification number only as a salted hash."""

import hashlib
import hmac
import os
import re
import secrets
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import msgspec

from drivemcp.files.bus_description import Key, key_of
from services.can.errors import ProfileError
from services.can.profiles.dbc import Dbc
from services.can.profiles.profile import Profile

SALT_BYTES = 32
Curated = Mapping[str, Mapping[Key, frozenset[str]]]
"""Bus -> message -> its curated signals."""

HELD_BACK = "raw bytes and signals that are not curated: raw_access is off"
VIN_HELD_BACK = "bytes that may spell the vehicle's identification number: allow_vin is off"

VOLTS = frozenset({"v", "mv", "kv", "volt", "volts", "unit_volt"})


class Privacy(msgspec.Struct, frozen=True, kw_only=True):
    """What this installation lets out. Nothing but curated signals by default."""

    salt: bytes
    raw_access: bool = False
    allow_vin: bool = False

    def vin(self, text: str) -> str:
        """The identification number as it may be told: hashed, unless allowed."""
        return text if self.allow_vin else hashed_vin(text, self.salt)


def hashed_vin(vin: str, salt: bytes) -> str:
    """`sha256-salted:` and 64 hex digits: the same car on one installation is the same text, on another one it is not.

    HMAC-SHA-256 (RFC 2104) under the installation's salt. Numbers are few enough to be tried out one by one, so a hash
    without a secret salt would hide nothing.
    """
    return "sha256-salted:" + hmac.new(salt, vin.strip().upper().encode(), hashlib.sha256).hexdigest()


def installation_salt(path: Path | None) -> bytes:
    """The salt kept at `path`; a missing one is made and written for its owner alone. Without a path, a salt for this
    run. Raises ProfileError where the file cannot be read or written or holds something else.
    """
    if path is None:
        return secrets.token_bytes(SALT_BYTES)
    try:
        if not path.exists():
            path.parent.mkdir(parents=True, exist_ok=True)
            with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "wb") as file:
                file.write(secrets.token_bytes(SALT_BYTES))
        salt = path.read_bytes()
    except OSError as error:
        raise ProfileError(f"vin_salt_file {path}: {error.strerror}") from error
    if len(salt) != SALT_BYTES:
        raise ProfileError(f"vin_salt_file {path}: {len(salt)} bytes, not {SALT_BYTES}")
    return salt


def curated_signals(profile: Profile, descriptions: Mapping[str, Dbc]) -> Curated:
    """The signals that feed a curated field; guards and qualifiers are not among them. Raises ProfileError."""
    found: dict[str, dict[Key, frozenset[str]]] = {bus: {} for bus in descriptions}
    for rule in profile.fields.values():
        bus = profile.bus_of(rule) if len(descriptions) > 1 else next(iter(descriptions))
        message, _ = descriptions[bus].signal(rule.signals[0], rule.message)
        names = found[bus].get(key_of(message), frozenset())
        found[bus][key_of(message)] = names | {*rule.signals, *filter(None, (rule.negative_if,))}
    return found


def spells_vin(message: Any) -> bool:
    """Whether a message says by its name or a signal's that it holds the identification number, as text, not as a voltage `Vin`."""
    carriers = [signal.name for signal in message.signals if not _is_measured(signal)]
    names = (message.name, *carriers) if carriers or not message.signals else ()
    return any("vin" in re.findall(r"[a-z]+", re.sub(r"(?<=[a-z0-9])(?=[A-Z])", " ", name).lower()) for name in names)


def held_back(privacy: Privacy, hidden: Iterable[str]) -> str:
    """What is not told, in words; `hidden`: the messages that may spell the identification number."""
    if not privacy.raw_access:
        return HELD_BACK
    names = ", ".join(sorted(set(hidden)))
    return f"{VIN_HELD_BACK}: {names}" if names else ""


def _is_measured(signal: Any) -> bool:
    """Whether a signal is a number with a unit: scaled, or in volts; the identification number is 17 letters and digits."""
    unit = str(signal.unit or "").strip().lower()
    return bool(unit) and (
        unit in VOLTS or signal.is_float or (signal.conversion.scale, signal.conversion.offset) != (1, 0)
    )

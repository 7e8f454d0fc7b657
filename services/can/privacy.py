"""What may leave the service: curated signals, and the vehicle's identification number only as a salted hash."""

import hashlib
import hmac
import os
import secrets
from pathlib import Path

import msgspec

from services.can.errors import ProfileError
from services.can.profile import Profile

SALT_BYTES = 32
HELD_BACK = "raw bytes and signals that are not curated: raw_access is off"


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
    """The salt kept at `path`, made and written for its owner alone where there is none; without a path one for this
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


def curated_signals(profile: Profile) -> frozenset[str]:
    """The signals, by name, that feed a curated field; guards and qualifiers are not among them."""
    return frozenset(name for rule in profile.fields.values() for name in (*rule.signals, rule.negative_if) if name)

"""Grants: permission to actuate, signed out of band. Ed25519 over the grant's canonical JSON without its signature.

cryptography is imported when a grant is made or checked, never before: a service without one does not pay for it.
"""

import base64
import hashlib
import secrets
import threading
import time
from collections.abc import Callable, Iterable
from datetime import UTC, datetime, timedelta
from typing import NamedTuple

import msgspec

from drivemcp.errors import MALFORMED, UserError
from proto.decision import Grant

LONGEST = timedelta(hours=24)
"""No grant is valid for longer, whichever key signed it."""
CONFIRM_WITHIN_S = 60.0
"""How long a command waits to be confirmed."""
MOST_WAITING = 64


class GrantRefused(UserError, PermissionError):
    """A grant that does not count: unsigned, altered, for another vehicle or capability, expired, by an unknown key."""


class KeyPair(NamedTuple):
    """A signing key; both halves raw and base64-encoded."""

    private: str
    public: str


def make_key() -> KeyPair:
    """A new key pair; the private half stays with the person who grants, the public half goes into `trusted_keys`."""
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    key = Ed25519PrivateKey.generate()
    return KeyPair(_b64(key.private_bytes_raw()), _b64(key.public_key().public_bytes_raw()))


def key_id(public: str) -> str:
    """The first 16 hex digits of the public key's SHA-256."""
    return hashlib.sha256(_unb64(public)).hexdigest()[:16]


def public_key(text: str) -> str:
    """`text` if it is a public key; raises GrantRefused."""
    if len(_unb64(text)) != 32:
        raise GrantRefused("this is no public key: 32 bytes in base64, as `drivemcp grant --make-key` prints it")
    return text


def canonical(grant: Grant) -> bytes:
    """What is signed: the fields sorted by name, without `signature`; and without `envelope` where it is `soft`.

    A grant that names no envelope has the bytes of a soft one. One for emergencies has others, so that no signed grant can be
    widened.
    """
    fields = msgspec.to_builtins(grant)
    del fields["signature"]
    if grant.envelope == "soft":
        del fields["envelope"]
    return msgspec.json.encode(fields, order="sorted")


def sign_grant(grant: Grant, private: str) -> Grant:
    """The grant with key id and signature; raises GrantRefused on bounds or times that no receiver would take."""
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    _check_bounds(grant)
    try:
        key = Ed25519PrivateKey.from_private_bytes(_unb64(private))
    except ValueError:
        raise GrantRefused(
            "this is no private key: 32 bytes in base64, as `drivemcp grant --make-key` writes it"
        ) from None
    named = msgspec.structs.replace(grant, key_id=key_id(_b64(key.public_key().public_bytes_raw())))
    return msgspec.structs.replace(named, signature=_b64(key.sign(canonical(named))))


def verify_grant(grant: Grant, trusted: Iterable[str], *, vehicle: str, capability: str, now: datetime) -> None:
    """Raise GrantRefused unless a trusted key signed exactly this, for this vehicle and capability, and it is in time."""
    from cryptography.exceptions import InvalidSignature
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

    public = next((key for key in trusted if key_id(key) == grant.key_id), None)
    if public is None:
        raise GrantRefused(f"grant {grant.grant_id!r} is signed by no trusted key")
    try:
        Ed25519PublicKey.from_public_bytes(_unb64(public)).verify(_unb64(grant.signature), canonical(grant))
    except InvalidSignature:
        raise GrantRefused(f"grant {grant.grant_id!r} was altered after it was signed") from None
    if grant.vehicle != vehicle or grant.capability != capability:
        raise GrantRefused(f"grant {grant.grant_id!r} is for {grant.capability} of {grant.vehicle}")
    _check_bounds(grant)
    if not in_time(grant, now):
        raise GrantRefused(f"grant {grant.grant_id!r} is valid from {grant.issued_at} to {grant.expires_at}")


def in_time(grant: Grant, now: datetime) -> bool:
    """Whether `now` (with time zone) lies between issue and expiry."""
    return _time(grant.issued_at) <= now < _time(grant.expires_at)


def read_grant(data: bytes) -> Grant:
    """A grant file; raises GrantRefused."""
    try:
        return msgspec.json.decode(data, type=Grant)
    except MALFORMED as error:
        raise GrantRefused(f"this is no grant: {error}") from None


def _check_bounds(grant: Grant) -> None:
    if not (0.0 < grant.max_deceleration_mps2 <= 10.0 and 0.0 < grant.max_duration_s <= 30.0):
        raise GrantRefused(f"grant {grant.grant_id!r}: bounds must lie in (0, 10] m/s^2 and (0, 30] s")
    if _time(grant.issued_at) >= _time(grant.expires_at):
        raise GrantRefused(f"grant {grant.grant_id!r} expires before it is issued")
    if _time(grant.expires_at) - _time(grant.issued_at) > LONGEST:
        raise GrantRefused(f"grant {grant.grant_id!r} is for more than {LONGEST / timedelta(hours=1):.0f} hours")
    if grant.sequence < 0:
        raise GrantRefused(f"grant {grant.grant_id!r} has a sequence below 0")


def _time(text: str) -> datetime:
    try:
        time = datetime.fromisoformat(text)
    except ValueError:
        raise GrantRefused(f"{text!r} is no ISO 8601 time") from None
    return time if time.tzinfo is not None else time.replace(tzinfo=UTC)


def _b64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def _unb64(text: str) -> bytes:
    try:
        return base64.b64decode(text, validate=True)
    except ValueError:
        raise GrantRefused("what should be a key or a signature is no base64 text") from None


class Confirmations:
    """Commands that wait to be confirmed. Each is asked for with a nonce of its own, and confirmed once, within a minute."""

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self._now_s = now_s
        self._lock = threading.Lock()
        self._due_s: dict[str, float] = {}

    def ask(self, tool: str, payload: bytes) -> str:
        """What a caller has to repeat. Of more than `MOST_WAITING` the oldest are forgotten."""
        text = confirmation_of(tool, payload, secrets.token_hex(16))
        with self._lock:
            self._due_s[text] = self._now_s() + CONFIRM_WITHIN_S
            while len(self._due_s) > MOST_WAITING:
                del self._due_s[next(iter(self._due_s))]
        return text

    def take(self, tool: str, payload: bytes, confirmation: str) -> bool:
        """Whether exactly this command was asked for and waits; it does not wait any longer then."""
        if not confirmation.startswith(confirmation_of(tool, payload, "")):
            return False
        with self._lock:
            due_s = self._due_s.pop(confirmation, None)
        return due_s is not None and self._now_s() < due_s


def confirmation_of(tool: str, payload: bytes, nonce: str) -> str:
    """What confirms one command: the tool, the SHA-256 of its arguments as sent, and the server's nonce."""
    return f"{tool} {hashlib.sha256(payload).hexdigest()} {nonce}"

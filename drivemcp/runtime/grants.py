"""Grants: permission to actuate, signed out of band. Ed25519 over the grant's canonical JSON without its signature.

cryptography is imported when a grant is made or checked, never before: a service without one does not pay for it.
"""

import base64
import hashlib
from collections.abc import Iterable
from datetime import UTC, datetime
from typing import NamedTuple

import msgspec

from drivemcp.errors import MALFORMED, UserError
from proto.decision import Grant
from proto.tools import CallHead


class GrantRefused(UserError, PermissionError):
    """A grant that does not count: unsigned, altered, for another vehicle or capability, expired, by an unknown key."""


class KeyPair(NamedTuple):
    """A signing key; both halves raw and base64-encoded."""

    private: str
    public: str


def make_key() -> KeyPair:
    """A new key pair; the private half stays with whoever grants, the public half goes into `trusted_keys`."""
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
    """What is signed: the fields sorted by name, without `signature`."""
    fields = msgspec.to_builtins(grant)
    del fields["signature"]
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


def authorize_call(tool: str, head: CallHead, payload: bytes, *, vehicle: str, trusted_keys: Iterable[str]) -> str:
    """Why a call of an actuation tool is refused; empty: a grant names it, and the call confirms this very command."""
    if head.confirmation != confirmation_of(tool, payload):
        return f"confirm this very command: confirmation must be {confirmation_of(tool, payload)!r}"
    try:
        grant = read_grant(head.grant.encode())
        verify_grant(grant, trusted_keys, vehicle=vehicle, capability=f"tool:{tool}", now=datetime.now(UTC))
    except GrantRefused as error:
        return str(error)
    return ""


def confirmation_of(tool: str, payload: bytes) -> str:
    """What a caller must repeat to confirm one command: the tool and the SHA-256 of its arguments as sent."""
    return f"{tool} {hashlib.sha256(payload).hexdigest()}"

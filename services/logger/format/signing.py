"""The key that signs heads: Ed25519, made at set-up, kept where only the logger reads it."""

import hashlib
import os
import tempfile
from pathlib import Path

from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey, Ed25519PublicKey
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    PublicFormat,
    load_pem_private_key,
)

FOLDER = "log-keys"
"""Below the user's state folder."""
PRIVATE_NAME = "log-key.pem"
PUBLIC_NAME = "log-key.pub"


class Signer:
    """Signs heads with one private key."""

    def __init__(self, key: Ed25519PrivateKey) -> None:
        self._key = key
        self.public_hex = key.public_key().public_bytes(Encoding.Raw, PublicFormat.Raw).hex()
        self.key_id = key_id(self.public_hex)

    def withholding_key(self) -> bytes:
        """32 bytes that only the holder of the private key knows: for hashes of what a log leaves out."""
        raw = self._key.private_bytes(Encoding.Raw, PrivateFormat.Raw, NoEncryption())
        return hashlib.sha256(b"drivemcp withheld 1\0" + raw).digest()

    def sign(self, data: bytes) -> str:
        """The signature, hex."""
        return self._key.sign(data).hex()


def key_id(public_hex: str) -> str:
    """The short name of a public key: 16 hex digits of its SHA-256."""
    return hashlib.sha256(bytes.fromhex(public_hex)).hexdigest()[:16]


def signature_holds(public_hex: str, data: bytes, signature_hex: str) -> bool:
    """Whether the signature is the key's; False also for what is no key or no signature."""
    try:
        Ed25519PublicKey.from_public_bytes(bytes.fromhex(public_hex)).verify(bytes.fromhex(signature_hex), data)
    except (InvalidSignature, ValueError):
        return False
    return True


def load_or_make(directory: Path) -> Signer:
    """The signer of the key in `directory`, made there at first use (mode 0600). Raises OSError, ValueError."""
    path = directory / PRIVATE_NAME
    if not path.exists():
        _make(directory)
    key = load_pem_private_key(path.read_bytes(), password=None)
    if not isinstance(key, Ed25519PrivateKey):
        raise ValueError(f"{path} holds no Ed25519 key; move it away and a new one is made")
    return Signer(key)


def _make(directory: Path) -> None:
    directory.mkdir(parents=True, exist_ok=True, mode=0o700)
    key = Ed25519PrivateKey.generate()
    pem = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    number, scratch = tempfile.mkstemp(prefix=f".{PRIVATE_NAME}.", dir=directory)  # mode 0600
    try:
        with os.fdopen(number, "wb") as file:
            file.write(pem)
        os.link(scratch, directory / PRIVATE_NAME)  # first of two that start at once wins; the other reads its key
    except FileExistsError:
        pass
    else:
        (directory / PUBLIC_NAME).write_text(Signer(key).public_hex + "\n", encoding="ascii")
    finally:
        os.unlink(scratch)

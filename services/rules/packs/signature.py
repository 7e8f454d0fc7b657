"""A pack's signature: Ed25519 over its id, version and content hash, by a key of `drivemcp grant --make-key`."""

import base64
from collections.abc import Iterator
from pathlib import Path

import msgspec

from drivemcp.runtime.grants import key_id, public_key
from services.rules.errors import PackError, Problem
from services.rules.packs.files import SIGNATURE, Files, decoded, read_files
from services.rules.packs.format import Hash, Manifest, PackId, Version


class Signature(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """`signature.json`: who vouches for which content."""

    pack_id: PackId
    version: Version
    content_sha256: Hash
    public_key: str
    """Base64, 32 bytes."""
    signature: str
    """Base64."""


class Trust(msgspec.Struct, frozen=True, kw_only=True):
    """Whose signatures count, and whether a pack without one is refused."""

    keys: tuple[str, ...] = ()
    required: bool = False


def sign(folder: Path, private: str) -> Signature:
    """Sign a sealed pack with a private key (base64) and write `signature.json`. Raises PackError."""
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    files = read_files(folder)
    for problem in files.unread():
        raise PackError(str(problem))
    manifest, problems = decoded(files, "manifest.json", Manifest)
    if problems:
        raise PackError(str(problems[0]))
    if files.sha256() != manifest.content_sha256:
        raise PackError(f"{folder}: the content hash does not fit the content: drivemcp rulepack seal {folder}")
    try:
        key = Ed25519PrivateKey.from_private_bytes(base64.b64decode(private, validate=True))
    except ValueError:
        raise PackError(
            "this is no private key: 32 bytes in base64, as `drivemcp grant --make-key` writes it"
        ) from None
    made = Signature(
        pack_id=manifest.id,
        version=manifest.version,
        content_sha256=manifest.content_sha256,
        public_key=base64.b64encode(key.public_key().public_bytes_raw()).decode(),
        signature=base64.b64encode(key.sign(signed(manifest))).decode(),
    )
    (folder / SIGNATURE).write_bytes(msgspec.json.format(msgspec.json.encode(made), indent=1) + b"\n")
    return made


def signed(manifest: Manifest) -> bytes:
    """What is signed; the purpose keeps a signature from counting as anything else."""
    said = {
        "purpose": "drivemcp rulepack",
        "pack_id": manifest.id,
        "version": manifest.version,
        "content_sha256": manifest.content_sha256,
    }
    return msgspec.json.encode(said, order="sorted")


def check_signature(files: Files, manifest: Manifest, trust: Trust) -> Iterator[Problem]:
    """A signature that is there must hold; with `required` it must be there, and by a trusted key."""
    sign_again = f"sign it again: drivemcp rulepack sign {files.folder} --key FILE"
    if SIGNATURE not in files.content:
        if trust.required and SIGNATURE not in files.refused:
            yield Problem(
                file=files.folder / SIGNATURE,
                message="a signature is required, and the pack has no signature",
                remedy=sign_again.replace(" again", ""),
            )
        return
    found, problems = decoded(files, SIGNATURE, Signature)
    yield from problems
    if found is None:
        return
    about = (found.pack_id, found.version, found.content_sha256)
    if about != (manifest.id, manifest.version, manifest.content_sha256):
        yield files.problem(
            SIGNATURE, ("content_sha256",), "signs another content", f"{sign_again}, or remove the file"
        )
    elif not _holds(found, manifest):
        yield files.problem(
            SIGNATURE, ("signature",), "does not hold: it was altered, or is not this key's", sign_again
        )
    elif trust.required and found.public_key not in trust.keys:
        message = f"key {key_id(found.public_key)} is not trusted here"
        yield files.problem(
            SIGNATURE, ("public_key",), message, "sign it with a trusted key, or name this key as trusted"
        )


def _holds(found: Signature, manifest: Manifest) -> bool:
    from cryptography.exceptions import InvalidSignature
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

    try:
        key = Ed25519PublicKey.from_public_bytes(_bytes(public_key(found.public_key)))
        key.verify(_bytes(found.signature), signed(manifest))
    except (InvalidSignature, ValueError):  # GrantRefused is a ValueError
        return False
    return True


def _bytes(text: str) -> bytes:
    """Base64 as we write it: no other spelling of the same bytes."""
    found = base64.b64decode(text, validate=True)
    if base64.b64encode(found).decode() != text:
        raise ValueError("not as it was written")
    return found

"""Time stamps of heads by RFC 3161: an authority elsewhere signs that a head was there at a time. Pure: bytes in, words out.

The text that is stamped is the one that the log signs, so that any tool checks it: `printf 'drivemcp-chain-1 head HEAD' |
openssl ts -verify -data /dev/stdin -in TOKEN -CAfile ROOT`.
"""

import hashlib
from collections.abc import Mapping, Sequence
from datetime import UTC
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from services.logger.format import chain

if TYPE_CHECKING:  # the libraries are loaded where there is a stamp: every command would wait for them
    from cryptography.x509 import Certificate

SUFFIX = ".tsr"
FAILED = ".tsr-failed"
"""Beside a log: why its newest head has no stamp."""


class Stamp(msgspec.Struct, frozen=True, kw_only=True):
    """What one time stamp comes to. Without a `problem` it holds for the first `messages` messages of its log."""

    file: str
    time: str = ""
    by: str = ""
    messages: int = 0
    problem: str = ""
    contradicts: bool = False
    """It is genuine, and of a head that the log does not have."""

    def __str__(self) -> str:
        said = f"{self.time} by {self.by}" if self.time else self.file
        return f"{said}: {self.problem}" if self.problem else said


def beside(log: Path) -> list[Path]:
    """The time stamps of a log, in the order of its heads."""
    return sorted(log.parent.glob(f"{log.name}.*{SUFFIX}"))


def refused(log: Path) -> str:
    """Why the newest head that a stamp was asked for has none; empty: it has one, or none was asked for."""
    try:
        return " ".join(log.with_name(log.name + FAILED).read_text(encoding="utf-8", errors="replace").split())[:300]
    except OSError:
        return ""


def imprint(head: str) -> str:
    """What a stamp holds of a head, as hex."""
    return hashlib.sha256(chain.signed_text(head)).hexdigest()


def query(head: str) -> tuple[bytes, int]:
    """The request for a stamp of a head, and the number that the answer must repeat."""
    from rfc3161_client import HashAlgorithm, TimestampRequestBuilder

    built = TimestampRequestBuilder().data(chain.signed_text(head)).hash_algorithm(HashAlgorithm.SHA256).build()
    assert built.nonce is not None
    return built.as_bytes(), built.nonce


def refusal(answer: bytes, head: str, nonce: int) -> str:
    """Why an authority's answer is not a stamp of this head for this request; empty: it is one, whatever its signer."""
    from rfc3161_client import decode_timestamp_response

    try:
        response = decode_timestamp_response(answer)
        if response.status != 0:
            return "it refused: " + ("; ".join(response.status_string) or f"status {response.status}")
        said = response.tst_info
    except ValueError:
        return "its answer is no time stamp"
    if said.nonce != nonce or said.message_imprint.message.hex() != imprint(head):
        return "its answer is to another request"
    return ""


def imprint_of(token: bytes) -> str:
    """What a token stamps, as hex; empty for bytes that are no token."""
    from rfc3161_client import decode_timestamp_response

    try:
        return decode_timestamp_response(token).tst_info.message_imprint.message.hex()
    except ValueError:
        return ""


def checked_roots(pem: bytes) -> bytes:
    """Root certificates, unchanged. Raises ValueError for bytes without a certificate."""
    from cryptography import x509

    x509.load_pem_x509_certificates(pem)
    return pem


def judge(file: str, token: bytes, heads: Mapping[str, int], roots: bytes) -> Stamp:
    """Whether a token is genuine, and of which head. `heads`: by imprint, how many messages lie before a head of the log.

    `roots`: certificates in PEM, as `checked_roots` takes them.
    """
    from cryptography import x509
    from rfc3161_client import VerificationError, VerifierBuilder, decode_timestamp_response

    try:
        response = decode_timestamp_response(token)
        if response.status != 0:
            raise ValueError("refused")
        said, signers = response.tst_info, response.signed_data.signer_infos
        stamped, time = said.message_imprint.message, said.gen_time.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
        certificates = [x509.load_der_x509_certificate(one) for one in response.signed_data.certificates]
        serials = {signer.serial_number for signer in signers}
        by = next((_name(one) for one in certificates if one.serial_number in serials), "")
    except (ValueError, x509.InvalidVersion):  # also by a field that is read only where it is asked for
        return Stamp(file=file, problem="this is no time stamp")
    known = Stamp(file=file, time=time, by=by or "an unknown authority", messages=heads.get(stamped.hex(), 0))
    if not roots:
        return msgspec.structs.replace(known, problem="not verified without a root certificate (--tsa-root)")
    try:
        VerifierBuilder(roots=x509.load_pem_x509_certificates(roots)).build().verify(response, stamped)
    except VerificationError as error:
        return msgspec.structs.replace(known, problem=f"not of an authority of the given root: {error}")
    if stamped.hex() not in heads:
        return msgspec.structs.replace(known, problem="of a head that this log does not have", contradicts=True)
    return known


def _name(certificate: "Certificate") -> str:
    from cryptography.x509.oid import NameOID

    names: Sequence[str] = [str(one.value) for one in certificate.subject.get_attributes_for_oid(NameOID.COMMON_NAME)]
    return " ".join((names[0] if names else certificate.subject.rfc4514_string()).split())

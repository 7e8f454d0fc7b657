"""Certificates of a bus between hosts: an authority of its own, and a short-lived certificate for each member that it signs.

Everything overlaps. A certificate is renewed with half its life left, and both serve until the old one ends. An authority signs
only once it has been in every member's `ca.pem` for one life of a certificate, and stays there until its own end.
"""

from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from ipaddress import ip_address
from pathlib import Path
from secrets import token_hex
from typing import NamedTuple

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat, load_pem_private_key
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from drivemcp.bus.tls import AUTHORITY, OWN
from drivemcp.errors import UserError
from drivemcp.files.modes import write_private

ROUTER = "router"
LIFE = timedelta(days=30)
AUTHORITY_LIFE = timedelta(days=1826)
_EARLIER = timedelta(hours=1)
"""Valid from before it was made: clocks of hosts differ."""


class Pair(NamedTuple):
    """A certificate and its key."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey

    def pem(self) -> str:
        """Both, as one file."""
        private = self.key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
        return (self.certificate.public_bytes(Encoding.PEM) + private).decode()


class Member(NamedTuple):
    """What a member's certificate came to."""

    name: str
    ends: datetime
    renewed: bool


def write_certificates(
    folder: Path,
    authority: Path,
    members: Iterable[str],
    names: tuple[str, ...] = (),
    *,
    life: timedelta = LIFE,
    renew: bool = False,
    now: datetime | None = None,
) -> list[Member]:
    """`<member>/ca.pem` and `<member>/tls.pem`; what lasts is kept, unless `renew`. `authority`: the folder of its keys.

    `names`: hosts and addresses at which the router is reached; empty: those of its last certificate. Raises UserError.
    """
    now = now or datetime.now(UTC)
    apart(folder, authority)
    known = _authorities(authority, life, now)
    bundle = "".join(pair.certificate.public_bytes(Encoding.PEM).decode() for pair in known)
    settled = [pair for pair in known if now - pair.certificate.not_valid_before_utc >= life + _EARLIER]
    signer = settled[-1] if settled else known[0]
    found = []
    for member in members:
        file = folder / member / OWN
        last = _read(file) if file.exists() else None
        wanted = (names or router_names(folder)) if member == ROUTER else ()
        kept = last is not None and not renew and _lasts(last.certificate, wanted, known, now)
        pair = last if kept and last is not None else _signed(signer, member, wanted, life, now)
        if not kept:
            write_private(file, pair.pem())
        if not (folder / member / AUTHORITY).exists() or (folder / member / AUTHORITY).read_text("ascii") != bundle:
            write_private(folder / member / AUTHORITY, bundle)
        found.append(Member(member, pair.certificate.not_valid_after_utc, not kept))
    return found


def router_names(folder: Path) -> tuple[str, ...]:
    """The names in the router's certificate; none without one."""
    file = folder / ROUTER / OWN
    return _names(_read(file).certificate) if file.exists() else ()


def apart(folder: Path, authority: Path) -> None:
    """Raises UserError where the authority's keys would lie among what hosts are given."""
    hosts, keys = folder.resolve(), authority.resolve()
    if hosts == keys or hosts in keys.parents or keys in hosts.parents:
        raise UserError(
            f"the authority's keys ({authority}) belong apart from what hosts are given ({folder}): --ca FOLDER"
        )


def _authorities(folder: Path, life: timedelta, now: datetime) -> list[Pair]:
    """Those that have not ended, the oldest first; a new one where the newest ends soon."""
    found = [
        pair for file in sorted(folder.glob("*.pem")) if (pair := _read(file)).certificate.not_valid_after_utc > now
    ]
    found.sort(key=lambda pair: pair.certificate.not_valid_before_utc)
    if not found or found[-1].certificate.not_valid_after_utc - now < 3 * life:
        found.append(_authority(now))
        write_private(folder / f"{now:%Y%m%d}-{token_hex(4)}.pem", found[-1].pem())
    return found


def _authority(now: datetime) -> Pair:
    key = ec.generate_private_key(ec.SECP256R1())
    usage = x509.KeyUsage(
        digital_signature=False, content_commitment=False, key_encipherment=False, data_encipherment=False,
        key_agreement=False, key_cert_sign=True, crl_sign=True, encipher_only=False, decipher_only=False,
    )  # fmt: skip
    name = _called(f"drivemcp bus {now:%Y-%m-%d} {token_hex(8)}")
    builder = _begun(None, name, key, now, now + AUTHORITY_LIFE)
    builder = builder.add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
    return Pair(builder.add_extension(usage, critical=True).sign(key, SHA256()), key)


def _signed(signer: Pair, member: str, names: tuple[str, ...], life: timedelta, now: datetime) -> Pair:
    """The router's serves to listen, another's to connect, and neither for the other: no service can pose as the router."""
    if member == ROUTER and not names:
        raise UserError("at which name or address do other hosts reach the router? --tls NAME")
    key = ec.generate_private_key(ec.SECP256R1())
    ends = min(now + life, signer.certificate.not_valid_after_utc)
    builder = _begun(signer, _called(member), key, now, ends)
    builder = builder.add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
    purpose = ExtendedKeyUsageOID.SERVER_AUTH if member == ROUTER else ExtendedKeyUsageOID.CLIENT_AUTH
    builder = builder.add_extension(x509.ExtendedKeyUsage([purpose]), critical=False)
    alternative = x509.SubjectAlternativeName([_general(name) for name in names or (member,)])
    return Pair(builder.add_extension(alternative, critical=False).sign(signer.key, SHA256()), key)


def _begun(
    issuer: Pair | None, subject: x509.Name, key: ec.EllipticCurvePrivateKey, now: datetime, ends: datetime
) -> x509.CertificateBuilder:
    """What an authority's own (no issuer) and a member's have in common."""
    own = x509.SubjectKeyIdentifier.from_public_key(key.public_key())
    signer = own
    if issuer is not None:
        signer = issuer.certificate.extensions.get_extension_for_class(x509.SubjectKeyIdentifier).value
    return (
        x509.CertificateBuilder(
            issuer.certificate.subject if issuer is not None else subject, subject, key.public_key(),
            x509.random_serial_number(), now - _EARLIER, ends,
        )
        .add_extension(own, critical=False)
        .add_extension(x509.AuthorityKeyIdentifier.from_issuer_subject_key_identifier(signer), critical=False)
    )  # fmt: skip


def _lasts(certificate: x509.Certificate, names: tuple[str, ...], known: list[Pair], now: datetime) -> bool:
    """Whether more than half its life is left, its signer is still believed, and its names are those wanted."""
    starts, ends = certificate.not_valid_before_utc + _EARLIER, certificate.not_valid_after_utc
    believed = any(pair.certificate.subject == certificate.issuer for pair in known)
    return ends - now > (ends - starts) / 2 and believed and (not names or set(names) == set(_names(certificate)))


def _names(certificate: x509.Certificate) -> tuple[str, ...]:
    found = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    return tuple(str(one.value) for one in found)


def _general(name: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(name))
    except ValueError:
        pass
    try:
        return x509.DNSName(name)
    except ValueError:
        raise UserError(f"{name!r} is neither a host's name nor an address") from None


def _called(name: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])


def _read(file: Path) -> Pair:
    try:
        data = file.read_bytes()
        key = load_pem_private_key(data, None)
        certificate = x509.load_pem_x509_certificate(data)
    except (ValueError, TypeError):
        raise UserError(f"{file} holds no certificate and key of ours; delete it for a new one") from None
    if not isinstance(key, ec.EllipticCurvePrivateKey):
        raise UserError(f"{file} holds a key of another kind; delete it for a new one")
    return Pair(certificate, key)

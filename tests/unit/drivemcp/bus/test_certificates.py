"""Certificates over time: what is kept, what is renewed, and that any two hosts believe each other meanwhile."""

import stat
from datetime import UTC, datetime, timedelta
from itertools import accumulate
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from cryptography import x509
from cryptography.x509.verification import PolicyBuilder, Store, VerificationError
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.bus.certificates import AUTHORITY_LIFE, LIFE, write_certificates
from drivemcp.bus.tls import AUTHORITY, OWN
from drivemcp.errors import UserError

START = datetime(2026, 1, 1, tzinfo=UTC)
MEMBERS = ("router", "can")


def test_what_lasts_is_kept_and_what_is_half_over_renewed(tmp_path: Path) -> None:
    def run(days: float, names: tuple[str, ...] = (), *, renew: bool = False) -> list[bool]:
        now = START + timedelta(days=days)
        made = write_certificates(tmp_path / "hosts", tmp_path / "ca", MEMBERS, names, now=now, renew=renew)
        return [member.renewed for member in made]

    assert run(0, ("van-7.local", "10.0.0.7")) == [True, True]
    assert run(14) == [False, False]
    assert run(16) == [True, True]
    assert run(17, ("van-7.local", "10.0.0.7")) == [False, False]
    assert run(18, ("van-8.local",)) == [True, False]
    assert run(19, renew=True) == [True, True]
    router = x509.load_pem_x509_certificate((tmp_path / "hosts/router" / OWN).read_bytes())
    names = router.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert names.get_values_for_type(x509.DNSName) == ["van-8.local"]


def test_every_file_is_its_owners_alone_and_hosts_get_no_key_of_the_authority(tmp_path: Path) -> None:
    write_certificates(tmp_path / "hosts", tmp_path / "ca", MEMBERS, ("router",))
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert len(files) == 5
    assert {stat.S_IMODE(path.stat().st_mode) for path in files} == {0o600}
    (authority,) = (tmp_path / "ca").glob("*.pem")
    key = authority.read_text().partition("-----BEGIN PRIVATE KEY-----")[2]
    assert key
    assert not any(key in path.read_text() for path in files if path != authority)


@pytest.mark.parametrize(("hosts", "authority"), [("a", "a"), ("a", "a/ca"), ("a/b", "a"), ("a", "c/../a/ca")])
def test_the_authority_lies_apart_from_what_hosts_are_given(tmp_path: Path, hosts: str, authority: str) -> None:
    with pytest.raises(UserError, match="belong apart"):
        write_certificates(tmp_path / hosts, tmp_path / authority, MEMBERS, ("router",))


def test_a_router_without_a_name_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="--tls NAME"):
        write_certificates(tmp_path / "hosts", tmp_path / "ca", MEMBERS)


def test_a_new_authority_begins_anew(tmp_path: Path) -> None:
    """After the old one was given up, for whatever reason, its certificates do not last."""
    write_certificates(tmp_path / "hosts", tmp_path / "ca", MEMBERS, ("router",))
    made = write_certificates(tmp_path / "hosts", tmp_path / "another", MEMBERS)
    assert all(member.renewed for member in made)


def believes(one: tuple[bytes, bytes], other: tuple[bytes, bytes], at: datetime) -> bool:
    """Whether a host with one set of files takes the certificate of another."""
    store = Store(x509.load_pem_x509_certificates(one[0]))
    certificate = x509.load_pem_x509_certificate(other[1])
    try:
        PolicyBuilder().store(store).time(at).build_client_verifier().verify(certificate, [])
    except VerificationError:
        return False
    return True


@given(st.lists(st.floats(7.0, 14.0), min_size=30, max_size=30))
@settings(max_examples=20)
def test_hosts_that_are_a_run_behind_and_those_that_are_not_believe_each_other_across_authorities(
    gaps: list[float],
) -> None:
    """Runs at most 14 days apart over the end of an authority; a host has the files of the last run or of the one before."""
    with TemporaryDirectory() as folder:
        hosts, authority = Path(folder) / "hosts", Path(folder) / "ca"
        write_certificates(hosts, authority, ["can"], now=START)
        bundles, last = [], None
        for days in accumulate(gaps, initial=(AUTHORITY_LIFE - 4 * LIFE) / timedelta(days=1)):
            now = START + timedelta(days=days)
            if now > START + AUTHORITY_LIFE + LIFE:
                break
            write_certificates(hosts, authority, ["can"], now=now)
            mine = ((hosts / "can" / AUTHORITY).read_bytes(), (hosts / "can" / OWN).read_bytes())
            assert believes(mine, mine, now)
            assert last is None or (believes(last, mine, now) and believes(mine, last, now))
            bundles.append(mine[0].count(b"BEGIN"))
            last = mine
        assert bundles[0] == bundles[-1] == 1
        assert max(bundles) == 2

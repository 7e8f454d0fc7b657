"""What `drivemcp audit verify` says of time stamps beside a log."""

from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.cli import make_parser, run
from services.logger.format import signing, time_stamp
from tests.unit.services.logger.conftest import FLUSHES, write
from tests.unit.services.logger.tsa import NAME, Authority, needs_openssl

pytestmark = [pytest.mark.usefixtures("trusted"), needs_openssl]


@pytest.fixture(scope="session")
def authorities(tmp_path_factory: pytest.TempPathFactory) -> tuple[Authority, Authority]:
    """Two authorities with a root each."""
    folder = tmp_path_factory.mktemp("tsa")
    return Authority(folder / "one"), Authority(folder / "other")


def _verify(*arguments: str) -> int:
    flags = make_parser().parse_args(["audit", "verify", *arguments])
    status: int = flags.run(flags)
    return status


def _stamp(log: Path, head: str, authority: Authority, n: int = 3) -> Path:
    token = log.with_name(f"{log.name}.{n:08d}.tsr")
    token.write_bytes(authority.stamp(time_stamp.query(head)[0]))
    return token


@pytest.fixture
def stamped(tmp_path: Path, signer: signing.Signer, authorities: tuple[Authority, Authority]) -> Path:
    """A log with a stamp of its closing head."""
    _stamp(tmp_path / "t.mcap", write(tmp_path / "t.mcap", signer).head.head_sha256, authorities[0])
    return tmp_path / "t.mcap"


def test_a_stamp_of_the_head_is_told_with_time_and_authority(
    stamped: Path, trusted: Path, authorities: tuple[Authority, Authority], capsys: pytest.CaptureFixture[str]
) -> None:
    root = ["--tsa-root", str(authorities[0].root)]
    assert _verify("--stamped", *root, str(stamped)) == 0
    assert f"Z by {NAME}" in capsys.readouterr().out.split("head stamped at ")[1]
    (trusted.parent / "trusted-tsa-roots.pem").write_bytes(authorities[0].root.read_bytes())
    assert _verify("--stamped", "--json", str(stamped)) == 0
    ((told,),) = msgspec.json.decode(capsys.readouterr().out)["stamps"]
    assert (told["by"], told["messages"], told["problem"]) == (NAME, 12, "")


def test_a_stamp_between_tells_how_far_it_reaches(
    tmp_path: Path, signer: signing.Signer, authorities: tuple[Authority, Authority], capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "t.mcap"
    between = write(path, signer, flushes=FLUSHES[:2], close=False).head
    path.unlink()
    write(path, signer)
    _stamp(path, between.head_sha256, authorities[0])
    root = ["--tsa-root", str(authorities[0].root)]
    assert _verify(*root, str(path)) == 0
    assert "the first 8 messages stamped at " in capsys.readouterr().out
    assert _verify("--stamped", *root, str(path)) == 1


def test_without_its_root_a_stamp_counts_for_nothing_and_says_why(
    stamped: Path, authorities: tuple[Authority, Authority], capsys: pytest.CaptureFixture[str]
) -> None:
    assert _verify(str(stamped)) == 0
    assert "not verified without a root certificate" in capsys.readouterr().out
    assert _verify("--stamped", str(stamped)) == 1
    capsys.readouterr()
    other = ["--tsa-root", str(authorities[1].root)]
    assert _verify(*other, str(stamped)) == 0
    assert "not of an authority of the given root" in capsys.readouterr().out
    assert _verify("--stamped", *other, str(stamped)) == 1


@pytest.mark.parametrize("what", ["cut", "written anew"])
def test_a_stamp_of_a_head_that_the_log_does_not_have_contradicts_it(
    stamped: Path,
    signer: signing.Signer,
    authorities: tuple[Authority, Authority],
    capsys: pytest.CaptureFixture[str],
    what: str,
) -> None:
    stamped.unlink()
    write(stamped, signer, flushes=FLUSHES[:2], close=what == "written anew")
    assert _verify(str(stamped)) == 0, "with the key both can be made, and the log alone does not tell"
    assert _verify("--tsa-root", str(authorities[0].root), str(stamped)) == 5
    assert "of a head that this log does not have" in capsys.readouterr().out
    assert _verify("--tsa-root", str(authorities[1].root), str(stamped)) == 0, "a stranger's stamp contradicts nothing"


def test_why_a_head_was_not_stamped_is_told(closed_log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    closed_log.with_name("t.mcap.tsr-failed").write_text("no time stamp: the network is down\n")
    assert _verify(str(closed_log)) == 0
    assert "its head: no time stamp: the network is down" in capsys.readouterr().out


@pytest.mark.parametrize(
    "roots", [b"", b"no certificate", b"-----BEGIN CERTIFICATE-----\nAAAA\n-----END CERTIFICATE-----\n"]
)
def test_roots_that_are_none_are_told(
    stamped: Path, tmp_path: Path, roots: bytes, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "roots").write_bytes(roots)
    assert run(["audit", "verify", "--tsa-root", str(tmp_path / "roots"), str(stamped)]) == 2
    assert "no certificates" in capsys.readouterr().err
    assert run(["audit", "verify", "--tsa-root", str(tmp_path / "absent"), str(stamped)]) == 2


@pytest.mark.filterwarnings("ignore:Parsed a serial number")
def test_a_token_with_any_bit_changed_never_tells_another_time_or_authority(
    stamped: Path, authorities: tuple[Authority, Authority]
) -> None:
    (path,) = time_stamp.beside(stamped)
    token, root = path.read_bytes(), authorities[0].root.read_bytes()
    heads = {time_stamp.imprint_of(token): 12}
    whole = time_stamp.judge("t", token, heads, root)
    for place in range(len(token) * 8):
        changed = bytearray(token)
        changed[place // 8] ^= 1 << place % 8
        judged = time_stamp.judge("t", bytes(changed), heads, root)
        assert judged.problem or judged == whole, place


@given(token=st.binary(max_size=300))
def test_what_is_no_token_is_called_so(token: bytes) -> None:
    assert time_stamp.judge("t", token, {}, b"").problem == "this is no time stamp"
    assert time_stamp.imprint_of(token) == ""

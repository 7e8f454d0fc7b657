"""Heads are stamped by an authority elsewhere; what it does not do costs no record."""

import subprocess
import threading
from collections.abc import Callable
from pathlib import Path

import pytest
from msgspec.structs import replace

from app.drive.log_state import state_of
from drivemcp.errors import UserError
from drivemcp.testing import bus
from proto import topics
from proto.vehicle import Ego
from services.logger.format import chain, signing, time_stamp
from services.logger.service import SERVICE, LoggerConfig
from services.logger.verification.verifier import verify
from services.logger.writing import log_folder
from services.logger.writing.time_stamps import TimeStamps
from tests.unit.services.logger.conftest import write
from tests.unit.services.logger.tsa import NAME, Authority, needs_openssl, serving

pytestmark = needs_openssl


@pytest.fixture(scope="session")
def authority(tmp_path_factory: pytest.TempPathFactory) -> Authority:
    """An authority."""
    return Authority(tmp_path_factory.mktemp("tsa") / "one")


def _stamped(tmp_path: Path, signer: signing.Signer, url: str, *, wait_s: float = 30.0) -> tuple[Path, list[str]]:
    """A log whose closing head was handed on for a stamp, and what was complained of."""
    said: list[str] = []
    stamps = TimeStamps(url, tmp_path, every_s=0.0, failed=said.append)
    head = write(tmp_path / "t.mcap", signer).head
    stamps.sealed(head, 3)
    stamps.close(wait_s)
    return tmp_path / "t.mcap", said


def test_a_drive_ends_with_a_stamp_of_its_head_that_openssl_verifies_too(tmp_path: Path, authority: Authority) -> None:
    with serving(authority.stamp) as url, bus() as b:
        node = b.start(SERVICE, LoggerConfig(out_dir=str(tmp_path), flush_ms=10, stamp_url=url))
        b.probe.publish(topics.EGO, Ego(speed_mps=12.5))
        b.wait_for(topics.CHAIN, lambda head: head.records > 0)
        node.close()
    (path,) = log_folder.logs(tmp_path / "logs")
    (token,) = time_stamp.beside(path)
    imprint = time_stamp.imprint_of(token.read_bytes())
    report = verify(path, sought=frozenset({imprint}))
    assert report.closed
    judged = time_stamp.judge("", token.read_bytes(), report.stamped, authority.root.read_bytes())
    assert (judged.by, judged.problem, judged.messages) == (NAME, "", report.messages)
    assert state_of([path], {}).unstamped == ""
    (tmp_path / "text").write_bytes(chain.signed_text(report.head))
    told = subprocess.run(
        ["openssl", "ts", "-verify", "-data", tmp_path / "text", "-in", token, "-CAfile", authority.root],
        capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip
    assert "Verification: OK" in told.stdout + told.stderr


def test_heads_between_are_stamped_each_so_often_and_go_with_their_log(
    tmp_path: Path, signer: signing.Signer, authority: Authority
) -> None:
    with serving(authority.stamp) as url:
        stamps = TimeStamps(url, tmp_path, every_s=1e-9, failed=pytest.fail)
        open_file = write(tmp_path / "t.mcap", signer, close=False)
        stamps.sealed(open_file.head, 2)
        stamps.close(30.0)
        TimeStamps(url, tmp_path, every_s=3600.0, failed=pytest.fail).sealed(open_file.head, 3)
    assert [path.name for path in time_stamp.beside(tmp_path / "t.mcap")] == ["t.mcap.00000002.tsr"]
    (tmp_path / "t.mcap.tsr-failed").write_text("of earlier\n")
    (tmp_path / "tt.mcap.00000002.tsr").touch()
    stamps.retired("t.mcap")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["t.mcap", "tt.mcap.00000002.tsr"]


_ANSWERS: dict[str, Callable[[Authority], Callable[[bytes], bytes | None]]] = {
    "500": lambda _: lambda query: None,
    "no time stamp": lambda _: lambda query: b"<html>sign in to this network</html>",
    "to another request": lambda one: lambda query: one.stamp(time_stamp.query("ab" * 32)[0]),
    "it refused": lambda one: lambda query: one.stamp(b"\x30\x03\x02\x01\x09"),
}


@pytest.mark.parametrize("why", _ANSWERS)
def test_an_answer_that_is_no_stamp_of_this_head_is_told_at_the_end_of_the_drive(
    tmp_path: Path, signer: signing.Signer, authority: Authority, why: str
) -> None:
    with serving(_ANSWERS[why](authority)) as url:
        path, said = _stamped(tmp_path, signer, url)
    assert why in " ".join(said)
    assert not time_stamp.beside(path)
    state = state_of([path], {})
    assert why in state.unstamped
    assert state.whole, "a missing stamp is not fatal"


def test_an_authority_that_is_away_is_told_and_a_later_stamp_ends_the_complaint(
    tmp_path: Path, signer: signing.Signer, authority: Authority
) -> None:
    with serving(authority.stamp) as url:
        pass
    path, said = _stamped(tmp_path, signer, url)
    assert "refused" in " ".join(said)
    assert "refused" in state_of([path], {}).unstamped
    path.unlink()
    with serving(authority.stamp) as url:
        path, said = _stamped(tmp_path, signer, url)
    assert (said, state_of([path], {}).unstamped) == ([], "")


class Failing:
    """An authority that fails so many times, and then stamps."""

    def __init__(self, authority: Authority, times: int) -> None:
        self._authority, self.left, self.asked = authority, times, 0

    def __call__(self, query: bytes) -> bytes | None:
        self.asked, self.left = self.asked + 1, self.left - 1
        return None if self.left >= 0 else self._authority.stamp(query)


def test_a_closing_head_whose_stamp_failed_is_asked_for_once_more_at_the_end(
    tmp_path: Path, signer: signing.Signer, authority: Authority
) -> None:
    failing = Failing(authority, 1)
    with serving(failing) as url:
        path, said = _stamped(tmp_path, signer, url)
    assert failing.asked == 2
    assert "500" in said[0]
    assert said[1:] == [""], "the trouble is over"
    assert [token.name for token in time_stamp.beside(path)] == ["t.mcap.00000003.tsr"]
    assert state_of([path], {}).unstamped == ""


def test_a_stamp_that_failed_is_asked_for_again_of_the_newest_head_while_the_log_is_open(
    tmp_path: Path, signer: signing.Signer, authority: Authority
) -> None:
    failing, came = Failing(authority, 2), threading.Event()
    problems: list[str] = []

    def told(problem: str) -> None:
        problems.append(problem)
        came.set()

    with serving(failing) as url:
        stamps = TimeStamps(url, tmp_path, every_s=3600.0, failed=told, again_s=0.0)
        last = replace(write(tmp_path / "old.mcap", signer).head, file="old.mcap")
        stamps.sealed(last, 9)
        for n in range(3):
            assert came.wait(30.0)
            came.clear()
            if n < 2:
                stamps.sealed(write(tmp_path / f"t{n}.mcap", signer, close=False).head, n)
        stamps.close(30.0)
    assert ["500" in each for each in problems] == [True, True, False]
    assert failing.asked == 3, "what has its stamp is not asked for again"
    assert [token.name for token in time_stamp.beside(tmp_path / "old.mcap")] == ["old.mcap.00000009.tsr"]
    assert not time_stamp.refused(tmp_path / "old.mcap")


def test_the_newest_open_head_stands_for_an_earlier_one_that_failed(
    tmp_path: Path, signer: signing.Signer, authority: Authority
) -> None:
    failing, failed = Failing(authority, 1), threading.Event()
    with serving(failing) as url:
        stamps = TimeStamps(url, tmp_path, every_s=1e-9, failed=lambda _: failed.set(), again_s=0.0)
        head = write(tmp_path / "t.mcap", signer, close=False).head
        stamps.sealed(head, 2)
        assert failed.wait(30.0)
        stamps.sealed(head, 5)
        stamps.close(30.0)
    assert [token.name for token in time_stamp.beside(tmp_path / "t.mcap")] == ["t.mcap.00000005.tsr"]
    assert failing.asked == 2


def test_an_authority_that_stays_away_is_asked_ever_more_seldom(
    tmp_path: Path, signer: signing.Signer, authority: Authority
) -> None:
    failing, failed = Failing(authority, 100), threading.Event()
    with serving(failing) as url:
        stamps = TimeStamps(url, tmp_path, every_s=1e6, failed=lambda _: failed.set(), again_s=60.0)
        stamps.sealed(write(tmp_path / "old.mcap", signer).head, 1)
        assert failed.wait(30.0)
        head = write(tmp_path / "t.mcap", signer, close=False).head
        for n in range(20):
            stamps.sealed(head, n)
        stamps.close(30.0)
    assert failing.asked == 2, "once, and once more at the end"


def test_an_authority_that_does_not_answer_holds_up_neither_the_log_nor_the_end(
    tmp_path: Path, authority: Authority
) -> None:
    release = threading.Event()

    def hang(query: bytes) -> bytes | None:
        release.wait(60.0)
        return None

    with serving(hang) as url, bus() as b:
        node = b.start(SERVICE, LoggerConfig(out_dir=str(tmp_path), flush_ms=10, stamp_url=url, stamp_s=1e-9))
        for n in range(3):
            b.probe.publish(topics.EGO, Ego(speed_mps=12.5))
            b.wait_for(topics.CHAIN, lambda head, n=n: head.records > n)  # type: ignore[misc]
        node.close()
        assert not release.is_set(), "the logger has ended while the authority still thought"
        release.set()
    (path,) = log_folder.logs(tmp_path / "logs")
    state = state_of([path], {})
    assert state.whole
    assert "no answer when the logger ended" in state.unstamped


def test_an_address_of_another_kind_is_refused_at_the_start(tmp_path: Path) -> None:
    with bus() as b, pytest.raises(UserError, match="stamp_url"):
        b.start(SERVICE, LoggerConfig(out_dir=str(tmp_path), stamp_url="file:///etc/passwd"))

"""`drivemcp audit verify` as a shell sees it."""

import sys
from pathlib import Path

import msgspec
import pytest

from drivemcp.cli import make_parser, run
from drivemcp.errors import UserError
from proto.health import ChainHead
from services.logger.format import signing
from services.logger.memory import MemoryStore
from services.logger.writing import anchor
from services.logger.writing.topic_formats import Gap, gap_record
from tests.unit.services.logger.conftest import FLUSHES, write

pytestmark = pytest.mark.usefixtures("trusted")


def _run(*arguments: str) -> int:
    flags = make_parser().parse_args(["audit", "verify", *arguments])
    status: int = flags.run(flags)
    return status


def _complaint(capsys: pytest.CaptureFixture[str]) -> str:
    (line,) = capsys.readouterr().err.splitlines()
    return line


def test_a_good_log_exits_with_0_and_tells_its_head(closed_log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert _run(str(closed_log)) == 0
    said = capsys.readouterr().out
    assert "verified: 12 messages, 4 chain records" in said
    assert "head " in said
    assert said.rstrip().endswith(": known")


def test_an_unknown_key_has_an_exit_status_of_its_own(
    closed_log: Path, trusted: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trusted.unlink()
    assert _run(str(closed_log)) == 3
    assert ": unknown" in capsys.readouterr().out
    trusted.write_text(f"other-car {'ab' * 32} 2026-03-04 a key of somebody else's\n")
    assert _run(str(closed_log)) == 3


def test_a_vehicle_that_the_trust_file_knows_by_another_key_is_told_with_the_date(
    closed_log: Path, trusted: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trusted.write_text(f"# keys of the fleet\nego {'ab' * 32} 2026-03-04\nego {'cd' * 32} 2025-01-01\n")
    assert _run("--trust", str(trusted), str(closed_log)) == 4
    assert "changed since 2026-03-04" in capsys.readouterr().out
    assert _run("--json", str(closed_log)) == 4
    assert msgspec.json.decode(capsys.readouterr().out)["signers"] == [
        {"standing": "changed since", "since": "2026-03-04"}
    ]


def test_a_key_that_was_trusted_by_the_command_is_known(
    tmp_path: Path, closed_log: Path, signer: signing.Signer, capsys: pytest.CaptureFixture[str]
) -> None:
    own = ["--trust", str(tmp_path / "fleet" / "keys")]
    assert run(["audit", "trust", *own, "--vehicle", "van", "ab" * 32]) == 0
    assert _run(*own, str(closed_log)) == 3
    assert run(["audit", "trust", *own, "--vehicle", "ego", "--note", "the car # of the lab", signer.public_hex]) == 0
    assert _run(*own, str(closed_log)) == 0
    assert (tmp_path / "fleet" / "keys").stat().st_mode & 0o777 == 0o600
    assert run(["audit", "trust", *own, "--vehicle", "a b", signer.public_hex]) == 2
    assert "--vehicle" in capsys.readouterr().err


@pytest.mark.parametrize("text", ["ego\n", "ego nonsense\n", f"{'ab' * 32}\n", "\xff\n"])
def test_a_trust_file_that_is_none_is_told_and_nothing_is_called_known(
    closed_log: Path, trusted: Path, capsys: pytest.CaptureFixture[str], text: str
) -> None:
    trusted.write_bytes(text.encode("latin-1"))
    assert run(["audit", "verify", str(closed_log)]) == 2
    assert "is no trust file" in _complaint(capsys)
    assert run(["audit", "verify", "--trust", str(closed_log) + ".none", str(closed_log)]) == 2


def _anchor(path: Path, signer: signing.Signer) -> anchor.Anchor:
    return anchor.Anchor(path, signer, every_s=0.0, failed=pytest.fail)


def test_an_anchored_head_settles_a_lost_tail_and_a_log_that_is_gone(
    tmp_path: Path, signer: signing.Signer, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "logs").mkdir()
    kept, head = _anchor(tmp_path / "elsewhere", signer), ""
    for name in ("1.mcap", "2.mcap", "3.mcap"):
        written = write(tmp_path / "logs" / name, signer, previous_head=head).head
        kept.sealed(msgspec.structs.replace(written, file=name), 3)
        head = written.head_sha256
    anchored = ["--anchors", str(tmp_path / "elsewhere")]
    assert _run(*anchored, str(tmp_path)) == 0
    last = tmp_path / "logs" / "3.mcap"
    whole = last.read_bytes()
    last.write_bytes(whole[: len(whole) // 2])
    assert _run(str(tmp_path)) == 0, "the file alone does not tell a cut from a crash"
    assert _run(*anchored, str(tmp_path)) == 1
    assert "TAIL LOST" in capsys.readouterr().out
    last.unlink()
    assert _run(*anchored, str(tmp_path)) == 1
    assert "3.mcap is gone: a head of it is anchored" in capsys.readouterr().out


def test_a_log_that_retention_deleted_is_not_called_gone_and_a_forged_retirement_does_not_count(
    tmp_path: Path, signer: signing.Signer
) -> None:
    (tmp_path / "logs").mkdir()
    stranger, elsewhere = signing.load_or_make(tmp_path / "stranger"), tmp_path / "elsewhere"
    written = write(tmp_path / "logs" / "2.mcap", signer).head
    kept = _anchor(elsewhere, signer)
    kept.sealed(msgspec.structs.replace(written, file="2.mcap"), 3)
    kept.sealed(msgspec.structs.replace(written, file="1.mcap"), 3)
    _anchor(elsewhere, stranger).retired("1.mcap")
    with elsewhere.open("ab") as cut:
        cut.write(b'{"time":"cut\n')
    assert _run("--anchors", str(elsewhere), str(tmp_path)) == 1
    kept.retired("1.mcap")
    assert _run("--anchors", str(elsewhere), str(tmp_path)) == 0


def test_what_the_logger_lost_is_told_with_its_reason(
    tmp_path: Path, signer: signing.Signer, capsys: pytest.CaptureFixture[str]
) -> None:
    gap = Gap(lost=7, from_ns=1, until_ns=2, reason="No space left on device")
    write(tmp_path / "t.mcap", signer, flushes=[*FLUSHES, [gap_record(gap, sequence=1)]])
    assert _run(str(tmp_path / "t.mcap")) == 0
    assert "7 messages never came into it: No space left on device" in capsys.readouterr().out


def test_a_changed_log_exits_with_1_and_names_the_place(closed_log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    raw = bytearray(closed_log.read_bytes())
    raw[len(raw) // 3] ^= 1
    closed_log.write_bytes(raw)
    assert _run(str(closed_log)) == 1
    assert "NOT AS WRITTEN" in capsys.readouterr().out


def test_an_unclosed_log_is_called_so(
    tmp_path: Path, signer: signing.Signer, capsys: pytest.CaptureFixture[str]
) -> None:
    write(tmp_path / "t.mcap", signer, close=False)
    assert _run(str(tmp_path / "t.mcap")) == 0
    assert "UNCLOSED" in capsys.readouterr().out
    assert _run("--closed", str(tmp_path / "t.mcap")) == 1


@pytest.mark.parametrize("key", [False, True])
def test_a_log_without_a_chain_record_verifies_nothing_and_exits_with_1(
    tmp_path: Path,
    unclosed: tuple[bytes, ...],
    signer: signing.Signer,
    capsys: pytest.CaptureFixture[str],
    key: bool,
) -> None:
    path = tmp_path / "t.mcap"
    expected = ["--key", signer.public_hex] if key else []
    sealed = unclosed[0].index(b'{"body":{"n":0,')
    for cut in (0, 3, 8, 100, 600, sealed - 40, sealed, len(unclosed[0]) - 400):
        path.write_bytes(unclosed[0][:cut])
        assert _run(*expected, str(path)) == 1, cut
        assert "NOTHING VERIFIES" in capsys.readouterr().out, cut
    for garbage in (b"\x89MCAP0\r\n" + bytes(50), b"no log" * 100):
        path.write_bytes(garbage)
        assert _run(*expected, str(path)) == 1
        said = capsys.readouterr().out
        assert "NOT AS WRITTEN" in said or "NOTHING VERIFIES" in said
    path.write_bytes(unclosed[0])
    assert _run(*expected, str(path)) == 0
    assert "UNCLOSED" in capsys.readouterr().out


def test_a_head_kept_in_memory_settles_a_lost_tail(tmp_path: Path, signer: signing.Signer) -> None:
    (tmp_path / "logs").mkdir()
    path = tmp_path / "logs" / "t.mcap"
    head: ChainHead = write(path, signer).head
    memory = MemoryStore(tmp_path / "memory.sqlite")
    memory.add_head(head, 3)
    memory.close()
    assert _run(str(path)) == 0
    raw = path.read_bytes()
    path.write_bytes(raw[: len(raw) // 2])
    assert _run(str(path)) == 1


def test_a_log_that_was_written_anew_with_another_key_is_called_rewritten(
    tmp_path: Path, signer: signing.Signer, capsys: pytest.CaptureFixture[str]
) -> None:
    path, stranger = tmp_path / "logs" / "t.mcap", signing.load_or_make(tmp_path / "stranger")
    path.parent.mkdir()
    memory = MemoryStore(tmp_path / "memory.sqlite")
    memory.add_head(write(path, signer).head, 3)
    memory.close()
    path.unlink()
    write(path, stranger)
    assert _run(str(path)) == 1
    told = capsys.readouterr().out
    assert "REWRITTEN" in told
    assert f"memory knows this log by key {signer.key_id}" in told


@pytest.mark.parametrize("gone", ["1.mcap", "2.mcap", "3.mcap"])
@pytest.mark.parametrize("named", [".", "logs"])
def test_a_log_that_is_gone_is_told_by_name_where_its_folder_was_named(
    tmp_path: Path, signer: signing.Signer, capsys: pytest.CaptureFixture[str], gone: str, named: str
) -> None:
    (tmp_path / "logs").mkdir()
    memory, head = MemoryStore(tmp_path / "memory.sqlite"), ""
    for name in ("1.mcap", "2.mcap", "3.mcap"):
        written = write(tmp_path / "logs" / name, signer, previous_head=head).head
        memory.add_head(msgspec.structs.replace(written, file=name), 3)
        head = written.head_sha256
    memory.close()
    assert _run(str(tmp_path / named)) == 0
    (tmp_path / "logs" / gone).unlink()
    capsys.readouterr()
    assert _run(str(tmp_path / named)) == 1
    assert f"{gone} is gone" in capsys.readouterr().out
    assert _run(*map(str, (tmp_path / "logs").glob("[12].mcap"))) == 0, "of files that were named, those count"


def test_files_that_do_not_continue_each_other_are_told(
    tmp_path: Path, signer: signing.Signer, capsys: pytest.CaptureFixture[str]
) -> None:
    head = write(tmp_path / "1.mcap", signer).head.head_sha256
    write(tmp_path / "2.mcap", signer, previous_head=head)
    write(tmp_path / "3.mcap", signer)
    assert _run(str(tmp_path / "1.mcap"), str(tmp_path / "2.mcap")) == 0
    assert _run(str(tmp_path / "2.mcap"), str(tmp_path / "3.mcap")) == 1
    assert _run(str(tmp_path)) == 1
    assert "does not go on from" in capsys.readouterr().out


def test_the_expected_key_is_taken_from_a_file(tmp_path: Path, closed_log: Path, signer: signing.Signer) -> None:
    (tmp_path / "key.pub").write_text(signer.public_hex + "\n")
    assert _run("--key", str(tmp_path / "key.pub"), str(closed_log)) == 0
    assert _run("--key", "ab" * 32, str(closed_log)) == 1
    with pytest.raises(UserError, match="--key"):
        _run("--key", "nonsense", str(closed_log))


@pytest.mark.parametrize("content", [b"\xff\xfe" * 20, b"\x00" * 32, b"", b"ab" * 31, b"ab" * 33, b"ab" * 32 + b" cd"])
def test_a_key_file_without_a_key_is_a_mistake_told_in_one_line(
    tmp_path: Path, closed_log: Path, capsys: pytest.CaptureFixture[str], content: bytes
) -> None:
    (tmp_path / "bin.key").write_bytes(content)
    assert run(["audit", "verify", "--key", str(tmp_path / "bin.key"), str(closed_log)]) == 2
    assert _complaint(capsys).startswith("drivemcp: --key takes 64 hex digits")


@pytest.mark.skipif(sys.platform != "linux", reason="needs a file that cannot be read, whoever asks")
def test_a_key_file_that_cannot_be_read_is_told_in_one_line(
    closed_log: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["audit", "verify", "--key", "/proc/self/mem", str(closed_log)]) == 2
    assert "/proc/self/mem cannot be read" in _complaint(capsys)


@pytest.mark.parametrize(
    ("option", "value"),
    [("--expect-head", one) for one in ("zz", "", "ab" * 31, "ab" * 33, "zz" * 32)]
    + [("--key", one) for one in ("", "abcd", "k" * 5000)],
)
def test_what_is_no_head_and_no_key_is_a_mistake_told_in_one_line(
    closed_log: Path, capsys: pytest.CaptureFixture[str], option: str, value: str
) -> None:
    assert run(["audit", "verify", option, value, str(closed_log)]) == 2
    complaint = _complaint(capsys)
    assert option in complaint or "cannot be read" in complaint


def test_an_expected_head_is_taken_in_either_case(tmp_path: Path, signer: signing.Signer) -> None:
    head = write(tmp_path / "t.mcap", signer).head.head_sha256
    assert _run("--expect-head", head.upper(), str(tmp_path / "t.mcap")) == 0
    assert _run("--expect-head", "ab" * 32, str(tmp_path / "t.mcap")) == 1


def test_the_folder_of_a_drive_stands_for_the_logs_in_it(
    tmp_path: Path, signer: signing.Signer, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "logs").mkdir()
    head = write(tmp_path / "logs" / "1.mcap", signer).head.head_sha256
    write(tmp_path / "logs" / "2.mcap", signer, previous_head=head)
    assert run(["audit", "verify", str(tmp_path)]) == 0
    assert capsys.readouterr().out.count(": verified:") == 2
    (tmp_path / "none").mkdir()
    assert run(["audit", "verify", str(tmp_path / "none")]) == 2
    assert "no logs (*.mcap) in" in _complaint(capsys)


def test_an_absent_file_is_a_mistake_told_in_one_line(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="no such file"):
        _run(str(tmp_path / "none.mcap"))


def test_json_says_the_same(closed_log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert _run("--json", str(closed_log)) == 0
    said = msgspec.json.decode(capsys.readouterr().out)
    assert said["files"][0]["messages"] == 12
    assert said["files"][0]["first_bad"] is None


def test_a_key_to_trust_that_is_none_is_named_as_the_argument_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["audit", "trust", str(tmp_path / "gone")]) == 2
    assert _complaint(capsys).startswith("drivemcp: HEX|FILE takes 64 hex digits")

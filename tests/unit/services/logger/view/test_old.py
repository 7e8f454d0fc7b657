"""`drivemcp view` as a shell sees it."""

import socket
from pathlib import Path

import msgspec
import pytest

from drivemcp.cli import run
from proto.vehicle import Ego
from services.logger.format import signing
from services.logger.format.signing import Signer
from services.logger.writing.log_file import Record
from services.logger.writing.topic_formats import json_form
from tests.unit.services.logger.conftest import write


def _egos(first: int, count: int) -> list[Record]:
    return [
        Record(
            topic="can/ego",
            form=json_form(Ego),
            sequence=i,
            log_time_ns=i * 10_000_000,
            publish_time_ns=i * 10_000_000,
            data=msgspec.json.encode(Ego(speed_mps=float(i))),
        )
        for i in range(first, first + count)
    ]


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """The folder of a drive with two logs, of three and four records that can be shown."""
    signer: Signer = signing.load_or_make(tmp_path / "key")
    folder = tmp_path / "drive"
    (folder / "logs").mkdir(parents=True)
    head = write(folder / "logs" / "1.mcap", signer, flushes=[_egos(0, 3)]).head.head_sha256
    write(folder / "logs" / "2.mcap", signer, flushes=[_egos(3, 4)], previous_head=head)
    return folder


def _complaint(capsys: pytest.CaptureFixture[str]) -> str:
    (line,) = capsys.readouterr().err.splitlines()
    return line


@pytest.mark.parametrize(
    ("names", "shown"),
    [
        ([""], 7),
        (["logs"], 7),
        (["logs/1.mcap", "logs/2.mcap"], 7),
        (["logs/2.mcap"], 4),
    ],
)
def test_a_drive_a_folder_of_logs_and_files_become_one_recording(
    drive: Path, capsys: pytest.CaptureFixture[str], names: list[str], shown: int
) -> None:
    recording = drive / "x.rrd"
    assert run(["view", "--recording", str(recording), *(str(drive / name) for name in names)]) == 0
    assert f"{shown} records of {drive}/logs/" in capsys.readouterr().out
    assert b"speed/ego" in recording.read_bytes()


def test_a_folder_without_logs_is_a_mistake_told_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["view", str(tmp_path)]) == 2
    assert _complaint(capsys) == f"drivemcp: no logs (*.mcap) in {tmp_path}"


@pytest.mark.parametrize("bind", ["127.0.0.1", "0.0.0.0"])
def test_a_port_that_is_taken_is_told_in_one_line(drive: Path, capsys: pytest.CaptureFixture[str], bind: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert run(["view", "--bind", bind, "--port", str(port), str(drive)]) == 2
    complaint = _complaint(capsys)
    assert f"port {port} of {bind} cannot be used" in complaint
    assert "in use" in complaint


@pytest.mark.parametrize("port", ["70000", "-1", "web"])
def test_what_is_no_port_is_refused(drive: Path, capsys: pytest.CaptureFixture[str], port: str) -> None:
    with pytest.raises(SystemExit, match="2"):
        run(["view", f"--port={port}", str(drive)])
    assert "argument --port" in capsys.readouterr().err

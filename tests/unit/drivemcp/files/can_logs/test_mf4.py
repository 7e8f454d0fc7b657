"""Logs in MDF 4: what python-can reads of them with asammdf, which is in no extra of ours, and what is said of one that it cannot."""

import struct
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import can
import pytest

from drivemcp.files.can_logs import log as logs
from drivemcp.files.can_logs.log import CanLog
from proto.sensors import CanFrame
from tests.unit.drivemcp.files.can_logs.written import NS, START_S, write

FRAMES = [
    *(CanFrame(stamp_ns=int((START_S + 0.02 * n) * NS), arbitration_id=0x100, data=b"\x10\x0e") for n in range(20)),
    CanFrame(stamp_ns=int((START_S + 1) * NS), arbitration_id=0x18FEF100, data=bytes(range(8)), extended=True),
    CanFrame(stamp_ns=int((START_S + 2) * NS), arbitration_id=0x1A, data=bytes(range(64)), fd=True, bitrate_switch=True),
    CanFrame(stamp_ns=int((START_S + 3) * NS), arbitration_id=0x1C, data=b"", remote=True, requested_bytes=4),
]  # fmt: skip


@pytest.mark.parametrize("level", [0, 1, 2])
@pytest.mark.parametrize("finalised", [True, False])
def test_an_mf4_log_is_read_packed_or_not_and_also_where_its_end_was_not_written(
    tmp_path: Path, level: int, finalised: bool
) -> None:
    pytest.importorskip("asammdf")
    path = tmp_path / "drive.mf4"
    with can.Logger(str(path), compression_level=level) as logger:
        for message in can.LogReader(str(write(tmp_path / "drive.asc", FRAMES))):
            message.channel = 0
            logger.on_message_received(message)
    if not finalised:
        content = bytearray(path.read_bytes())
        content[:8], content[60:62] = b"UnFinMF ", struct.pack("<H", 1)
        path.write_bytes(content)
    log = CanLog(path)
    records = list(log)
    assert [(each.frame.arbitration_id, each.frame.data, each.frame.extended) for each in records] == [
        (frame.arbitration_id, frame.data, frame.extended) for frame in FRAMES
    ]
    assert [records[-2].frame.fd, records[-1].frame.remote] == [True, True]
    assert records[-1].at_s == pytest.approx(3.0, abs=1e-4)
    assert log.summary == ""


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"UnFinMF 4.10", "it is an .mf4 log that was not finalised: finalise it"),
        (b"MDF     3.30", "it is a measurement of MDF 3: asammdf converts it to MDF 4"),
        (b"MDF     4.10", "1 malformed"),
    ],
)
@pytest.mark.parametrize("error", [UnboundLocalError, AttributeError, ValueError])
def test_what_breaks_the_reader_of_mf4_is_told_by_the_file_and_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, content: bytes, said: str, error: type[Exception]
) -> None:
    def broken(_: Any) -> Any:
        raise error("blk")

    package = ModuleType("asammdf.blocks.utils")
    package.MdfException = ValueError  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "asammdf.blocks.utils", package)
    monkeypatch.setitem(logs.BINARY, ".mf4", broken)
    path = tmp_path / "drive.mf4"
    path.write_bytes(content)
    log = CanLog(path)
    assert list(log) == []
    assert said in log.nothing
    assert "blk" not in log.nothing

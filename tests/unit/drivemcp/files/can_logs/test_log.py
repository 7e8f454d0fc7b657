"""Recorded logs: every format that python-can writes is read back whole, and of a broken one what can be read."""

import gzip
import itertools
import random
import re
import zipfile
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.errors import UserError
from drivemcp.files.can_logs.log import CanLog, check_channel
from proto.sensors import CanFrame
from tests.unit.drivemcp.files.can_logs.written import CLASSIC, NS, START_S, WITH_FD, candump, drive, write


def content(frame: CanFrame) -> tuple[Any, ...]:
    return (
        frame.arbitration_id,
        frame.data,
        frame.extended,
        frame.fd,
        frame.remote,
        frame.bitrate_switch,
        frame.error_state,
    )


@pytest.mark.parametrize("ending", CLASSIC)
def test_every_frame_of_a_log_comes_in_its_order_and_time(tmp_path: Path, ending: str) -> None:
    frames = drive(2.0)
    log = CanLog(write(tmp_path / f"drive{ending}", frames))
    records = list(log)
    assert [content(record.frame) for record in records] == [content(frame) for frame in frames]
    spans = [(frame.stamp_ns - frames[0].stamp_ns) / NS for frame in frames]
    assert [record.at_s for record in records] == pytest.approx(spans, abs=0.0011)
    assert log.notes == []


@settings(max_examples=60)
@given(st.sets(st.integers(0, 97), max_size=4), st.sampled_from([4e3, 1e5, 8e9]))
def test_a_time_stamp_far_ahead_costs_its_own_record_alone(
    tmp_path_factory: pytest.TempPathFactory, wrong: set[int], by_s: float
) -> None:
    times = [START_S + 0.01 * number + (by_s if number in wrong else 0.0) for number in range(100)]
    log = candump(tmp_path_factory.mktemp("log") / "drive.log", times)
    records = list(log)
    assert [record.frame.arbitration_id for record in records] == [each for each in range(100) if each not in wrong]
    assert records[-1].at_s == pytest.approx(0.99, abs=0.05)
    assert log.malformed == len(wrong)
    assert all("hours after" in note for note in log.notes)


def test_a_long_pause_in_a_log_is_no_wrong_time(tmp_path: Path) -> None:
    times = [START_S + 0.01 * number + (7200.0 if number >= 50 else 0.0) for number in range(100)]
    log = candump(tmp_path / "drive.log", times)
    assert len(list(log)) == 100
    assert log.notes == []


@pytest.mark.parametrize("ending", WITH_FD)
def test_long_frames_extended_ids_and_remote_frames_survive_a_log(tmp_path: Path, ending: str) -> None:
    frames = [
        CanFrame(stamp_ns=int(START_S * NS), arbitration_id=0x18FEF100, data=bytes(range(8)), extended=True),
        CanFrame(stamp_ns=int(START_S * NS), arbitration_id=0x1A, data=bytes(range(64)), fd=True, bitrate_switch=True),
        CanFrame(stamp_ns=int(START_S * NS), arbitration_id=0x1B, data=bytes(12), fd=True, error_state=True),
        CanFrame(stamp_ns=int(START_S * NS), arbitration_id=0x1C, data=b"", remote=True, requested_bytes=4),
    ]
    log = CanLog(write(tmp_path / f"fd{ending}", frames))
    assert [content(record.frame) for record in log] == [content(frame) for frame in frames]
    assert log.notes == []


def test_a_packed_text_log_is_read_as_it_is(tmp_path: Path) -> None:
    frames = drive(0.5)
    path = tmp_path / "drive.log.gz"
    path.write_bytes(gzip.compress(write(tmp_path / "drive.log", frames).read_bytes()))
    assert len(list(CanLog(path))) == len(frames)


BAD_LINES = {
    ".log": "(not a time) can0 101#00",
    ".csv": "now,zz,0,0,0,8,????",
    ".asc": " 1.000000 1  101x Rx   d 8 01 02 GG 04",
    ".trc": "      9       1.000 DT 1      ZZ1 Rx -  2    01 02",
}


@pytest.mark.parametrize("ending", BAD_LINES)
def test_a_malformed_line_costs_itself_alone_and_is_told_by_file_and_line(tmp_path: Path, ending: str) -> None:
    frames = drive(0.2)
    path = write(tmp_path / f"drive{ending}", frames)
    lines = path.read_text().splitlines(keepends=True)
    place = len(lines) - 4
    path.write_text("".join([*lines[:place], BAD_LINES[ending] + "\n", *lines[place:]]))
    log = CanLog(path)
    assert [content(record.frame) for record in log] == [content(frame) for frame in frames]
    assert log.malformed == 1
    assert log.notes[0].startswith(f"drive{ending}: line {place + 1}: ") or "record" in log.notes[0]
    assert "1 malformed, first drive" in log.summary


@pytest.mark.parametrize("ending", [".asc", ".blf", ".log", ".trc", ".csv", ".log.gz"])
def test_of_a_cut_log_what_can_be_read_is_replayed_and_the_cut_is_told(tmp_path: Path, ending: str) -> None:
    frames = drive(4.0)
    path = write(tmp_path / f"drive{ending.removesuffix('.gz')}", frames)
    if ending == ".log.gz":
        path = tmp_path / "drive.log.gz"
        path.write_bytes(gzip.compress((tmp_path / "drive.log").read_bytes()))
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) * 3 // 4 + 3])
    log = CanLog(path)
    records = [content(record.frame) for record in log]
    assert len(records) > (0 if ending == ".blf" else len(frames) // 3)
    assert records[:-1] == [content(frame) for frame in frames][: len(records) - 1]
    assert log.malformed >= 1
    assert path.name in log.notes[-1]


def test_a_log_whose_header_lacks_what_its_version_needs_ends_and_says_so(tmp_path: Path) -> None:
    path = write(tmp_path / "drive.trc", drive(0.1))
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    assert any(line.startswith(";$COLUMNS") for line in lines)
    path.write_text("".join(line for line in lines if not line.startswith(";$COLUMNS")), encoding="utf-8")
    log = CanLog(path)
    assert list(log) == []
    assert "drive.trc" in log.notes[-1]
    assert "header" in log.notes[-1]


@settings(max_examples=60, deadline=None)
@given(noise=st.binary(max_size=300), where=st.floats(0, 1), ending=st.sampled_from(CLASSIC))
def test_no_bytes_break_the_reading_and_none_invent_a_frame_that_is_none(
    tmp_path_factory: Any, noise: bytes, where: float, ending: str
) -> None:
    folder = tmp_path_factory.mktemp("noise")
    path = write(folder / f"drive{ending}", drive(0.1))
    whole = path.read_bytes()
    place = int(where * len(whole))
    path.write_bytes(whole[:place] + noise + whole[place:])
    for record in CanLog(path):
        assert len(record.frame.data) <= 64
        assert record.at_s >= 0.0


def test_of_several_channels_one_is_replayed_and_the_others_are_told(tmp_path: Path) -> None:
    path = tmp_path / "two.log"
    path.write_text("(1.0) can0 101#01\n(1.1) can1 101#02\n(1.2) can0 101#03\n(1.3) can1 101#04\n")
    first, second = CanLog(path), CanLog(path, "can1")
    assert [record.frame.data for record in first] == [b"\x01", b"\x03"]
    assert [(round(record.at_s, 3), record.frame.data) for record in second] == [(0.1, b"\x02"), (0.3, b"\x04")]
    assert first.summary == "left out 2 frames of channel can1; this is channel can0"


HEADER = "date Tue Mar 4 10:11:12.000 am 2025\nbase hex  timestamps absolute\nno internal events logged\n"
SPEED = "d 8 10 0E 00 00 00 00 00 00"


def asc(stamps: list[str], header: str = HEADER, words: str = SPEED) -> str:
    return header + "".join(f"   {stamp} 1  100             Rx   {words}\n" for stamp in stamps)


def read(path: Path, text: str, encoding: str = "utf-8") -> tuple[CanLog, list[float], list[CanFrame]]:
    """The log of this text, its times, and its frames."""
    path.write_bytes(text.encode(encoding))
    log = CanLog(path)
    records = list(log)
    return log, [record.at_s for record in records], [record.frame for record in records]


EVEN = [f"{0.02 * number:.6f}" for number in range(40)]


def test_stamps_that_are_differences_by_the_header_are_added_up(tmp_path: Path) -> None:
    statistics = "   0.500000 1  Statistic: D 0 R 0 XD 0 XR 0 E 0 O 0 B 0.00%\n"
    text = asc(["0.020000"] * 40, HEADER.replace("absolute", "relative"))
    lines = text.splitlines(keepends=True)
    log, times, _ = read(tmp_path / "drive.asc", "".join([*lines[:23], statistics, *lines[23:]]))
    assert times == pytest.approx([0.02 * n + (0.5 if n >= 20 else 0.0) for n in range(40)])
    assert "1 lines not read, first line 24 is no CAN frame" in log.summary


@pytest.mark.parametrize("jitter_s", [0.0, 0.004])
def test_stamps_that_are_differences_without_a_header_are_seen_and_told(tmp_path: Path, jitter_s: float) -> None:
    steps = [0.0, *(0.02 + jitter_s * ((7 * n) % 5 - 2) / 2 for n in range(199))]
    text = "".join(f" ({step:010.6f})  can0  100   [2]  10 0E\n" for step in steps)
    log, times, _ = read(tmp_path / "drive.log", text)
    assert times == pytest.approx(list(itertools.accumulate(steps)), abs=1e-6)
    assert "added up" in log.summary


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.floats(0.0, 0.5), min_size=10, max_size=80),
    st.sampled_from([0.0, 3.0, 1000.0, START_S]),
    st.sampled_from([0.0, 0.01]),
)
def test_stamps_that_grow_are_never_taken_for_differences(
    tmp_path_factory: pytest.TempPathFactory, steps: list[float], start_s: float, late_s: float
) -> None:
    """Also where the frames of a second bus come a little late."""
    stamps = [
        start_s + at - late_s * (number % 2)
        for number, at in enumerate(itertools.accumulate(step + 0.02 for step in steps))
    ]
    log = candump(tmp_path_factory.mktemp("log") / "drive.log", stamps)
    assert [record.at_s for record in log][-1] <= stamps[-1] - stamps[0] + 0.011
    assert log.summary == ""


@pytest.mark.parametrize("jump_s", [1.74e9, 86_400.0, 3600.1, -1.5, -3600.0, -1.74e9])
def test_a_clock_that_is_set_during_a_log_costs_no_time_of_the_drive(tmp_path: Path, jump_s: float) -> None:
    times = [1e9 + 0.02 * n + (jump_s if n >= 40 else 0.0) for n in range(80)]
    log = candump(tmp_path / "clock.log", times)
    assert [record.at_s for record in log] == pytest.approx([0.02 * n for n in range(80)], abs=1e-3)
    assert log.malformed == 0
    assert "record 41: its time jumps by" in log.summary
    assert "the clock was set" in log.summary


@pytest.mark.parametrize("step_s", [0.01, 0.05, 0.1])
def test_a_second_log_in_the_file_goes_on_behind_the_first_however_short_that_is(tmp_path: Path, step_s: float) -> None:
    log = candump(tmp_path / "two.log", [step_s * n for n in (*range(10), *range(10))])
    assert [record.at_s for record in log] == pytest.approx([step_s * n for n in range(20)], abs=1e-6)
    assert "record 11: its time jumps by -" in log.summary


def test_a_second_bus_that_is_written_behind_the_first_is_no_second_log(tmp_path: Path) -> None:
    path = tmp_path / "buses.log"
    path.write_text("".join(f"({0.1 * n:.6f}) can{bus} 100#11\n" for bus in range(2) for n in range(5)))
    assert [at_s for at_s, _, _ in CanLog(path).messages()][-1] == pytest.approx(0.4)


def test_a_frame_that_comes_late_near_the_beginning_is_no_second_log(tmp_path: Path) -> None:
    log = candump(tmp_path / "late.log", [0.0, 0.03, 0.06, 0.01, 0.07, 0.08])
    assert [record.at_s for record in log][-1] == pytest.approx(0.08)
    assert log.summary == ""


@pytest.mark.parametrize(("digits", "step_s"), [(9, 0.01), (5, 0.02)])
def test_times_that_lost_their_digits_in_a_spreadsheet_are_told(tmp_path: Path, digits: int, step_s: float) -> None:
    path = tmp_path / "drive.csv"
    rows = (f"{1_714_557_601_000 + 1000 * step_s * n:.{digits}e},0x100,2,11 00\n" for n in range(400))
    path.write_text("Timestamp (ms),ID,DLC,Data\n" + "".join(rows))
    log = CanLog(path)
    assert len(list(log)) == 400
    assert ("all have one time" in log.summary) is (digits == 5)


def test_a_silence_of_minutes_is_kept_and_told(tmp_path: Path) -> None:
    log = candump(tmp_path / "pause.log", [START_S + 0.02 * n + (300.0 if n >= 40 else 0.0) for n in range(80)])
    assert [record.at_s for record in log][-1] == pytest.approx(301.58, abs=0.01)
    assert "300 s without a frame before it: a pause, or the clock was set" in log.summary


def test_one_frame_that_comes_late_keeps_its_place(tmp_path: Path) -> None:
    times = [START_S + 0.02 * n - (5.0 if n == 40 else 0.0) for n in range(80)]
    log = candump(tmp_path / "late.log", times)
    assert [record.at_s for record in log] == pytest.approx(
        [0.02 * n if n != 40 else 0.78 for n in range(80)], abs=1e-3
    )
    assert log.summary == ""


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_byte_order_mark_does_not_hide_the_number_base(tmp_path: Path, encoding: str) -> None:
    text = asc(EVEN, HEADER.replace("hex", "dec"), "d 2 16 14").replace("  100 ", "  256 ")
    log, times, frames = read(tmp_path / "drive.asc", text, encoding)
    assert len(times) == 40
    assert {(frame.arbitration_id, frame.data) for frame in frames} == {(256, bytes([16, 14]))}
    assert log.summary == ""


@pytest.mark.parametrize("first", ["", "\n", "; a note of another program\n", "Version 8.5.0\n"])
def test_the_number_base_is_found_wherever_it_stands_in_the_header(tmp_path: Path, first: str) -> None:
    text = first + asc(EVEN, HEADER.replace("hex", "dec").replace("no internal events logged\n", ""), "d 2 16 14")
    _, times, frames = read(tmp_path / "drive.asc", text)
    assert len(times) == 40
    assert frames[0].arbitration_id == 100


def test_a_log_without_a_number_base_says_what_is_assumed(tmp_path: Path) -> None:
    log, times, _ = read(tmp_path / "drive.asc", asc(EVEN, "no internal events logged\n"))
    assert len(times) == 40
    assert log.summary == "no line 'base': numbers are taken as hexadecimal"


def test_decimal_commas_and_stamps_below_zero_are_read(tmp_path: Path) -> None:
    log, times, _ = read(tmp_path / "comma.asc", asc([each.replace(".", ",") for each in EVEN]))
    assert times == pytest.approx([0.02 * n for n in range(40)])
    assert log.summary == ""
    log, times, _ = read(tmp_path / "negative.asc", asc([f"{0.02 * n - 0.4:.6f}" for n in range(40)]))
    assert times == pytest.approx([0.02 * n for n in range(40)])
    assert log.summary == ""


DLC = {
    ".asc": asc(EVEN, words="d F 10 0E 00 00 00 00 00 00"),
    ".log": "".join(f"({each}) can0 100#100E000000000000_F\n" for each in EVEN),
    ".csv": "timestamp,arbitration_id,extended,remote,error,dlc,data\n"
    + "".join(f"{each},0x100,0,0,0,15,EA4AAAAAAAA=\n" for each in EVEN),
    ".trc": ";$FILEVERSION=1.1\n;$STARTTIME=45000.5\n"
    + "".join(f"{n + 1:6d}) {20 * n:11.1f}  Rx         0100 15  10 0E 00 00 00 00 00 00\n" for n in range(40)),
}


@pytest.mark.parametrize("ending", DLC)
def test_a_classic_length_code_above_eight_means_eight_bytes(tmp_path: Path, ending: str) -> None:
    log, times, frames = read(tmp_path / f"drive{ending}", DLC[ending])
    assert times == pytest.approx([0.02 * n for n in range(40)], abs=1e-4)
    assert {frame.data for frame in frames} == {bytes.fromhex("100E000000000000")}
    assert not any(frame.fd for frame in frames)
    assert log.summary == ""


@pytest.mark.parametrize(
    ("line", "data", "fd"),
    [
        (" ({stamp})  can0  100   [8]  10 0E 00 00 00 00 00 00", "100E000000000000", False),
        (" ({stamp})  can0  100   [2]  10 0E   '..'", "100E", False),
        (" ({stamp})  can0  RX - -  100   [2]  10 0E", "100E", False),
        (" \x1b[31m({stamp})  can0  100   [2]  10 0E\x1b[0m", "100E", False),
        (" ({stamp})  can0  100  [12]  10 0E 00 00 00 00 00 00 00 00 00 01", "100E00000000000000000001", True),
        (" ({stamp})  can0  100  [02]  10 0E", "100E", True),
        (" ({stamp})  can0  100   {{F}}  10 0E 00 00 00 00 00 00", "100E000000000000", False),
        (" ({stamp})  can0  00000100   [1]  10", "10", False),
        ("({stamp}) can0 100#100E R", "100E", False),
    ],
)
def test_candumps_screen_form_is_read(tmp_path: Path, line: str, data: str, fd: bool) -> None:
    text = "".join(line.format(stamp=f"{START_S + 0.02 * n:.6f}") + "\n" for n in range(40))
    log, times, frames = read(tmp_path / "screen.log", text)
    assert times == pytest.approx([0.02 * n for n in range(40)], abs=1e-5)
    assert {(frame.arbitration_id, frame.data, frame.fd) for frame in frames} == {(0x100, bytes.fromhex(data), fd)}
    assert {frame.extended for frame in frames} == {"00000100" in line}
    assert log.summary == ""


def test_candumps_dates_are_read_and_a_request_is_one(tmp_path: Path) -> None:
    text = "".join(f" (2025-03-04 10:11:{n:02d}.500000)  can0  100   [4]  remote request\n" for n in range(10))
    _, times, frames = read(tmp_path / "drive.log", text)
    assert times == pytest.approx([float(n) for n in range(10)])
    assert all(frame.remote and frame.requested_bytes == 4 for frame in frames)


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.log", "  can0  100   [2]  10 0E\n", "candump's screen form without times; record with candump -L"),
        ("a.log", " (1.0)  can0  100   [2]  11`22\n", "is not a line of candump -L"),
        ("a.log", asc(EVEN[:2]), "it is an .asc log under another ending: rename it"),
        ("a.asc", "(1.0) can0 100#00\n", "it is a candump log under another ending: rename it to .log"),
        ("a.asc", "<html>no such file</html>\n", "was a download answered by a web page?"),
        ("a.blf", "version https://git-lfs.github.com/spec/v1\n", "a pointer of Git LFS"),
        ("a.log", "Time Stamp,ID,Extended,Dir,Bus,LEN,D1\n", "it is a table under another ending: rename it to .csv"),
        ("a.log.gz", "(1.0) can0 100#00\n", "it is not packed by gzip"),
        ("a.log", "***BUSMASTER Ver 3.2.2***\n", "a log of BUSMASTER: export it as .asc"),
        ("a.trc", "what is this\n", "is not a line of a .trc log"),
        ("a.asc", HEADER, "it has nothing but a header"),
    ],
)
def test_a_file_that_holds_no_frame_is_explained_without_a_librarys_words(
    tmp_path: Path, name: str, text: str, words: str
) -> None:
    log, times, _ = read(tmp_path / name, text)
    assert times == []
    assert words in log.nothing
    assert not re.search(r"unpack|literal|Error|invalid|expected \d", log.nothing)


def test_every_line_that_is_not_read_is_counted_by_its_kind(tmp_path: Path) -> None:
    lines = asc(EVEN).splitlines(keepends=True)
    odd = ["not of this format\n", "   0.1 1  Statistic: D 0\n", "   0.1 LIN 3F\n", "neither\n", "// a comment\n"]
    log, times, _ = read(tmp_path / "drive.asc", "".join([odd[0], *lines[:20], *odd, *lines[20:]]))
    assert len(times) == 40
    assert "3 lines not read, first line 1 is not an event of an .asc log: 'not of this format'" in log.summary
    assert "2 lines not read, first line 23 is no CAN frame (statistics, markers, other buses)" in log.summary


def test_of_several_buses_one_has_to_be_named(tmp_path: Path) -> None:
    path = tmp_path / "two.asc"
    path.write_text(asc(EVEN) + asc(["0.9"], "").replace(" 1  100", " 2  100"))
    wanted = r"two.asc holds 2 buses: channel 0 \(40 frames\), channel 1 \(1 frames\) \(counted from 0\); choose one with --x"
    with pytest.raises(UserError, match=wanted):
        check_channel(path, "", "--x")
    check_channel(path, "1", "--x")


@pytest.mark.parametrize(
    "line",
    ["({at}) can0 20000004#0001000000000000", " ({at})  can0  20000004   [8]  00 01 00 00 00 00 00 00   ERRORFRAME"],
)
def test_an_error_frame_of_candump_is_one_whatever_its_class(tmp_path: Path, line: str) -> None:
    _, times, frames = read(tmp_path / "drive.log", "".join(line.format(at=f"{each}") + "\n" for each in EVEN))
    assert len(times) == 40
    assert all(frame.error and not frame.data for frame in frames)


def test_a_long_row_of_a_table_is_a_can_fd_frame(tmp_path: Path) -> None:
    rows = "1.0,0x100,0,0,0,12,AAECAwQFBgcICQoL\n1.1,0x100,0,0,0,2,EA4=\n"
    log, _, frames = read(tmp_path / "drive.csv", "timestamp,arbitration_id,extended,remote,error,dlc,data\n" + rows)
    assert [(frame.fd, frame.data) for frame in frames] == [(True, bytes(range(12))), (False, b"\x10\x0e")]
    assert log.summary == ""


TRC_HEADS = {
    "1.1": ("     1)      1059.9  Rx         0300  2  10 0E  \n", ""),
    "1.2": ("     1)      1059.900  1  Rx         0300  2  10 0E  \n", ""),
    "1.3": ("     1)      1059.900  1  Rx         0300  -  2  10 0E  \n", ""),
    "2.1": ("     1      1059.900 DT 1      0300 Rx -  2    10 0E  \n", ";$COLUMNS=N,O,T,B,I,d,R,L,D\n"),
}


@pytest.mark.parametrize("version", TRC_HEADS)
def test_each_version_of_a_trc_log_is_read_and_its_head_may_end_in_semicolons(
    tmp_path: Path, version: str, capfd: pytest.CaptureFixture[str]
) -> None:
    line, columns = TRC_HEADS[version]
    head = f";$FILEVERSION={version} \n;$STARTTIME=39878.6772258947; \n{columns};   a note\n"
    log, _, frames = read(tmp_path / "drive.trc", head + line + line.replace("1059", "1079"))
    assert [(frame.arbitration_id, frame.data) for frame in frames] == [(0x300, b"\x10\x0e")] * 2
    assert log.summary == ""
    assert capfd.readouterr().err == ""


def test_a_state_of_the_bus_is_told_from_a_frame_that_is_cut(tmp_path: Path) -> None:
    rows = "     1)  1059.9  Warng  FFFFFFFF  4  00 00 00 04  BUSLIGHT\n     2)  1060.9  Rx  0300  8  10 0E\n"
    log, times, _ = read(tmp_path / "drive.trc", ";$FILEVERSION=1.1\n;$STARTTIME=39878.6\n" + rows)
    assert times == []
    assert "1 lines not read, first line 3 is no CAN frame (states and errors of the bus)" in log.summary
    assert "1 lines not read, first line 4 is not a line of a .trc log" in log.summary


def test_a_request_to_send_is_not_counted_beside_its_frame(tmp_path: Path) -> None:
    sent = "".join(f"   {each} 1  100             {kind}   {SPEED}\n" for each in EVEN for kind in ("TxRq", "Tx"))
    log, times, _ = read(tmp_path / "drive.asc", HEADER + sent)
    assert len(times) == 40
    assert "40 lines not read, first line 4 is no CAN frame" in log.summary


def test_empty_lines_in_the_head_of_a_trc_log_end_nothing(tmp_path: Path) -> None:
    line, columns = TRC_HEADS["2.1"]
    head = f";$FILEVERSION=2.1\r\n\r\n;$STARTTIME=39878.6772258947\r\n{columns}\r\n"
    log, times, _ = read(tmp_path / "drive.trc", f"{head}{line}\r\n{line.replace('1059', '1079')}")
    assert times == pytest.approx([0.0, 0.02])
    assert log.summary == ""


def test_a_clock_that_is_set_back_soon_after_the_beginning_costs_no_frame(tmp_path: Path) -> None:
    log = candump(tmp_path / "clock.log", [START_S + 0.02 * n - (8e4 if n >= 12 else 0.0) for n in range(40)])
    assert len(list(log)) == 40
    assert "record 13: its time jumps by" in log.summary
    assert log.malformed == 0


def test_a_measurement_behind_another_has_its_own_number_base(tmp_path: Path) -> None:
    head = "date Fri May 3 14:00:00 2024\nbase {}  timestamps absolute\n"
    first, second = (
        head.format("hex") + "   0.010000 1  100  Rx d 1 0A\n",
        head.format("dec") + "   0.020000 1  256  Rx d 1 10\n",
    )
    _, _, frames = read(tmp_path / "drive.asc", first + second)
    assert [(frame.arbitration_id, frame.data) for frame in frames] == [(0x100, b"\x0a")] * 2


def test_an_error_on_a_can_fd_bus_is_an_error_frame(tmp_path: Path) -> None:
    line = "   0.010000 CANFD   1 ErrorFrame  Not Acknowledge error, dominant error flag fffe c7 31ca Rx 0 0 f 0\n"
    log, _, frames = read(tmp_path / "drive.asc", HEADER + line)
    assert [frame.error for frame in frames] == [True]
    assert log.summary == ""


def test_an_error_frame_of_candump_is_of_its_own_bus(tmp_path: Path) -> None:
    path = tmp_path / "drive.log"
    path.write_text("(1.000000) can0 100#0A\n(1.010000) can1 20000080#0000000000000000\n")
    assert [channel for _, channel, _ in CanLog(path).messages()] == ["can0", "can1"]


@pytest.mark.parametrize("step_s", [0.1, 0.3, 2.5])
def test_a_clock_that_is_set_back_in_a_slow_log_stops_nothing(tmp_path: Path, step_s: float) -> None:
    log = candump(tmp_path / "slow.log", [START_S + step_s * n - (7600.0 if n >= 50 else 0.0) for n in range(150)])
    times = [record.at_s for record in log]
    assert times == pytest.approx(
        [step_s * n - (max(0.0, step_s - 0.1) if n >= 50 else 0.0) for n in range(150)], abs=1e-3
    )
    assert "record 51: its time jumps by -7," in log.summary


@pytest.mark.parametrize("seed", range(20))
def test_differences_of_busy_and_of_idle_buses_are_seen(tmp_path: Path, seed: int) -> None:
    chance = random.Random(seed)
    cycles = [chance.choice([0.01, 0.02, 0.1, 0.5, 1.0, 2.5]) for _ in range(chance.randint(1, 12))]
    clock = sorted(cycle * n * chance.uniform(0.999, 1.001) for cycle in cycles for n in range(1, 200))
    steps = [0.0, *(after - before for before, after in itertools.pairwise(clock))]
    text = "".join(f" ({step:010.6f})  can0  100   [2]  10 0E\n" for step in steps)
    log, times, _ = read(tmp_path / "drive.log", text)
    assert times == pytest.approx(list(itertools.accumulate(steps)), abs=1e-3)
    assert "added up" in log.summary


def test_an_asc_with_absolute_stamps_of_several_channels_in_turn_is_no_row_of_differences(tmp_path: Path) -> None:
    stamps = [f"{1.2 + 0.01 * turn + 0.005 * half:.6f}" for turn in range(60) for _ in range(4) for half in (0, 1)]
    log, times, _ = read(tmp_path / "drive.asc", asc(stamps))
    assert max(times) == pytest.approx(0.595)
    assert log.summary == ""


@pytest.mark.parametrize("count", [12, 16, 64])
def test_a_data_byte_of_a_long_frame_of_a_trc_log_is_no_length(tmp_path: Path, count: int) -> None:
    head = ";$FILEVERSION=2.0\n;$STARTTIME=43474.4249480671\n;$COLUMNS=N,O,T,I,d,l,D\n"
    data = ["12"] * count
    log, _, frames = read(tmp_path / "drive.trc", f"{head}      1      1.000 FD    0301 Rx {count} {' '.join(data)} \n")
    assert [frame.data for frame in frames] == [b"\x12" * count], log.summary


def test_a_log_that_is_packed_by_zip_says_so(tmp_path: Path) -> None:
    path = tmp_path / "drive.log"
    with zipfile.ZipFile(path, "w") as packed:
        packed.writestr("drive.log", "(1.0) can0 101#01\n")
    log = CanLog(path)
    assert list(log) == []
    assert "it is packed by zip: unpack it" in log.nothing


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("drive.log", "(1.0) can0 100#1122334455667788\n(1.1) can0 100#112233"),
        ("drive.asc", "base hex timestamps absolute\n 0.01 1 123 Rx d 2 11 22\n 0.02 1 123 Rx d 2 11 2"),
        (
            "drive.trc",
            ";$FILEVERSION=1.1\n;$STARTTIME=45413.5\n     1)    1.2  Rx     0123  2  11 22\n     2)    2.2  Rx     0123  2  11 2",
        ),
        (
            "drive.csv",
            "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2\n1000,00000123,false,Rx,0,2,11,22,\n2000,00000123,false,Rx,0,2,11,2",
        ),
    ],
)
def test_a_last_line_that_is_cut_within_its_bytes_is_left_out_and_told(tmp_path: Path, name: str, text: str) -> None:
    log, _, frames = read(tmp_path / name, text)
    assert len(frames) == 1
    assert "the last line does not end" in log.summary
    assert "left out" in log.summary
    _, _, frames = read(
        tmp_path / f"whole{name}",
        f"{text}{'2,' if name.endswith('csv') else '4455667788'[: 10 if 'can0' in text else 1]}",
    )
    assert len(frames) == 2


def test_a_clock_of_whole_seconds_is_no_row_of_differences(tmp_path: Path) -> None:
    rows = "".join(f"00:00:{1 + n // 70:02},0x123,11{n % 256:02X}\n" for n in range(200))
    log, times, _ = read(tmp_path / "drive.csv", f"time,id,data\n{rows}")
    assert max(times) == 2.0
    assert log.summary == ""


def test_an_asc_that_names_its_messages_says_what_to_do(tmp_path: Path) -> None:
    log, _, frames = read(tmp_path / "drive.asc", HEADER + "   0.010000 1  EngineData      Rx   d 2 11 22\n")
    assert frames == []
    assert "names its message and gives no id" in log.nothing


def test_an_error_frame_in_kvasers_table_is_no_data(tmp_path: Path) -> None:
    head = "Time,Channel,ID,Flags,DLC,Data0,Data1,Counter\n"
    _, _, frames = read(tmp_path / "drive.csv", f"{head}0.1,1,291,,2,17,34,1\n0.2,1,0,E,0,,,2\n")
    assert [frame.error for frame in frames] == [False, True]

"""Tables of frames as programs export them: time, id, bus, data, and what is refused rather than guessed."""

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.files.can_logs.log import CanLog
from tests.unit.drivemcp.files.can_logs.written import START_S

SPEED = bytes.fromhex("100E0000000000FF")
EXTENDED = bytes.fromhex("0102030405060708")
LONG = bytes(range(12))
TABLES = {
    "savvycan": (
        "Time Stamp,ID,Extended,Dir,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8\n",
        "1000000,00000100,false,Rx,0,8,10,0E,00,00,00,00,00,FF,\n",
        "1020000,18FEF100,true,Rx,0,8,01,02,03,04,05,06,07,08,\n",
    ),
    "kvaser": (
        "Kvaser Memorator Log\nSettings:,HEX\n\nTime,Channel,ID,Flags,DLC,Data0,Data1,Data2,Data3,Data4,Data5,Data6,Data7,Counter\n",
        "1.000000,0,100,,8,10,0E,00,00,00,00,00,FF,1\n",
        "1.020000,0,18FEF100,x,8,01,02,03,04,05,06,07,08,2\n",
    ),
    "kvaser in decimal": (
        "Time,Channel,ID (dec),Flags,DLC,Data0,Data1,Data2,Data3,Data4,Data5,Data6,Data7,Counter\n",
        "1.000000,0,256,,8,16,14,0,0,0,0,0,255,1\n",
        "1.020000,0,419361024,x,8,1,2,3,4,5,6,7,8,2\n",
    ),
    "vehicle spy": (
        "Vehicle Spy,3.9\nStart,1\nLine,Abs Time(Sec),Rel Time (Sec),Er,Description,Network,Arb ID,Remote,Xtd,B1,B2,B3,B4,B5,B6,B7,B8\n",
        '1,1.000,0,F,"HS CAN, $100",HS CAN,100,F,F,10,0E,00,00,00,00,00,FF,\n',
        "2,1.020,0.02,F,HS CAN $18FEF100,HS CAN,18FEF100,F,T,01,02,03,04,05,06,07,08,\n",
    ),
    "canedge": (
        "TimestampEpoch;BusChannel;ID;IDE;DLC;DataLength;Dir;EDL;BRS;DataBytes\n",
        "1578922367.777150;1;100;0;8;8;0;0;0;100E0000000000FF\n",
        "1578922367.797150;1;18FEF100;1;8;8;0;0;0;0102030405060708\n",
    ),
    "asammdf": (
        "timestamps,CAN_DataFrame.BusChannel,CAN_DataFrame.ID,CAN_DataFrame.IDE,CAN_DataFrame.DLC,CAN_DataFrame.DataLength,CAN_DataFrame.DataBytes\n",
        "1.00,1,256,0,8,8,[ 16  14   0   0   0   0   0 255]\n",
        "1.02,1,419361024,1,8,8,[1 2 3 4 5 6 7 8]\n",
    ),
    "cabana": ("time,addr,bus,data\n", "1.00,0x100,0,0x100e0000000000ff\n", "1.02,0x18fef100,0,0x0102030405060708\n"),
    "peak": (
        ";   a note\nMessage Number;Time Offset (ms);Type;ID (hex);Data Length Code;Data Bytes (hex)\n",
        "1;1000,0;Rx;0100;8;10 0E 00 00 00 00 00 FF\n",
        "2;1020,0;Rx;18FEF100;8;01 02 03 04 05 06 07 08\n",
    ),
    "a data set without header": ("",
        "1478198376.389427,0100,8,10,0e,00,00,00,00,00,ff,R\n",
        "1478198376.409427,18fef100,8,01,02,03,04,05,06,07,08,R\n"),
    "canalyst": (
        "Index,System Time,Time Stamp,Channel,Direction,ID,Type,Format,Length,Data\n",
        '0,"17:54:36.000.0",0xAB03EB,ch1,Receive,0x0100,DataFrame,StandardFrame,0x08,"x| 10 0E 00 00 00 00 00 FF"\n',
        '1,"17:54:36.020.0",0xAB04B3,ch1,Receive,0x18FEF100,DataFrame,ExtendedFrame,0x08,"x| 01 02 03 04 05 06 07 08"\n',
    ),
    "iso times": (
        "Timestamp,CAN ID,Data\n",
        "2025-03-04T10:11:12.000,100,10 0E 00 00 00 00 00 FF\n",
        "2025-03-04T10:11:12.020,18FEF100x,01-02-03-04-05-06-07-08\n",
    ),
    "milliseconds since 1970": (
        "Timestamp,ID,Data\n", "1741083072000,0x100,10 0E 00 00 00 00 00 FF\n", "1741083072020,0x18FEF100,01:02:03:04:05:06:07:08\n",
    ),
    "German": (
        "Zeit (s);ID;Length;Daten\n", "1,00;100h;8;10 0E 00 00 00 00 00 FF\n", "1,02;18FEF100h;8;01 02 03 04 05 06 07 08\n",
    ),
}  # fmt: skip


def read(path: Path, text: str, encoding: str = "utf-8") -> tuple[CanLog, list[tuple[Any, ...]]]:
    path.write_bytes(text.encode(encoding))
    log = CanLog(path)
    return log, [(round(each.at_s, 4), each.frame.arbitration_id, each.frame.extended, each.frame.data) for each in log]


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_table_of_another_program_is_read_by_the_names_of_its_columns(
    name: str, encoding: str, tmp_path: Path
) -> None:
    log, found = read(tmp_path / "drive.csv", "".join(TABLES[name]), encoding)
    assert found == [(0.0, 0x100, False, SPEED), (0.02, 0x18FEF100, True, EXTENDED)]
    assert log.summary == ""


def test_of_two_buses_of_a_table_one_is_replayed(tmp_path: Path) -> None:
    head, first, second = TABLES["cabana"]
    log, found = read(tmp_path / "drive.csv", head + first + second.replace(",0,", ",1,"))
    assert [each[1] for each in found] == [0x100]
    assert log.summary == "left out 1 frames of channel 1; this is channel 0"


def test_requests_errors_and_long_frames_of_a_table_are_told(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    path.write_text(
        f"Time,Arb ID,Remote,Er,DLC,EDL,Data\n1.00,100,1,0,4,0,\n1.01,0,0,1,0,0,\n1.02,1AB,0,0,12,1,{LONG.hex()}\n"
    )
    frames = [each.frame for each in CanLog(path)]
    assert [(each.remote, each.requested_bytes, each.error, each.fd, each.data) for each in frames] == [
        (True, 4, False, False, b""), (False, 0, True, False, b""), (False, 0, False, True, LONG),
    ]  # fmt: skip


def test_a_bad_row_costs_itself_alone(tmp_path: Path) -> None:
    head, first, second = TABLES["canedge"]
    log, found = read(tmp_path / "drive.csv", head + first + "1578922367.78;1;1G0;0;8;8;0;0;0;10\n\n" + second)
    assert len(found) == 2
    assert "drive.csv: line 3: is no row of this table: '1578922367.78;1;1G0" in log.summary


def test_numbers_that_may_be_in_either_base_are_taken_as_hexadecimal_and_it_is_told(tmp_path: Path) -> None:
    log, found = read(tmp_path / "drive.csv", "time,id,data\n1.0,100,10 11\n1.1,200,12 13\n")
    assert [each[1] for each in found] == [0x100, 0x200]
    assert "they are taken as such" in log.summary
    log, found = read(tmp_path / "drive.csv", "time,id,ide,d0\n1.0,2024,0,255\n1.1,2015,0,16\n")
    assert [(each[1], each[3]) for each in found] == [(2024, b"\xff"), (2015, b"\x10")]
    assert log.summary == ""


@pytest.mark.parametrize(
    ("times", "told"),
    [
        ([f"{20 * n}.0" for n in range(9)], "whole numbers"),
        ([f"{45_413.416_666 + n / 8_640_000:.12f}" for n in range(9)], "count days"),
        ([f"{739_373.416_66 + n / 8_640_000:.12f}" for n in range(9)], "count days"),
    ],
)
def test_times_that_are_no_seconds_say_what_to_do(times: list[str], told: str, tmp_path: Path) -> None:
    rows = "".join(f"{time},0x100,100E\n" for time in times)
    log, found = read(tmp_path / "drive.csv", "time,id,data\n" + rows)
    assert found == []
    assert told in log.nothing


def test_times_that_may_be_milli_or_microseconds_are_asked_for(tmp_path: Path) -> None:
    rows = "".join(f"{20 * n},0x100,100E\n" for n in range(9))
    log, found = read(tmp_path / "drive.csv", "time,id,data\n" + rows)
    assert found == []
    assert "its times are whole numbers, and its header names no unit: name the column `time_ms`" in log.nothing
    _, found = read(tmp_path / "drive.csv", "time_ms,id,data\n" + rows)
    assert [each[0] for each in found] == pytest.approx([0.02 * n for n in range(9)])


@given(
    st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)), min_size=1, max_size=20),
    st.sampled_from(["{:X}", "0x{:x}", "{:03X}", "{:08X}"]),
    st.sampled_from([" ", "", "-"]),
)
def test_every_frame_that_is_written_with_its_base_comes_back(
    tmp_path_factory: pytest.TempPathFactory, frames: list[tuple[int, bytes]], form: str, between: str
) -> None:
    rows = [
        f"{START_S + 0.01 * n:.3f},{form.format(number)},0,{data.hex(between) if between else data.hex()}\n"
        for n, (number, data) in enumerate(frames)
    ]
    log = CanLog(tmp_path_factory.mktemp("table") / "drive.csv")
    log.path.write_text("Time,ID (hex),IDE,Data (hex)\n" + "".join(rows))
    assert [(each.frame.arbitration_id, each.frame.data) for each in log] == frames
    assert log.malformed == 0


def test_a_table_of_decoded_signals_is_no_log(tmp_path: Path) -> None:
    log, found = read(tmp_path / "drive.csv", "Time[s],VehicleSpeed[km/h]\n0.0,50.1\n0.1,50.2\n")
    assert found == []
    assert "its header 'Time[s],VehicleSpeed[km/h]' names no columns `time_s`" in log.nothing
    assert "decoded signals make no frames" in log.nothing


@pytest.mark.parametrize("micro", ["µ", "μ"])
def test_a_unit_is_read_in_either_letter_for_micro(tmp_path: Path, micro: str) -> None:
    log, found = read(tmp_path / "drive.csv", f"Time ({micro}s),ID (hex),Data\n100,123,11\n200,124,12\n")
    assert [each.at_s for each in log] == pytest.approx([0.0, 1e-4])
    assert len(found) == 2


def test_a_row_that_lacks_bytes_is_told_and_changes_the_base_of_no_other(tmp_path: Path) -> None:
    rows = "1.00,0x100,2,1122\n1.01,0x100,2,112\n1.02,0x100,8,1122\n1.03,0x100,2,3344\n"
    log, found = read(tmp_path / "drive.csv", "time,id,len,data\n" + rows)
    assert [each[3] for each in found] == [b"\x11\x22", b"\x33\x44"]
    assert "line 3: is no row of this table" in log.notes[0]
    assert "record 3: 2 bytes where it says 8" in log.notes[1]


def test_a_length_code_of_a_long_frame_cuts_no_bytes(tmp_path: Path) -> None:
    head = f"time,id,dlc,{','.join(f'd{at}' for at in range(12))}\n"
    log, found = read(tmp_path / "drive.csv", head + f"1.00,0x100,9,{LONG.hex(',')}\n")
    assert [each[3] for each in found] == [LONG]
    assert log.summary == ""


def test_the_kind_of_a_frame_may_stand_in_one_column(tmp_path: Path) -> None:
    path = tmp_path / "drive.csv"
    kinds = ("Std Data", "Ext Data", "Remote Frame", "Error Frame", "CAN-FD", "CANFD")
    rows = "".join(f"1.0{at},100,{kind},1,0A\n" for at, kind in enumerate(kinds))
    path.write_text("Time,ID (hex),Frame Type,DLC,Data (hex)\n" + rows)
    frames = [each.frame for each in CanLog(path)]
    assert [(each.extended, each.remote, each.error, each.fd) for each in frames] == [
        (False, False, False, False), (True, False, False, False), (False, True, False, False), (False, False, True, False),
        (False, False, False, True), (False, False, False, True),
    ]  # fmt: skip


def test_numbers_too_large_for_an_id_in_hexadecimal_are_decimal(tmp_path: Path) -> None:
    _, found = read(tmp_path / "drive.csv", "time,id,data\n1.0,256,10 11\n1.1,419361024,12 13\n")
    assert [each[1] for each in found] == [0x100, 0x18FEF100]


@pytest.mark.parametrize("name", ["Chan", "Network"])
def test_a_bus_is_known_by_more_names(name: str, tmp_path: Path) -> None:
    log, _ = read(tmp_path / "drive.csv", f"time,{name},id,data\n1.0,1,0x100,0A\n1.1,2,0x100,0B\n")
    assert log.channels() == {"1": 1, "2": 1}


@pytest.mark.parametrize(
    "times",
    [
        ("10:00:00.100", "10:00:00.350"),
        ("01.05.2024 10:00:00,100", "01.05.2024 10:00:00,350"),
        ("5/1/2024 1:00:00.100 PM", "5/1/2024 1:00:00.350 PM"),
    ],
)
def test_times_of_day_are_read_and_one_that_is_none_is_named(times: tuple[str, str], tmp_path: Path) -> None:
    rows = "".join(f"{each};0x100;0A\n" for each in (*times, "25:00"))
    log, found = read(tmp_path / "drive.csv", "Time;ID;Data\n" + rows)
    assert [each[0] for each in found] == pytest.approx([0.0, 0.25])
    assert "line 4: its time '25:00' is neither seconds, a time of day nor an ISO 8601 time" in log.summary


def test_a_table_of_a_header_alone_says_so(tmp_path: Path) -> None:
    log, found = read(tmp_path / "drive.csv", TABLES["savvycan"][0])
    assert found == []
    assert log.nothing == "it has nothing but a header"


@pytest.mark.parametrize(
    "table",
    [
        "timestamp,ID (dec),data\n0.1,291,0x11 0x22 0x33\n",
        "timestamp,ID (dec),dlc,d0,d1,d2\n0.1,291,3,0x11,0x22,0x33\n",
        'timestamp,ID (hex),data\n0.1,123,"[0x11, 0x22, 0x33]"\n',
    ],
)
def test_bytes_that_say_their_base_are_read_by_it(table: str, tmp_path: Path) -> None:
    assert read(tmp_path / "drive.csv", table)[1] == [(0.0, 0x123, False, b"\x11\x22\x33")]


@pytest.mark.parametrize("before", [1, 5, 30])
@pytest.mark.parametrize("form", ["{}", "5/{day}/2024 {}"])
def test_times_of_day_go_on_over_midnight(before: int, form: str, tmp_path: Path) -> None:
    def at(n: int) -> str:
        second = (86_400 - before + n) % 86_400
        of_day = f"{second // 3600:02}:{second // 60 % 60:02}:{second % 60:02}.500"
        return form.format(of_day, day=1 if n < before else 2)

    rows = "".join(f"{at(n)},0x100,11 22\n" for n in range(40))
    log, found = read(tmp_path / "drive.csv", "time,id,data\n" + rows)
    assert [each[0] for each in found] == [float(n) for n in range(40)]
    assert log.summary == ""


def test_a_date_in_one_number_counts_seconds(tmp_path: Path) -> None:
    rows = "20170304130523143,0x100,11 22\n20170304130524143,0x100,11 22\n"
    assert [each[0] for each in read(tmp_path / "drive.csv", "Timestamp,ID,Data\n" + rows)[1]] == [0.0, 1.0]


@pytest.mark.parametrize(
    "header",
    [
        "Time (s);CAN-ID (hex);Rx/Tx;Type;Length;Data (hex)", "DateTime;FrameID;dir;kind;DLC;Data", "Date/Time;Frame ID;a;b;len;Data",
        "ts;Frame-ID;a;b;len;Bytes", "t;Can_Id;a;b;len;Payload", "Relative Time;COB-ID;a;b;DLC;Data", "Elapsed;ID;a;b;DLC;Data",
        "System Time;ID;a;b;DLC;Bytes (hex)",
    ],
)  # fmt: skip
def test_columns_are_known_by_more_names(header: str, tmp_path: Path) -> None:
    rows = "1.00;100h;Rx;Data;8;10 0E 00 00 00 00 00 FF\n1.02;18FEF100h;Rx;Data;8;01 02 03 04 05 06 07 08\n"
    _, found = read(tmp_path / "drive.csv", f"{header}\n{rows}")
    assert found == [
        (0.0, 0x100, False, bytes.fromhex("100E0000000000FF")), (0.02, 0x18FEF100, True, bytes.fromhex("0102030405060708")),
    ]  # fmt: skip


@pytest.mark.parametrize("name", ["Data Byte {}", "DATA[{}]", "DB{}", "d[{}]", "Byte_{}", "Byte {} (hex)"])
def test_a_column_of_one_byte_is_known_by_more_names(name: str, tmp_path: Path) -> None:
    names = ",".join(name.format(number) for number in range(2))
    _, found = read(tmp_path / "drive.csv", f"Time,ID,Bytes,{names}\n1.00,0x100,2,1A,0B\n1.02,0x101,1,1C,\n")
    assert [data.hex() for *_, data in found] == ["1a0b", "1c"]


@pytest.mark.parametrize(
    ("name", "per_s"), [("millis", 1e3), ("millis()", 1e3), ("micros", 1e6), ("milliseconds", 1e3), ("ts_ms", 1e3)]
)
def test_the_name_of_a_time_column_may_say_its_unit(name: str, per_s: float, tmp_path: Path) -> None:
    _, found = read(
        tmp_path / "drive.csv", f"{name},ID,Data\n{1000 * per_s:.0f},0x100,11 AA\n{1000.5 * per_s:.0f},0x100,11 AA\n"
    )
    assert [at_s for at_s, *_ in found] == [0.0, 0.5]


def test_a_column_of_a_clear_name_counts_before_one_that_may_mean_something_else(tmp_path: Path) -> None:
    text = "Relative Time,t,Time,Bytes,ID,Data\n0.02,7,1.00,2,0x100,11 AA\n0.02,7,1.50,2,0x100,11 BB\n"
    _, found = read(tmp_path / "drive.csv", text)
    assert [(at_s, data.hex()) for at_s, *_, data in found] == [(0.0, "11aa"), (0.5, "11bb")]


@pytest.mark.parametrize(
    "times", [("0 ms", "500 ms"), ("0.000s", "0.500s"), ("1,5 s", "2,0 s"), ("0us", "500000us"), ("0 µs", "500000 µs")]
)
def test_a_time_may_say_its_unit_itself(times: tuple[str, str], tmp_path: Path) -> None:
    rows = "".join(f"{time};0x100;11 AA\n" for time in times)
    _, found = read(tmp_path / "drive.csv", f"Time;ID;Data\n{rows}")
    assert [at_s for at_s, *_ in found] == [0.0, 0.5]

"""Recorded logs as the tools tell of them."""

import gzip
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import can
import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.errors import UserError
from services.can.diagnostics.addresses import ANSWER_IDS
from services.can.diagnostics.trouble_codes import DtcBook
from services.can.profiles.dbc import Dbc
from services.can.profiles.privacy import Privacy
from services.can.profiles.profile import Profile
from services.can.recorded import folder as folder_module
from services.can.recorded.analysis import IDS_LIMIT, analyse
from services.can.recorded.folder import LISTED_LIMIT, LogFolder
from services.can.recorded.series import series, thinned
from services.can.vehicle import Vehicle
from services.simulator.car.state import CarModel, Controls
from services.simulator.ecus.can_frames import FrameEncoder

VehicleOf = Callable[..., Vehicle]
START_S = 1_700_000_000.0
CODES = bytes([0x04, 0x43, 0x01, 0x40, 0x35, 0xAA, 0xAA, 0xAA])
LONG = [
    bytes([0x10, 0x0A, 0x43, 0x04, 0x01, 0x71, 0x03, 0x00]),
    bytes([0x21, 0x02, 0x17, 0x40, 0x35, 0xAA, 0xAA, 0xAA]),
]
UDS = bytes([0x07, 0x59, 0x02, 0xFF, 0x01, 0x18, 0x00, 0x09])
DM1 = bytes([0x40, 0xFF, 110, 0x00, 0x00, 0x01, 0xFF, 0xFF])


def message(at_s: float, arbitration_id: int, data: bytes, *, extended: bool = False) -> can.Message:
    return can.Message(
        timestamp=START_S + at_s, arbitration_id=arbitration_id, data=data, is_extended_id=extended, channel=0
    )


def write(path: Path, messages: Iterable[can.Message]) -> Path:
    with can.Logger(path) as log:
        for each in sorted(messages, key=lambda each: each.timestamp):
            log(each)
    return path


@pytest.fixture(scope="module")
def drive(dbc_path: Path) -> list[can.Message]:
    """Ten seconds of the simulated car, speed rising; no speed for 2 s from 4 s on."""
    encoder, model = FrameEncoder(dbc_path), CarModel()
    found: list[can.Message] = []
    for step in range(500):
        state = model.step(0.02, Controls(speed_mps=0.5 + step / 50))
        for frame in encoder.due(state, int((START_S + step / 50) * 1e9)):
            found.append(message(step / 50, frame.arbitration_id, frame.data))
    return found


@pytest.fixture
def vehicle_of(dbc: Dbc, profile: Profile, book: DtcBook) -> VehicleOf:
    def make(**privacy: bool) -> Vehicle:
        return Vehicle(
            {"can0": dbc},
            profile,
            book,
            lambda *_: None,
            privacy=Privacy(salt=b"s" * 32, **{"raw_access": True} | privacy),
        )

    return make


def test_ids_rates_and_ranges_are_those_of_the_drive(
    drive: list[can.Message], vehicle_of: VehicleOf, dbc: Dbc, tmp_path: Path
) -> None:
    found = analyse(write(tmp_path / "drive.blf", drive), vehicle_of())
    speed, _ = dbc.signal("VehicleSpeed")
    row = next(each for each in found.ids if each.name == speed.name)
    (signal,) = [each for each in found.signals if each.name == "VehicleSpeed"]
    heard = [float(speed.decode(each.data)["VehicleSpeed"]) for each in drive if each.arbitration_id == speed.frame_id]
    assert (found.frame_count, found.distinct_ids) == (len(drive), len({each.arbitration_id for each in drive}))
    assert found.duration_s == pytest.approx(9.98, abs=0.001)
    assert (row.count, row.rate_hz, row.median_period_ms) == (len(heard), 50.0, 20.0)
    assert (signal.samples, signal.unit) == (len(heard), speed.get_signal_by_name("VehicleSpeed").unit)
    assert (signal.min, signal.max, signal.first, signal.last) == pytest.approx(
        (min(heard), max(heard), heard[0], heard[-1]), abs=0.001
    )
    assert signal.mean == pytest.approx(sum(heard) / len(heard), abs=0.001)
    assert (found.malformed, found.remark, found.timing_gaps) == (0, "", [])


def test_a_silence_is_told_with_its_time(
    drive: list[can.Message], vehicle_of: VehicleOf, dbc: Dbc, tmp_path: Path
) -> None:
    lost = dbc.signal("VehicleSpeed")[0].frame_id
    kept = [each for each in drive if each.arbitration_id != lost or not 4.0 <= each.timestamp - START_S < 6.0]
    (gap,) = analyse(write(tmp_path / "gap.asc", kept), vehicle_of()).timing_gaps
    assert f"0x{lost:X}" in gap
    assert "2.02 s gap at t=4.0 s (normally every 20 ms)" in gap


def test_codes_of_every_protocol_are_seen_with_their_time(
    drive: list[can.Message], vehicle_of: VehicleOf, tmp_path: Path
) -> None:
    asked = [
        message(2.0, 0x7EA, CODES),
        message(3.001, 0x7E8, LONG[0]),
        message(3.002, 0x7E8, LONG[1]),
        message(4.0, 0x7E9, UDS),
        message(5.0, 0x18FECA00, DM1, extended=True),
        message(7.0, 0x18FECA00, DM1, extended=True),
    ]
    found = analyse(write(tmp_path / "codes.log", [*drive, *asked]), vehicle_of())
    assert {each.code: each.first_seen_s for each in found.obd_dtcs} == pytest.approx(
        {"C0035": 2.0, "P0171": 3.002, "P0300": 3.002, "P0217": 3.002, "P0118": 4.0}, abs=0.001
    )
    (fault,) = found.j1939_dtcs
    assert (fault.spn, fault.fmi, fault.source_address) == (110, 0, 0)
    assert (fault.first_seen_s, fault.last_seen_s) == pytest.approx((5.0, 7.0), abs=0.001)


@pytest.mark.parametrize(
    ("status", "seen"),
    [
        (0x00, False),
        (0x10, False),
        (0x40, False),
        (0x50, False),
        (0x01, True),
        (0x04, True),
        (0x08, True),
        (0x58, True),
        (0x20, True),
    ],
)
def test_a_code_whose_test_never_failed_is_no_trouble_code(
    status: int, seen: bool, vehicle_of: VehicleOf, tmp_path: Path
) -> None:
    answer = bytes([0x07, 0x59, 0x02, 0xFF, 0x01, 0x33, 0x11, status])
    found = analyse(write(tmp_path / "codes.log", [message(0.0, 0x7E8, answer)]), vehicle_of())
    assert [each.code for each in found.obd_dtcs] == ["P0133"] * seen


def test_a_signal_over_its_time_has_first_and_last_and_no_more_points_than_asked(
    drive: list[can.Message], vehicle_of: VehicleOf, tmp_path: Path
) -> None:
    found = series(write(tmp_path / "drive.asc", drive), vehicle_of(), "VehicleSpeed", 10)
    assert (len(found.points), found.samples_total) == (10, 500)
    assert (found.points[0].t_s, found.points[-1].t_s) == (0.0, 9.98)
    assert found.max == pytest.approx(max(float(each.value) for each in found.points), abs=0.5)


@given(st.integers(1, 300), st.integers(2, 50))
def test_thinning_keeps_the_ends_and_the_order(count: int, points: int) -> None:
    found = thinned([(float(number), number) for number in range(count)], points)
    assert len(found) == min(count, points)
    assert (found[0][1], found[-1][1]) == (0, count - 1)
    assert found == sorted(set(found))


def test_without_raw_access_only_curated_signals_are_told(
    drive: list[can.Message], vehicle_of: VehicleOf, tmp_path: Path
) -> None:
    path, car = write(tmp_path / "drive.blf", drive), vehicle_of(raw_access=False)
    found = analyse(path, car)
    curated = {name for messages in car.curated.values() for names in messages.values() for name in names}
    assert {each.name for each in found.signals} <= curated
    assert "raw_access is off" in found.held_back
    hidden = next(name for name in ("MotionCounter", "BodyCounter") if name not in curated)
    with pytest.raises(UserError, match="may not be told"):
        series(path, car, hidden, 10)


@pytest.mark.parametrize("allowed", [False, True])
def test_bytes_that_may_spell_the_number_are_told_where_it_is_allowed(
    allowed: bool, vehicle_of: VehicleOf, dbc: Dbc, tmp_path: Path
) -> None:
    described = next(each for key, each in dbc.messages.items() if key[1] in ANSWER_IDS)
    path = write(tmp_path / "answers.blf", [message(0.1 * n, described.frame_id, LONG[0]) for n in range(3)])
    found = analyse(path, vehicle_of(allow_vin=allowed))
    assert [each.arbitration_id for each in found.ids] == [f"0x{described.frame_id:X}"]
    assert bool(found.signals) is allowed


@pytest.mark.parametrize(
    "path", ["../secret.log", "/etc/passwd", "sub/../../secret.log", "link.log", "\0", "", ".", "a" * 300, "none.log"]
)
def test_nothing_outside_the_folder_is_read(path: str, tmp_path: Path) -> None:
    inside = tmp_path / "logs"
    inside.mkdir()
    (tmp_path / "secret.log").write_text("(0.0) can0 100#00\n")
    (inside / "link.log").symlink_to(tmp_path / "secret.log")
    with pytest.raises(UserError, match="list_can_logs") as told:
        LogFolder(str(inside)).find(path)
    assert "\n" not in str(told.value)
    assert LogFolder(str(inside)).files() == ([], False)


def test_logs_are_listed_two_folders_deep_and_bounded(tmp_path: Path) -> None:
    for name in ("b.asc", "a.log.gz", "notes.txt", ".git/c.log", "drive/d.blf", "drive/deeper/e.log"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(b"x")
    files, more = LogFolder(str(tmp_path)).files()
    assert ([each.path for each in files], more) == (["a.log.gz", "b.asc", "drive/d.blf"], False)
    for number in range(LISTED_LIMIT):
        (tmp_path / f"{number}.log").touch()
    files, more = LogFolder(str(tmp_path)).files()
    assert (len(files), more) == (LISTED_LIMIT, True)


def test_without_a_folder_the_setting_is_named() -> None:
    with pytest.raises(UserError, match="log_folder"):
        LogFolder("").find("drive.log")


def test_a_log_that_unpacks_beyond_the_limit_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(folder_module, "LARGEST_BYTES", 10_000_000)
    (tmp_path / "bomb.log.gz").write_bytes(gzip.compress(b" " * 12_000_000))
    with pytest.raises(UserError, match="cut it into parts"):
        LogFolder(str(tmp_path)).find("bomb.log.gz")


def test_frames_and_time_are_bounded(
    drive: list[can.Message], vehicle_of: VehicleOf, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write(tmp_path / "drive.blf", drive)
    monkeypatch.setattr(folder_module, "FRAMES_LIMIT", 100)
    found = analyse(path, vehicle_of())
    assert (found.truncated, found.frame_count) == (True, 100)
    assert "cut the log" in found.remark
    monkeypatch.setattr(folder_module, "FRAMES_LIMIT", 1_000_000)
    monkeypatch.setattr(folder_module, "TIME_LIMIT_S", -1.0)
    assert analyse(path, vehicle_of()).frame_count == folder_module.EVERY


def test_many_ids_are_counted_and_not_kept(vehicle_of: VehicleOf, tmp_path: Path) -> None:
    flood = [message(number / 1000, 0x10000 + number, b"\0", extended=True) for number in range(IDS_LIMIT + 5)]
    found = analyse(write(tmp_path / "flood.blf", flood), vehicle_of())
    assert (found.distinct_ids, found.frame_count) == (IDS_LIMIT, IDS_LIMIT + 5)
    assert "5 frames are of ids beyond" in found.remark


@pytest.mark.parametrize(
    "text", ["", "<html>no log</html>\n", "(x) can0 100#00\n", "(1.0) can0 100#0\n" * 5, "\x00\x01\x02" * 100]
)
def test_a_log_of_which_nothing_can_be_read_is_an_error_in_one_line(
    text: str, vehicle_of: VehicleOf, tmp_path: Path
) -> None:
    (tmp_path / "bad.log").write_text(text)
    with pytest.raises(UserError, match=r"bad\.log holds no frame") as told:
        analyse(tmp_path / "bad.log", vehicle_of())
    assert "\n" not in str(told.value)


@given(st.binary(max_size=64), st.sampled_from([".asc", ".blf", ".csv", ".log", ".trc", ".log.gz"]))
def test_no_bytes_break_the_reading(raw: bytes, ending: str) -> None:
    with tempfile.TemporaryDirectory() as place:
        path = Path(place, f"any{ending}")
        path.write_bytes(raw)
        reading = folder_module.Reading(LogFolder(place).find(path.name))
        assert len(list(reading)) == reading.frames


@pytest.mark.parametrize(
    ("signal", "message_name", "why"), [("Nothing", "", "analyze_can_log"), ("VehicleSpeed", "Body", "take one of")]
)
def test_an_unknown_signal_is_told_with_what_to_do(
    signal: str, message_name: str, why: str, drive: list[can.Message], vehicle_of: VehicleOf, tmp_path: Path
) -> None:
    with pytest.raises(UserError, match=why):
        series(write(tmp_path / "drive.blf", drive), vehicle_of(), signal, 10, message_name)


VOIDS = """VERSION ""
BU_: A
BO_ 256 Motion: 8 A
 SG_ Speed : 0|16@1+ (0.01,0) [0|0] "km/h" A
 SG_ Float : 32|32@1- (1,0) [0|0] "m/s" A
SIG_VALTYPE_ 256 Float : 1;
VAL_ 256 Speed 65535 "SNA" ;
"""


@pytest.fixture
def described(profile: Profile, book: DtcBook, tmp_path: Path) -> Callable[..., Vehicle]:
    """A vehicle of which all may be told, of a given description."""

    def make(text: str, **options: Any) -> Vehicle:
        (tmp_path / "car.dbc").write_text(text, encoding="utf-8")
        privacy = Privacy(salt=b"s" * 32, raw_access=True, **options)
        return Vehicle(
            {"can0": Dbc(tmp_path / "car.dbc")},
            msgspec.structs.replace(profile, fields={}),
            book,
            lambda *_: None,
            privacy=privacy,
        )

    return make


def test_what_is_no_measurement_is_counted_by_its_name_and_not_averaged(
    described: Callable[..., Vehicle], tmp_path: Path
) -> None:
    sound, void = bytes.fromhex("1027000000004841"), bytes.fromhex("FFFF00000000C07F")
    frames = [message(0.1 * n, 256, sound if n < 5 else void) for n in range(8)]
    path, car = write(tmp_path / "void.log", frames), described(VOIDS)
    rows = {each.name: each for each in analyse(path, car).signals}
    for name, value, words in (("Speed", 100.0, "SNA"), ("Float", 12.5, "not available")):
        row = rows[name]
        assert (row.min, row.max, row.mean, row.last, row.samples) == (value, value, value, value, 5)
        assert row.values == {words: 3}
        found = series(path, car, name, 10)
        assert (found.min, found.max, found.mean, found.points[-1].value) == (value, value, value, words)


SELECTED = """VERSION ""
BU_: A
BO_ 256 Motion: 8 A
 SG_ Mux M : 0|4@1+ (1,0) [0|0] "" A
 SG_ Speed : 16|16@1+ (0.01,0) [0|0] "km/h" A
 SG_ One m0 : 8|8@1+ (1,0) [0|0] "" A
 SG_ Last : 56|8@1+ (1,0) [0|0] "" A
"""


def test_a_selector_value_that_is_not_described_costs_no_other_signal(
    described: Callable[..., Vehicle], tmp_path: Path
) -> None:
    frames = [message(0.1 * n, 256, bytes([n % 2 * 2, 7, 0x10, 0x27, 0, 0, 0, 9])) for n in range(10)]
    found = analyse(write(tmp_path / "mux.log", frames), described(SELECTED))
    assert {each.name: each.samples for each in found.signals} == {"Mux": 10, "Speed": 10, "Last": 10, "One": 5}
    assert found.remark == ""


def test_of_short_frames_the_signals_that_they_hold_are_told_and_that_more_are_described(
    described: Callable[..., Vehicle], tmp_path: Path
) -> None:
    frames = [message(0.1 * n, 256, bytes([2, 7, 0x10, 0x27])) for n in range(6)]
    path, car = write(tmp_path / "short.log", frames), described(SELECTED)
    words = "6 frames of Motion are shorter than the 8 bytes described: signals beyond their end are left out"
    found = analyse(path, car)
    assert {each.name: each.samples for each in found.signals} == {"Mux": 6, "Speed": 6}
    assert found.remark == words
    assert series(path, car, "Speed", 5).remark == words


def test_a_message_that_is_hidden_for_the_number_is_named_and_a_voltage_is_told(
    described: Callable[..., Vehicle], tmp_path: Path
) -> None:
    text = (
        'VERSION ""\nBU_: A\nBO_ 256 Power: 8 A\n SG_ Vin : 0|16@1+ (0.01,0) [0|0] "V" A\n'
        'BO_ 257 Body: 8 A\n SG_ VIN_1 : 0|56@1+ (1,0) [0|0] "" A\n'
    )
    frames = [message(0.1 * n, 256 + n % 2, bytes.fromhex("1027000000000000")) for n in range(4)]
    found = analyse(write(tmp_path / "vin.log", frames), described(text))
    assert [(each.name, each.mean) for each in found.signals] == [("Vin", 100.0)]
    assert found.held_back.endswith("allow_vin is off: Body")

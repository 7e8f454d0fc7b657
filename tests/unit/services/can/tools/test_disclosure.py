"""The snapshot tells what a frame holds, and no number for what is no measurement."""

from pathlib import Path

import msgspec

from proto.sensors import CanFrame
from services.can.diagnostics.trouble_codes import DtcBook
from services.can.profiles.dbc import Dbc
from services.can.profiles.privacy import Privacy
from services.can.profiles.profile import Profile
from services.can.tools.answers import Scalar, Snapshot
from services.can.tools.disclosure import snapshot
from services.can.vehicle import Vehicle

DBC = """VERSION ""
BU_: A
BO_ 256 Motion: 8 A
 SG_ Speed : 0|32@1- (1,0) [0|0] "m/s" A
 SG_ Last : 56|8@1+ (1,0) [0|0] "" A
BO_ 257 Body: 8 A
 SG_ VIN_1 : 0|56@1+ (1,0) [0|0] "" A
SIG_VALTYPE_ 256 Speed : 1;
"""


def seen(tmp_path: Path, profile: Profile, book: DtcBook, *frames: tuple[int, str]) -> Snapshot:
    (tmp_path / "car.dbc").write_text(DBC, encoding="utf-8")
    bare = msgspec.structs.replace(profile, fields={})
    privacy = Privacy(salt=b"s" * 32, raw_access=True)
    vehicle = Vehicle({"can0": Dbc(tmp_path / "car.dbc")}, bare, book, lambda *_: None, privacy=privacy)
    told = [CanFrame(stamp_ns=1, arbitration_id=number, data=bytes.fromhex(data)) for number, data in frames]
    vehicle.ingest(told, 1, "can0")
    return snapshot(vehicle, 2, 0)


def values(found: Snapshot) -> dict[str, Scalar]:
    return {name: each.value for name, each in found.signals.items()}


def test_a_float_that_is_no_number_is_not_available(tmp_path: Path, profile: Profile, book: DtcBook) -> None:
    assert values(seen(tmp_path, profile, book, (256, "0000C07F00000009"))) == {"Speed": "not available", "Last": 9}


def test_a_short_frame_tells_the_signals_that_it_holds(tmp_path: Path, profile: Profile, book: DtcBook) -> None:
    assert values(seen(tmp_path, profile, book, (256, "00004841"))) == {"Speed": 12.5}


def test_a_message_that_may_spell_the_identification_number_is_named(
    tmp_path: Path, profile: Profile, book: DtcBook
) -> None:
    found = seen(tmp_path, profile, book, (256, "0000484100000009"), (257, "3141594100000000"))
    assert set(values(found)) == {"Speed", "Last"}
    assert found.held_back.endswith("allow_vin is off: Body")

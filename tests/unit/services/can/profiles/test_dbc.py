"""Bus descriptions of every format, several at once, and broken ones."""

import random
from pathlib import Path

import msgspec
import pytest

from services.can.errors import MalformedFrame, ProfileError
from services.can.profiles.dbc import NOT_AVAILABLE, Dbc
from services.can.profiles.profile import BusRule, FieldRule, Profile, VehicleRow
from services.can.signals.board import Board

DBC = """VERSION "1"
BS_:
BU_: A
BO_ 256 Motion: 8 A
 SG_ Speed : 0|16@1+ (0.01,0) [0|0] "m/s" A
"""
KCD = """<?xml version="1.0" encoding="UTF-8"?>
<NetworkDefinition xmlns="http://kayak.2codeornot2code.org/1.0"><Document name="d" version="1"/>
<Bus name="B"><Message id="0x100" name="Motion" length="8">
<Signal name="Speed" offset="0" length="16"><Value slope="0.01" unit="m/s"/></Signal>
</Message></Bus></NetworkDefinition>
"""
SYM = """FormatVersion=6.0 // made for this test
Title="t"

{SIGNALS}
Sig=Speed unsigned 16 /u:m/s /f:0.01

{SENDRECEIVE}

[Motion]
ID=100h
Len=8
Sig=Speed 0
"""
ARXML = """<?xml version="1.0" encoding="UTF-8"?>
<AUTOSAR xmlns="http://autosar.org/schema/r4.0"><AR-PACKAGES><AR-PACKAGE><SHORT-NAME>P</SHORT-NAME><ELEMENTS>
<CAN-CLUSTER><SHORT-NAME>C</SHORT-NAME><CAN-CLUSTER-VARIANTS><CAN-CLUSTER-CONDITIONAL><PHYSICAL-CHANNELS>
<CAN-PHYSICAL-CHANNEL><SHORT-NAME>B</SHORT-NAME><FRAME-TRIGGERINGS><CAN-FRAME-TRIGGERING><SHORT-NAME>T</SHORT-NAME>
<FRAME-REF DEST="CAN-FRAME">/P/Motion</FRAME-REF><CAN-ADDRESSING-MODE>STANDARD</CAN-ADDRESSING-MODE>
<IDENTIFIER>256</IDENTIFIER></CAN-FRAME-TRIGGERING></FRAME-TRIGGERINGS></CAN-PHYSICAL-CHANNEL>
</PHYSICAL-CHANNELS></CAN-CLUSTER-CONDITIONAL></CAN-CLUSTER-VARIANTS></CAN-CLUSTER>
<CAN-FRAME><SHORT-NAME>Motion</SHORT-NAME><FRAME-LENGTH>8</FRAME-LENGTH><PDU-TO-FRAME-MAPPINGS>
<PDU-TO-FRAME-MAPPING><SHORT-NAME>M</SHORT-NAME><PDU-REF DEST="I-SIGNAL-I-PDU">/P/Pdu</PDU-REF>
<START-POSITION>0</START-POSITION></PDU-TO-FRAME-MAPPING></PDU-TO-FRAME-MAPPINGS></CAN-FRAME>
<I-SIGNAL-I-PDU><SHORT-NAME>Pdu</SHORT-NAME><LENGTH>8</LENGTH><I-SIGNAL-TO-PDU-MAPPINGS><I-SIGNAL-TO-I-PDU-MAPPING>
<SHORT-NAME>S</SHORT-NAME><I-SIGNAL-REF DEST="I-SIGNAL">/P/Speed</I-SIGNAL-REF>
<PACKING-BYTE-ORDER>MOST-SIGNIFICANT-BYTE-LAST</PACKING-BYTE-ORDER><START-POSITION>0</START-POSITION>
</I-SIGNAL-TO-I-PDU-MAPPING></I-SIGNAL-TO-PDU-MAPPINGS></I-SIGNAL-I-PDU>
<I-SIGNAL><SHORT-NAME>Speed</SHORT-NAME><LENGTH>16</LENGTH><SYSTEM-SIGNAL-REF DEST="SYSTEM-SIGNAL">/P/Sys</SYSTEM-SIGNAL-REF>
</I-SIGNAL>
<SYSTEM-SIGNAL><SHORT-NAME>Sys</SHORT-NAME><PHYSICAL-PROPS><SW-DATA-DEF-PROPS-VARIANTS><SW-DATA-DEF-PROPS-CONDITIONAL>
<COMPU-METHOD-REF DEST="COMPU-METHOD">/P/Cm</COMPU-METHOD-REF><UNIT-REF DEST="UNIT">/P/U</UNIT-REF>
</SW-DATA-DEF-PROPS-CONDITIONAL></SW-DATA-DEF-PROPS-VARIANTS></PHYSICAL-PROPS></SYSTEM-SIGNAL>
<COMPU-METHOD><SHORT-NAME>Cm</SHORT-NAME><CATEGORY>LINEAR</CATEGORY><UNIT-REF DEST="UNIT">/P/U</UNIT-REF>
<COMPU-INTERNAL-TO-PHYS><COMPU-SCALES><COMPU-SCALE><COMPU-RATIONAL-COEFFS><COMPU-NUMERATOR><V>0</V><V>0.01</V>
</COMPU-NUMERATOR><COMPU-DENOMINATOR><V>1</V></COMPU-DENOMINATOR></COMPU-RATIONAL-COEFFS></COMPU-SCALE></COMPU-SCALES>
</COMPU-INTERNAL-TO-PHYS></COMPU-METHOD>
<UNIT><SHORT-NAME>U</SHORT-NAME><DISPLAY-NAME>m/s</DISPLAY-NAME></UNIT>
</ELEMENTS></AR-PACKAGE></AR-PACKAGES></AUTOSAR>
"""
FORMATS = {"dbc": DBC, "kcd": KCD, "sym": SYM, "arxml": ARXML}


@pytest.mark.parametrize("extension", FORMATS)
def test_the_same_message_is_read_from_each_format(tmp_path: Path, extension: str) -> None:
    (tmp_path / f"car.{extension}").write_text(FORMATS[extension], encoding="utf-8")
    dbc = Dbc(tmp_path / f"car.{extension}")
    message, signal = dbc.signal("Speed", "Motion")
    assert (message.frame_id, message.length, signal.unit) == (256, 8, "m/s")
    assert dbc.decode(256, b"\xd0\x07" + bytes(6)) == {"Speed": pytest.approx(20.0)}


BROKEN = [
    "",
    "BO_ x",
    "<?xml",
    "<a></a>",
    "{}",
    "\x00\xff",
    DBC.replace("0.01", "a"),
    DBC.replace("16@", "0@"),
    KCD[:300],
]
BROKEN += [SYM.replace("100h", "zz"), KCD.replace('length="16"', 'length="x"'), KCD.replace('id="0x100"', "")]
BROKEN += [ARXML[:900], ARXML.replace("<IDENTIFIER>256", "<IDENTIFIER>x"), ARXML.replace("/P/Pdu", "/P/None")]


@pytest.mark.parametrize("extension", [*FORMATS, "txt"])
@pytest.mark.parametrize("text", BROKEN)
def test_a_broken_description_is_told_in_one_line_with_its_file(tmp_path: Path, extension: str, text: str) -> None:
    path = tmp_path / f"car.{extension}"
    path.write_text(text, encoding="latin-1")
    try:
        dbc = Dbc(path)
    except ProfileError as error:
        assert str(error).startswith(f"car.{extension} cannot be read as a bus description: ")  # noqa: PT017
        assert "\n" not in str(error)  # noqa: PT017
    else:
        assert set(dbc.messages) <= {(False, 256)}


def test_several_descriptions_of_a_bus_are_one(tmp_path: Path) -> None:
    (tmp_path / "a.dbc").write_text(DBC, encoding="utf-8")
    (tmp_path / "b.sym").write_text(SYM.replace("100h", "101h").replace("Motion", "Other"), encoding="utf-8")
    dbc = Dbc(tmp_path / "a.dbc", tmp_path / "b.sym")
    assert set(dbc.messages) == {(False, 256), (False, 257)}
    assert dbc.signal("Speed", "Other")[0].frame_id == 257
    with pytest.raises(
        ProfileError, match=r"'Speed' stands in several messages; choose one with message = ...: Motion, Other"
    ):
        dbc.signal("Speed")


def test_a_frame_that_is_not_described_or_too_short_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.dbc").write_text(DBC, encoding="utf-8")
    dbc = Dbc(tmp_path / "a.dbc")
    with pytest.raises(MalformedFrame, match="no message with id 0x99"):
        dbc.decode(0x99, bytes(8))
    with pytest.raises(MalformedFrame, match="Motion has 8 bytes, not 3"):
        dbc.decode(256, bytes(3))
    with pytest.raises(MalformedFrame, match="no message with id 0x100"):
        dbc.decode(256, bytes(8), extended=True)


def test_two_messages_of_one_id_are_told_and_only_the_first_feeds_fields(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    other = KCD[KCD.index("<Bus") : KCD.index("</NetworkDefinition>")].replace("Motion", "Drive").replace('"B"', '"C"')
    path = tmp_path / "car.kcd"
    path.write_text(KCD.replace("</NetworkDefinition>", f"{other}</NetworkDefinition>"))
    dbc = Dbc(path)
    assert "0x100 is Motion and Drive; the first is taken for it" in caplog.text
    with pytest.raises(ProfileError, match=r"stands in several messages; choose one with message = ...: Drive, Motion"):
        dbc.signal("Speed")
    rule = FieldRule(signal="Speed", vss="Vehicle.Speed", unit="m/s", minimum=0.0, maximum=80.0)
    for name in ("Motion", "Drive"):
        fields = {"speed_mps": msgspec.structs.replace(rule, message=name)}
        vehicle = VehicleRow(tyre_nominal_bar=(2.4, 2.4, 2.4, 2.4))
        profile = Profile(name="x", buses={"can0": BusRule(description="car.kcd")}, vehicle=vehicle, fields=fields)
        if name == "Motion":
            Board({"can0": dbc}, profile)
        else:
            with pytest.raises(ProfileError, match="field speed_mps: Drive has the id 0x100 of Motion"):
                Board({"can0": dbc}, profile)


GROUP = """VERSION ""
BU_: A
BO_ 2566844926 Group: 8 A
 SG_ Speed : 8|16@1+ (0.00390625,0) [0|250.996] "km/h" A
 SG_ Gear : 24|8@1- (1,0) [-125|125] "" A
VAL_ 2566844926 Gear 0 "Neutral" -5 "SNA" ;
"""
FLOATS = """VERSION ""
BU_: A
BO_ 256 Motion: 8 A
 SG_ Speed : 0|32@1- (1,0) [0|0] "m/s" A
 SG_ Level : 32|8@1- (0.5,0) [0|0] "l" A
SIG_VALTYPE_ 256 Speed : 1;
VAL_ 256 Level 255 "SNA" ;
"""


def test_a_top_value_of_j1939_is_told_as_not_available(tmp_path: Path) -> None:
    (tmp_path / "a.dbc").write_text(GROUP, encoding="utf-8")
    dbc = Dbc(tmp_path / "a.dbc", protocol="j1939")
    assert dbc.decode(0x18FEF100, b"\xff\x00\x64\x00" + bytes(4)) == {"Speed": 100.0, "Gear": "Neutral"}
    assert dbc.decode(0x18FEF100, b"\xff\xff\xff\xfb" + bytes(4)) == {"Speed": "not available", "Gear": "SNA"}
    assert Dbc(tmp_path / "a.dbc").decode(0x18FEF1FE, b"\xff\xff\xff\x01" + bytes(4))["Speed"] == 0xFFFF / 256


def test_a_float_that_is_no_number_and_a_void_of_the_other_sign_are_no_numbers(tmp_path: Path) -> None:
    (tmp_path / "a.dbc").write_text(FLOATS, encoding="utf-8")
    dbc = Dbc(tmp_path / "a.dbc")
    assert dbc.decode(256, bytes.fromhex("0000484104000000")) == {"Speed": 12.5, "Level": 2.0}
    for number in ("0000C07F", "0000807F"):
        told = dbc.decode(256, bytes.fromhex(f"{number}FF000000"))
        assert told == {"Speed": "not available", "Level": "not available"}


def test_a_multiplexed_signal_without_a_selector_is_left_out_and_feeds_no_field(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    other = ' SG_ Count : 16|8@1+ (1,0) [0|0] "" A\n'
    (tmp_path / "car.dbc").write_text(DBC.replace("Speed :", "Speed m1 :") + other, encoding="utf-8")
    dbc = Dbc(tmp_path / "car.dbc")
    assert dbc.decode(256, bytes(8)) == {"Count": 0}
    assert "Motion.Speed: multiplexed, but by which signal is not said" in caplog.text
    rule = FieldRule(signal="Speed", vss="Vehicle.Speed", unit="m/s", minimum=0.0, maximum=80.0)
    vehicle = VehicleRow(tyre_nominal_bar=(2.4, 2.4, 2.4, 2.4))
    profile = Profile(
        name="x", buses={"can0": BusRule(description="car.dbc")}, vehicle=vehicle, fields={"speed_mps": rule}
    )
    with pytest.raises(ProfileError, match="by which signal is not said"):
        Board({"can0": dbc}, profile)


def test_a_scaled_selector_selects_the_same_signals_for_tools_as_for_fields(tmp_path: Path) -> None:
    selector = ' SG_ S M : 16|8@1+ (1,1) [0|0] "" A\n'
    (tmp_path / "car.dbc").write_text(DBC.replace("Speed :", "Speed m1 :") + selector, encoding="utf-8")
    dbc = Dbc(tmp_path / "car.dbc")
    assert dbc.decode(256, b"\xd0\x07\x01" + bytes(5)) == {"Speed": pytest.approx(20.0), "S": 2}
    assert dbc.decode(256, b"\xd0\x07\x00" + bytes(5)) == {"S": 1}


def test_a_whole_frame_is_told_as_cantools_reads_it_but_for_voids(dbc: Dbc) -> None:
    chance = random.Random(3)
    for message in dbc.messages.values():
        data = chance.randbytes(message.length)
        theirs = message.decode(data, decode_choices=True) if message.signals else {}
        told = dbc.signals_in(message, data)
        assert set(told) == set(theirs)
        assert all(value in (str(theirs[name]), theirs[name], NOT_AVAILABLE) for name, value in told.items())

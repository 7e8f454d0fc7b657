"""A bus description that cannot be read is told in words of the file."""

from pathlib import Path

import pytest

from drivemcp.errors import UserError
from drivemcp.files.bus_description import load_description, selections, unsound

DBC = 'VERSION ""\nBU_: ECU\nBO_ 256 Motion: {length} ECU\n SG_ Speed : 0|{bits}@1+ (0.01,0) [0|300] "km/h" ECU\n'


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (DBC.format(length="08", bits=16), "a number or a name in it is malformed"),
        ("no description", "Invalid syntax at line 1, column 1"),
        ("", "it is empty"),
        ("<!DOCTYPE html><html>", "was a download answered by a web page"),
        ("version https://git-lfs.github.com/spec/v1\n", "git lfs pull"),
    ],
)
def test_what_cannot_be_read_is_told(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "car.dbc"
    path.write_text(text)
    with pytest.raises(UserError, match=f"car.dbc cannot be read as a bus description: .*{words}"):
        load_description(path)


def test_an_absent_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"none.dbc cannot be read as a bus description: No such file"):
        load_description(tmp_path / "none.dbc")


def test_a_message_that_a_strict_reading_refuses_is_named(tmp_path: Path) -> None:
    path = tmp_path / "car.dbc"
    path.write_text(DBC.format(length=1, bits=16))
    assert list(unsound(path, load_description(path))) == [(False, 256)]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_a_description_is_read_in_the_encoding_that_it_is_written_in(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "car.dbc"
    path.write_bytes(DBC.format(length=8, bits=16).replace("km/h", "°C").encode(encoding))
    assert load_description(path).messages[0].signals[0].unit == "°C"


@pytest.mark.parametrize("encoding", ["UTF-8", "ISO-8859-1", "UTF-16"])
def test_the_encoding_that_xml_names_counts(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "car.kcd"
    signal = '<Signal name="Temp" offset="0" length="8"><Value unit="°C"/></Signal>'
    message = f'<Bus name="a"><Message id="0x100" length="8" name="Motion">{signal}</Message></Bus>'
    head = (
        f'<?xml version="1.0" encoding="{encoding}"?><NetworkDefinition xmlns="http://kayak.2codeornot2code.org/1.0">'
    )
    path.write_bytes(f"{head}{message}</NetworkDefinition>".encode(encoding))
    assert load_description(path).messages[0].signals[0].unit == "°C"


HEAD = 'VERSION ""\nBU_: A\nBO_ 291 M: 8 A\n'
SPEED = ' SG_ Speed m1 : 8|16@1+ (0.01,0) [0|0] "km/h" A\n'
SELECTOR = ' SG_ {0} : {1}|4@1+ (1,0) [0|0] "" A\n'


@pytest.mark.parametrize("selectors", [("S M", "T M"), ("S", "T"), ("S m0M",)])
def test_a_multiplexed_signal_without_one_clear_selector_is_refused_with_what_to_do(
    tmp_path: Path, selectors: tuple[str, ...]
) -> None:
    path = tmp_path / "car.dbc"
    path.write_text(HEAD + "".join(SELECTOR.format(name, 4 * at) for at, name in enumerate(selectors)) + SPEED)
    (message,) = load_description(path).messages
    with pytest.raises(UserError, match="by which signal is not said; mark one signal with M, or add SG_MUL_VAL_"):
        list(selections(message, message.get_signal_by_name("Speed")))
    assert len(message.signals) == len(selectors) + 1


def test_a_multiplexed_signal_of_a_long_name_is_refused_without_a_selector(tmp_path: Path) -> None:
    path, long = tmp_path / "car.dbc", "VehicleSpeedMeasuredByTheAntiLockBrakes"
    attribute = (
        'BA_DEF_ SG_ "SystemSignalLongSymbol" STRING ;\nBA_DEF_DEF_ "SystemSignalLongSymbol" "";\n'
        f'BA_ "SystemSignalLongSymbol" SG_ 291 {long[:32]} "{long}";\n'
    )
    path.write_text(HEAD + SPEED.replace("Speed", long[:32]) + attribute)
    (message,) = load_description(path).messages
    with pytest.raises(UserError, match=f"M.{long}: multiplexed"):
        list(selections(message, message.signals[0]))


def test_a_multiplexed_signal_with_one_selector_is_selected_by_it(tmp_path: Path) -> None:
    path = tmp_path / "car.dbc"
    path.write_text(HEAD + SELECTOR.format("S M", 0) + SPEED)
    (message,) = load_description(path).messages
    ((_, selector),) = selections(message, message.get_signal_by_name("Speed"))
    assert selector.name == "S"


WIDE = HEAD.replace("291", "2566844926") + SPEED.replace("Speed m1", "Speed")
TEXT, CHOICE = 'BA_DEF_ "ProtocolType" STRING ;\n', 'BA_DEF_ "ProtocolType" ENUM "CAN","J1939";\n'
DEFAULT, SET = 'BA_DEF_DEF_ "ProtocolType" "{}";\n', 'BA_ "ProtocolType" {};\n'
FORMAT = (
    'BA_DEF_ BO_ "VFrameFormat" ENUM "StandardCAN","ExtendedCAN","reserved","J1939PG";\n'
    'BA_DEF_DEF_ "VFrameFormat" "ExtendedCAN";\nBA_ "VFrameFormat" BO_ 2566844926 1;\n'
)


@pytest.mark.parametrize(
    ("attributes", "protocol"),
    [
        (TEXT + DEFAULT.format("J1939"), "j1939"),
        (TEXT + DEFAULT.format("j1939"), "j1939"),
        (TEXT + DEFAULT.format("") + SET.format('"J1939"'), "j1939"),
        (TEXT + DEFAULT.format("J1939") + SET.format('"CAN"'), None),
        (TEXT + DEFAULT.format(""), None),
        (CHOICE + DEFAULT.format("J1939"), "j1939"),
        (CHOICE + DEFAULT.format("CAN") + SET.format(1), "j1939"),
        (CHOICE + DEFAULT.format("J1939") + SET.format(0), None),
        (FORMAT + TEXT + DEFAULT.format("J1939"), None),
        ("", None),
    ],
)
def test_j1939_is_believed_from_the_attribute_or_its_default(
    tmp_path: Path, attributes: str, protocol: str | None
) -> None:
    path = tmp_path / "car.dbc"
    path.write_text(WIDE + attributes)
    assert load_description(path).messages[0].protocol == protocol

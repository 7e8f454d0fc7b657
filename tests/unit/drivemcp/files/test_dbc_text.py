"""One stray entry of a DBC costs itself alone."""

import logging
from pathlib import Path

import pytest

from drivemcp.errors import UserError
from drivemcp.files.bus_description import load_description
from drivemcp.files.dbc_text import mended

MESSAGE = 'BO_ 291 M: 8 A\n SG_ Speed : 0|16@1+ (0.01,0) [0|655] "km/h" A\n'
DBC = f'VERSION ""\nNS_ :\n\tBA_\n\tVAL_\nBU_: A\n{MESSAGE}'
DEFINED = (
    'BA_DEF_ BO_ "Kind" ENUM "a","b";\nBA_DEF_ BO_ "GenMsgCycleTime" INT 0 10000;\nBA_DEF_DEF_ "GenMsgCycleTime" 0;\n'
)
X = ' SG_ X : 0|8@1+ (1,0) [0|0] "" A\n'
NAMES = 'VAL_ 291 Speed 65535 "S;NA" ;\n'


@pytest.mark.parametrize(
    ("stray", "told"),
    [
        ('VAL_ 291 Gone 0 "a;b" 1 "c" ;', "VAL_ 291 Gone"),
        ('VAL_ 300 Speed 0 "a" ;', "VAL_ 300 Speed"),
        ("SIG_VALTYPE_ 291 Gone : 1;", "SIG_VALTYPE_ 291 Gone"),
        ('BA_ "Nowhere" BO_ 291 20;', 'BA_ "Nowhere" BO_ 291 = 20'),
        ('BA_ "GenMsgCycleTime" BO_ 291 "soon";', 'BA_ "GenMsgCycleTime" BO_ 291 = "soon"'),
        (f'BO_ 419361278 N: 8 A\n{X}VAL_ 419361278 X 0 "a" ;', "message N (its id 0x18FEF1FE has more than 11"),
        (f'BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 A\n{X}VAL_ 3221225472 X 0 "a" ;', "VAL_ 3221225472 X"),
    ],
)  # fmt: skip
def test_an_entry_of_nothing_is_left_out_and_told(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, stray: str, told: str
) -> None:
    path = tmp_path / "car.dbc"
    path.write_text(f"{DBC}\n{DEFINED}{stray}\n{NAMES}")
    (message,) = load_description(path).messages
    assert message.name == "M"
    assert message.signals[0].choices == {65535: "S;NA"}
    assert "car.dbc: left out since it fits nothing in the file: " in caplog.text
    assert told in caplog.text


def test_a_sound_description_is_left_as_it_is(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    text = f'{DBC}\n{DEFINED}BA_ "Kind" BO_ 291 1;\n{NAMES}'
    assert mended(text) == (f"{text}\n", [])
    (tmp_path / "car.dbc").write_text(text)
    with caplog.at_level(logging.WARNING):
        load_description(tmp_path / "car.dbc")
    assert not caplog.records


@pytest.mark.parametrize(
    "attribute", ['"ProtocolType" "J1939"', '"VFrameFormat" BO_ 291 3', '"GenSigFuncType" SG_ 291 Speed 1']
)
def test_what_says_how_frames_are_to_be_read_is_never_left_out(tmp_path: Path, attribute: str) -> None:
    (tmp_path / "car.dbc").write_text(f"{DBC}BA_ {attribute};\n")
    with pytest.raises(UserError, match="cannot be read as a bus description"):
        load_description(tmp_path / "car.dbc")


def test_a_description_of_impossible_ids_alone_is_refused(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "car.dbc").write_text(DBC.replace("291", "419361278"))
    with pytest.raises(UserError, match="0x18fef1fe is more than 11 bits"):
        load_description(tmp_path / "car.dbc")
    assert not caplog.records


def test_the_number_that_an_id_of_29_bits_is_written_with_is_told() -> None:
    _, (told,) = mended(DBC.replace("291", "419361278"))
    assert told.endswith("; write 2566844926 for one of 29 bits)")


def test_of_many_entries_the_first_are_named(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    strays = "".join(f'VAL_ 291 Gone{number} 0 "a" ;\n' for number in range(8))
    (tmp_path / "car.dbc").write_text(DBC + strays)
    load_description(tmp_path / "car.dbc")
    assert "VAL_ 291 Gone4, and 3 more" in caplog.text

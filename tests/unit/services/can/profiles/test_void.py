"""What a value table names is no measurement, however the name is written."""

from typing import Any

import pytest
from cantools.database import load_string

from services.can.profiles.extract import extractor

DBC = """VERSION ""
BU_: A
BO_ 291 M: 8 A
 SG_ Speed : 0|16@1{sign} (0.01,0) [{limits}] "{unit}" A
VAL_ 291 Speed {raw} "{text}" ;
"""


def void(raw: int, text: str, *, sign: str = "+", limits: str = "0|0", unit: str = "km/h", heard: int = 65534) -> bool:
    """Whether a raw value as it is heard is no measurement, where the table names `raw` so."""
    database: Any = load_string(DBC.format(sign=sign, limits=limits, unit=unit, raw=raw, text=text), "dbc")
    message = database.messages[0]
    one = extractor(message, message.signals[0])
    data = heard.to_bytes(2, "little") + bytes(6)
    return one.void is not None and one.void(one.raw(data))


@pytest.mark.parametrize(
    "text",
    [
        "SNA", "DI_UI_SPEED_SNA", "ESP_VEHICLE_SPEED_SNA", "SpeedSNA", "Faulty", "NoDataExists", "No_Data_Exists", "NoData",
        "Unknown", "Unbekannt", "Value invalid", "Invalid / SNA", "SignalInvalid", "Speed invalid", "Not Available (SNA)",
        "Signal Not Available", "SIGNALNOTAVAILABLE", "Not Available/Not Installed", "Not_Supported", "not_avail", "N.A.", "n/v",
        "Sensor failure", "Failed", "Defect", "Timeout", "Undef", "UNDEFINED_VALUE", "No value", "NotUsed_3", "Low_Voltage", "--",
        "Unterspannung", "Initialisierung", "Init", "Initwert", "nicht definiert", "nicht_verbaut", "nicht verfügbar",
        "NichtVerfuegbar", "ungültiger Wert", "Signal fehlerhaft", "Signal nicht vorhanden", "kein Signal", "kein gültiger Wert",
        "keine Daten", "Non disponible", "No disponible", "non valido", "reserved",
    ],
)  # fmt: skip
def test_a_name_that_says_no_measurement_is_understood_within_other_words(text: str) -> None:
    assert void(65534, text)
    assert not void(65534, text, heard=1000)


@pytest.mark.parametrize(
    "text",
    ["LimitSpeed_250", "Standstill", "No error", "kein Fehler", "Day_6", "Navigation", "Reserve", "Snapshot", "Maximum"],
)  # fmt: skip
def test_a_name_of_a_measurement_is_believed(text: str) -> None:
    assert not void(65534, text)


@pytest.mark.parametrize(
    ("text", "expected"), [("DI_GEAR_SNA", True), ("Unknown", True), ("Fault", False), ("No signal", False)]
)
def test_of_a_signal_without_a_unit_a_fault_may_be_what_it_reports(text: str, expected: bool) -> None:
    assert void(65534, text, unit="") is expected


@pytest.mark.parametrize(
    ("sign", "raw", "heard"),
    [("-", 32768, 0x8000), ("-", 65535, 0xFFFF), ("-", -32768, 0x8000), ("-", -1, 0xFFFF), ("+", -1, 0xFFFF)],
)
def test_a_name_counts_whichever_sign_its_number_is_written_with(sign: str, raw: int, heard: int) -> None:
    assert void(raw, "SNA", sign=sign, heard=heard)
    assert not void(raw, "SNA", sign=sign, heard=0)


def test_a_name_of_a_number_that_the_signal_cannot_hold_is_of_no_other_number() -> None:
    assert not void(65536, "SNA", heard=0)


@pytest.mark.parametrize(
    ("limits", "raw", "unit", "expected"),
    [
        ("0|655.3", 65535, "km/h", True),
        ("0|655.35", 65535, "km/h", False),
        ("0.32|600", 0, "km/h", True),
        ("0|600", 65535, "", False),
    ],
)
def test_a_named_value_outside_the_range_of_a_quantity_is_no_measurement(
    limits: str, raw: int, unit: str, expected: bool
) -> None:
    assert void(raw, "keine_Anzeige", limits=limits, unit=unit, heard=raw) is expected

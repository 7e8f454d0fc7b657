"""OBD answers in words: formulas of SAE J1979 at known points, several parameters at once, monitors, and who answers."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.can.diagnostics import obd, pids

# Raw bytes and values as the standard's table gives them: the ends of ranges, and zero points.
POINTS = [
    (0x04, "ff", {"engine_load": 100.0}),
    (0x05, "00", {"coolant_temperature": -40}),
    (0x06, "80", {"short_term_fuel_trim_bank_1": 0.0}),
    (0x0C, "ffff", {"engine_speed": 16383.75}),
    (0x0E, "00", {"timing_advance": -64.0}),
    (0x10, "ffff", {"air_flow": 655.35}),
    (0x14, "c880", {"oxygen_sensor_b1s1_voltage": 1.0, "oxygen_sensor_b1s1_trim": 0.0}),
    (0x23, "0001", {"fuel_rail_pressure": 10}),
    (0x24, "80008000", {"oxygen_sensor_1_lambda": 1.0, "oxygen_sensor_1_voltage": 4.0}),
    (0x32, "ffff", {"evaporative_vapour_pressure": -0.25}),
    (0x34, "80008000", {"oxygen_sensor_1_lambda": 1.0, "oxygen_sensor_1_current": 0.0}),
    (0x3C, "0190", {"catalyst_temperature_b1s1": 0.0}),
    (0x42, "3039", {"control_unit_voltage": 12.345}),
    (0x54, "8000", {"evaporative_pressure": -32768}),
    (0x5D, "6900", {"injection_timing": 0.0}),
    (0x5E, "0014", {"fuel_rate": 1.0}),
    (0x61, "7d", {"torque_demanded": 0}),
    (0x67, "012800", {"coolant_temperature_sensor_1": 0}),
    (0xA6, "0001e240", {"odometer": 12345.6}),
]


@pytest.mark.parametrize(("pid", "raw", "said"), POINTS)
def test_a_parameter_is_what_the_standard_says(pid: int, raw: str, said: dict[str, float]) -> None:
    found = obd.decode(bytes([0x41, pid]) + bytes.fromhex(raw))
    assert {name: value for name, value in found.items() if name != "unit"} == pytest.approx(said)


def test_no_name_stands_twice_and_every_part_lies_within_its_parameter() -> None:
    names = [part.name for pid in pids.PIDS.values() for part in pid.parts]
    assert len(names) - len(set(names)) == 8  # narrow and wide band sensors are told apart by voltage and current
    assert all(part.start + part.size <= pid.size for pid in pids.PIDS.values() for part in pid.parts)
    assert len(pids.PIDS) + len(pids.CODED) + len(pids.MONITORS) > 100


def test_several_parameters_in_one_answer_stand_side_by_side() -> None:
    answer = bytes.fromhex("41 0c 1a f8 0d 5a 1c 06")
    assert obd.decode(answer) == {
        "engine_speed": 1726,
        "vehicle_speed": 90,
        "obd_standard": "EOBD",
        "units": {"engine_speed": "rpm", "vehicle_speed": "km/h"},
    }


def test_what_follows_a_parameter_of_unknown_size_is_not_guessed() -> None:
    assert list(obd.values(bytes.fromhex("0d 5a 6d 00 0c 1a f8"))) == [(0x0D, b"\x5a")]


def test_monitors_name_what_is_ready_by_the_kind_of_engine() -> None:
    spark = obd.decode(bytes.fromhex("41 01 83 07 65 21"))
    assert (spark["malfunction_lamp"], spark["stored_count"]) == (1, 3)
    assert spark["ready"]["misfire"]
    assert not spark["ready"]["catalyst"]
    assert not spark["ready"]["oxygen_sensor"]
    assert spark["ready"]["oxygen_sensor_heater"]
    diesel = obd.decode(bytes.fromhex("41 01 00 0b 4a 40"))
    assert diesel["ready"] == {
        "misfire": True,
        "fuel_system": True,
        "nox_aftertreatment": True,
        "boost_pressure": True,
        "particulate_filter": False,
    }


def test_a_freeze_frame_names_its_code_and_its_values() -> None:
    assert obd.decode(bytes.fromhex("42 02 00 03 00")) == {"freeze_frame_code": "P0300"}
    assert obd.decode(bytes.fromhex("42 0d 00 5a"))["vehicle_speed"] == 90


@pytest.mark.parametrize(
    ("service", "wanted"), [(1, ()), (2, (1, 2)), (1, (1, 2, 3, 4, 5, 6, 7)), (256, ()), (1, (300,))]
)
def test_a_request_that_cannot_be_is_told(service: int, wanted: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="pid"):
        obd.request(service, wanted)


@given(st.binary(max_size=40))
def test_no_answer_breaks_the_decoding(answer: bytes) -> None:
    obd.decode(answer)
    obd.answers_to(b"\x01\x0d", answer)


@given(st.integers(0, 0xFF), st.integers(0, 0xFF), st.binary(min_size=1, max_size=6))
def test_an_answer_belongs_to_the_question_for_its_parameter_only(asked: int, pid: int, value: bytes) -> None:
    assert obd.answers_to(bytes([1, asked]), bytes([0x41, pid]) + value) == (asked == pid)

"""ISO 14229 in words, against the simulated units' own answers."""

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.can.diagnostics import uds
from services.can.errors import MalformedFrame
from services.simulator.car.state import CarState
from services.simulator.ecus.answers import Services
from services.simulator.ecus.code_memory import CodeMemory
from services.simulator.ecus.parameters import BRAKES, ENGINE

STATE = CarState(speed_mps=25.0, engine_rpm=2000.0, stored_codes=("P0300", "C0035"), lamps=frozenset({"engine"}))


@pytest.fixture
def units() -> Services:
    memory = CodeMemory()
    memory.observe(STATE)
    return Services("WDM0SIM0000000001", memory)


def test_codes_come_with_their_status(units: Services) -> None:
    payload = uds.codes_request("by_status", 0x08, "", 1)
    (found,) = uds.words(payload, units.answer(BRAKES, payload, STATE))["codes"]
    assert found["code"] == "C0035"
    assert {"test_failed", "confirmed", "warning_indicator_requested"} <= set(found["status"])
    assert "pending" not in found["status"]


def test_a_snapshot_is_the_car_when_the_code_was_set(units: Services) -> None:
    payload = uds.codes_request("snapshot", 0, "P0300", 1)
    (found,) = uds.words(payload, units.answer(ENGINE, payload, STATE))["codes"]
    values = {name: value for part in found["snapshot"] for name, value in part.items()}
    assert values["vehicle_speed"] == 90
    assert values["engine_speed"] == 2000


def test_extended_data_are_given_as_they_are(units: Services) -> None:
    payload = uds.codes_request("extended", 0, "C0035-00", 1)
    (found,) = uds.words(payload, units.answer(BRAKES, payload, STATE))["codes"]
    assert found["extended"] == {"0x01": "01"}


def test_all_supported_codes_are_listed(units: Services) -> None:
    payload = uds.codes_request("supported", 0, "", 1)
    codes = {row["code"] for row in uds.words(payload, units.answer(BRAKES, payload, STATE))["codes"]}
    assert "C0035" in codes
    assert all(code.startswith("C") for code in codes)


def test_identifiers_are_parameters_texts_or_bytes(units: Services) -> None:
    said: dict[str, object] = {}
    for identifier in (0xF40D, 0xF197, 0x0202):
        payload = uds.identifier_request(identifier)
        said |= uds.words(payload, units.answer(BRAKES if identifier == 0x0202 else ENGINE, payload, STATE))
    assert said == {"vehicle_speed": 90, "unit": "km/h", "system_name": "engine", "identifier_0202": "0000"}


@pytest.mark.parametrize("code", ["", "X0300", "P0300-1", "P03", "p4300"])
def test_what_is_no_code_is_told(code: str) -> None:
    with pytest.raises(ValueError, match="code"):
        uds.codes_request("snapshot", 0, code, 1)


def test_a_refusal_is_told_in_words() -> None:
    assert uds.refusal(0x22) == "conditions not correct"
    assert uds.refusal(0xF5) == "code 0xF5"


@given(
    st.sampled_from([b"\x22\xf1\x97", b"\x19\x02\xff", b"\x19\x04\x03\x00\x00\x01", b"\x19\x0a"]),
    st.binary(max_size=40),
)
def test_nonsense_is_malformed_and_nothing_else(payload: bytes, rest: bytes) -> None:
    with contextlib.suppress(MalformedFrame):
        uds.words(payload, bytes([payload[0] + 0x40]) + rest)

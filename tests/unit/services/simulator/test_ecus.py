"""Simulated control units: they answer from the car's state, by the standards."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from proto.sensors import CanFrame
from services.can.profile import load_profile
from services.simulator import car_faults
from services.simulator.car_condition import SOUND
from services.simulator.car_state import CarState
from services.simulator.ecus import ENGINE, TEST_UNIT, EcuBank

STANDING = CarState()
NS = 1_000_000_000


def ask(bank: EcuBank, request_id: int, payload: bytes, state: CarState = STANDING) -> list[CanFrame]:
    data_bytes = bytes([len(payload)]) + payload + bytes(7 - len(payload))
    return bank.on_frame(CanFrame(stamp_ns=0, arbitration_id=request_id, data=data_bytes), state, 0)


def test_the_speed_answered_is_the_speed_driven() -> None:
    answer = ask(EcuBank(), 0x7DF, b"\x01\x0d", CarState(speed_mps=25.0))
    assert [(frame.arbitration_id, frame.data[:4]) for frame in answer] == [(0x7E8, b"\x03\x41\x0d\x5a")]


def test_the_hot_preset_reaches_a_hot_value_and_sets_code_and_lamp() -> None:
    bank = EcuBank()
    bank.activate("overheat")
    bank.affect(STANDING, 0)
    state = bank.affect(STANDING, 60 * NS)
    assert state.coolant_temperature_c >= 130.0
    assert state.stored_codes == ("P0217",)
    assert "coolant" in state.lamps
    assert ask(bank, 0x7E0, b"\x03", state)[0].data[:5] == bytes([4, 0x43, 1, 0x02, 0x17])
    assert ask(bank, 0x7E0, b"\x01\x05", state)[0].data[3] == round(state.coolant_temperature_c + 40)


def test_faults_add_up_and_none_ends_them() -> None:
    bank = EcuBank()
    bank.activate("abs_unit")
    bank.activate("low_tyre")
    bank.affect(STANDING, 0)
    state = bank.affect(STANDING, 30 * NS)
    assert state.abs_fault
    assert state.stored_codes == ("C0550", "C0765")
    assert state.lamps == {"abs", "stability", "tyre"}
    assert not bank.faults.condition(30 * NS).anti_lock
    bank.activate("none")
    assert bank.affect(STANDING, 31 * NS) == STANDING
    assert bank.faults.condition(31 * NS) == SOUND


def test_an_unknown_fault_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match="overheat"):
        EcuBank().activate("explode")


def test_codes_are_cleared_standing_only_and_an_active_fault_sets_its_own_again() -> None:
    bank = EcuBank()
    bank.activate("low_fuel")
    old = replace(STANDING, stored_codes=("P0420",))
    moving = bank.affect(replace(old, speed_mps=10.0), 0)
    assert ask(bank, 0x7E0, b"\x04", moving)[0].data[:4] == bytes([3, 0x7F, 0x04, 0x22])
    assert ask(bank, 0x7E0, b"\x04", bank.affect(old, NS))[0].data[:2] == bytes([1, 0x44])
    assert bank.affect(old, 2 * NS).stored_codes == ("P0462",)


def test_a_question_to_everybody_that_nobody_knows_is_met_with_silence() -> None:
    assert ask(EcuBank(), 0x7DF, b"\x01\xc1") == []
    assert ask(EcuBank(), 0x7E0, b"\x01\xc1")[0].data[:4] == bytes([3, 0x7F, 0x01, 0x31])


def test_the_bitmap_lists_exactly_the_parameters_that_are_answered() -> None:
    bank = EcuBank()
    listed = set()
    for base in (0x00, 0x20, 0x40):
        bits = int.from_bytes(ask(bank, 0x7E0, bytes([1, base]))[0].data[3:7], "big")
        listed |= {base + i for i in range(1, 33) if bits >> (32 - i) & 1}
    answered = {pid for pid in range(1, 0x60) if ask(bank, 0x7E0, bytes([1, pid]))[0].data[1] == 0x41}
    assert listed | {0x00} == answered | {0x00}


def test_the_profile_names_the_faults_that_the_car_knows() -> None:
    scenarios = load_profile(data("vehicles/sim/profile.toml")).fault_scenarios
    known = {name: row.routine for name, row in scenarios.items()}
    assert known == {fault.preset: fault.routine for fault in car_faults.FAULTS.values()} | {
        "none": car_faults.CLEAR_ROUTINE
    }


@settings(max_examples=200, deadline=None)
@given(
    st.sampled_from([0x7DF, ENGINE, 0x7E1, 0x7E2, 0x7E3, TEST_UNIT, 0x123]),
    st.binary(max_size=8),
    st.booleans(),
)
def test_no_frame_breaks_the_units(request_id: int, payload: bytes, extended: bool) -> None:
    bank = EcuBank()
    frame = CanFrame(stamp_ns=0, arbitration_id=request_id, data=payload, extended=extended)
    for answer in bank.on_frame(frame, STANDING, 0) + bank.step(NS):
        assert 0x7E8 <= answer.arbitration_id <= 0x7EF
        assert len(answer.data) == 8

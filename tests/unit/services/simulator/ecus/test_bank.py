"""Simulated control units: they answer from the car's state, by the standards."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from proto.sensors import CanFrame
from services.can.profiles.profile import load_profile
from services.simulator.car import faults
from services.simulator.car.condition import SOUND
from services.simulator.car.state import CarState
from services.simulator.ecus.bank import EcuBank
from services.simulator.ecus.parameters import BODY, BRAKES, ENGINE, TEST_UNIT, TRANSMISSION, UNITS

STANDING = CarState()
NS = 1_000_000_000


def ask(bank: EcuBank, request_id: int, payload: bytes, state: CarState = STANDING) -> list[CanFrame]:
    return ask_at(bank, request_id, payload, state, 0)


def ask_at(bank: EcuBank, request_id: int, payload: bytes, state: CarState, now_ns: int) -> list[CanFrame]:
    data_bytes = bytes([len(payload)]) + payload + bytes(7 - len(payload))
    request = CanFrame(stamp_ns=0, arbitration_id=request_id, data=data_bytes, extended=request_id > 0x7FF)
    return bank.on_frame(request, state, now_ns)


def whole(bank: EcuBank, request_id: int, payload: bytes, state: CarState = STANDING) -> bytes:
    """One unit's whole answer."""
    first = ask(bank, request_id, payload, state)[0]
    if first.data[0] >> 4 == 0:
        return first.data[1 : 1 + first.data[0]]
    flow = CanFrame(stamp_ns=0, arbitration_id=request_id, data=b"\x30\x00\x00", extended=request_id > 0x7FF)
    rest = bank.on_frame(flow, state, 0)
    length = (first.data[0] & 0x0F) << 8 | first.data[1]
    return (first.data[2:] + b"".join(frame.data[1:] for frame in rest))[:length]


def with_codes(*stored: str, **changes: object) -> CarState:
    return replace(STANDING, stored_codes=stored, **changes)  # type: ignore[arg-type]


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


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("service", [0x01, 0x02])
def test_the_bitmaps_list_exactly_the_parameters_that_are_answered(unit: int, service: int) -> None:
    bank = EcuBank()
    bank.memory.observe(with_codes("P0300", "P0700", "C0035", "B0001"))
    frame = b"" if service == 0x01 else b"\x00"
    said = {pid: whole(bank, unit, bytes([service, pid]) + frame) for pid in range(0x100)}
    answered = {pid for pid, answer in said.items() if answer[0] == service + 0x40}
    listed = {0x00}
    for base in range(0, 0x100, 0x20):
        bits = int.from_bytes(said[base][-4:], "big") if base in answered else 0
        listed |= {base + i for i in range(1, 33) if bits >> (32 - i) & 1}
    assert listed == answered


def test_the_profile_names_the_faults_that_the_car_knows() -> None:
    scenarios = load_profile(data("vehicles/sim/profile.toml")).fault_scenarios
    known = {name: row.routine for name, row in scenarios.items()}
    assert known == {fault.preset: fault.routine for fault in faults.FAULTS.values()} | {"none": faults.CLEAR_ROUTINE}


@settings(max_examples=200, deadline=None)
@given(
    st.sampled_from([0x7DF, ENGINE, 0x7E1, 0x7E2, 0x7E3, TEST_UNIT, 0x123, 0x18DB33F1, 0x18DA28F1]),
    st.one_of(
        st.binary(max_size=8), st.binary(min_size=1, max_size=7).map(lambda payload: bytes([len(payload)]) + payload)
    ),
    st.booleans(),
)
def test_no_frame_breaks_the_units(request_id: int, payload: bytes, extended: bool) -> None:
    bank = EcuBank()
    bank.memory.observe(with_codes("P0300", "C0035"))
    frame = CanFrame(stamp_ns=0, arbitration_id=request_id, data=payload, extended=extended)
    for answer in bank.on_frame(frame, with_codes("P0300", "C0035"), 0) + bank.step(NS):
        assert answer.arbitration_id in range(0x7E8, 0x7F0) or answer.arbitration_id >> 8 == 0x18DAF1
        assert answer.extended == (answer.arbitration_id > 0x7FF)
        assert len(answer.data) == 8


def test_all_units_answer_on_29_bits_as_on_11() -> None:
    short, long = ask(EcuBank(), 0x7DF, b"\x03"), ask(EcuBank(), 0x18DB33F1, b"\x03")
    assert [frame.data for frame in short] == [frame.data for frame in long]
    assert [frame.arbitration_id for frame in long] == [0x18DAF110, 0x18DAF118, 0x18DAF128, 0x18DAF140]


@pytest.mark.parametrize(
    ("unit", "payload", "code"),
    [
        (ENGINE, b"\x08", 0x11),
        (ENGINE, b"\x19\x55", 0x12),
        (ENGINE, b"\x22\xf1", 0x13),
        (BRAKES, b"\x22\xf4\x0c", 0x31),
        (BODY, b"\x22\x01\x00", 0x33),
        (BODY, b"\x2e\x01\x00\x00", 0x7F),
    ],
)
def test_a_unit_says_why_it_refuses(unit: int, payload: bytes, code: int) -> None:
    assert whole(EcuBank(), unit, payload) == bytes([0x7F, payload[0], code])


def test_a_moving_car_is_neither_cleared_nor_reset() -> None:
    moving = with_codes("P0300", speed_mps=3.0)
    for payload in (b"\x04", b"\x14\xff\xff\xff", b"\x11\x01"):
        assert whole(EcuBank(), ENGINE, payload, moving) == bytes([0x7F, payload[0], 0x22])


def test_an_extended_session_is_left_after_five_quiet_seconds() -> None:
    bank, write = EcuBank(), b"\x2e\x01\x00\x00"
    ask_at(bank, BODY, b"\x10\x03", STANDING, 0)
    assert ask_at(bank, BODY, write, STANDING, NS)[0].data[3] == 0x33
    assert ask_at(bank, BODY, write, STANDING, 7 * NS)[0].data[3] == 0x7F


def test_a_unit_that_was_reset_is_silent_for_a_moment() -> None:
    bank = EcuBank()
    assert ask_at(bank, BODY, b"\x11\x03", STANDING, 0)[0].data[:3] == b"\x02\x51\x03"
    assert ask_at(bank, BODY, b"\x3e\x00", STANDING, NS // 10) == []
    assert ask_at(bank, BODY, b"\x3e\x00", STANDING, NS)[0].data[:3] == b"\x02\x7e\x00"


def test_a_long_search_is_announced_and_answered_later() -> None:
    bank = EcuBank()
    assert ask_at(bank, BODY, b"\x19\x0a", STANDING, 0)[0].data[:4] == b"\x03\x7f\x19\x78"
    assert bank.step(NS // 10) == []
    assert b"\x59\x0a\xaf" in bank.step(NS // 4)[0].data


def test_the_freeze_frame_is_the_car_when_the_code_was_set() -> None:
    bank = EcuBank()
    bank.step(0, replace(STANDING, speed_mps=20.0))
    bank.step(NS, with_codes("P0300", speed_mps=25.0))
    later = with_codes("P0300", speed_mps=5.0)
    bank.step(2 * NS, later)
    assert whole(bank, ENGINE, b"\x02\x02\x00", later) == b"\x42\x02\x00\x03\x00"
    assert whole(bank, ENGINE, b"\x02\x0d\x00", later) == b"\x42\x0d\x00\x5a"
    assert whole(bank, ENGINE, b"\x01\x0d", later) == b"\x41\x0d\x12"
    assert whole(bank, TRANSMISSION, b"\x02\x02\x00", later) == b"\x42\x02\x00\x00\x00"


def test_pending_becomes_stored_becomes_permanent_and_only_the_repair_ends_it() -> None:
    bank = EcuBank()
    lit = frozenset({"engine"})
    pending = replace(STANDING, pending_codes=("P0300",))
    stored = with_codes("P0300", lamps=lit)
    bank.step(0, pending)
    assert whole(bank, ENGINE, b"\x07", pending) == b"\x47\x01\x03\x00"
    assert whole(bank, ENGINE, b"\x19\x02\x04", pending)[3:] == b"\x03\x00\x00\x26"
    bank.step(NS, stored)
    assert whole(bank, ENGINE, b"\x03", stored) == b"\x43\x01\x03\x00"
    assert whole(bank, ENGINE, b"\x01\x01", stored)[2] == 0x81
    assert whole(bank, ENGINE, b"\x19\x02\x08", stored)[3:] == b"\x03\x00\x00\xab"
    assert whole(bank, ENGINE, b"\x04", stored) == b"\x44"
    assert whole(bank, ENGINE, b"\x0a", stored) == b"\x4a\x01\x03\x00"
    bank.step(2 * NS, STANDING)
    assert whole(bank, ENGINE, b"\x0a") == b"\x4a\x00"


def test_a_loose_filler_cap_is_pending_first_and_then_stored_with_its_lamp() -> None:
    bank = EcuBank()
    bank.activate("fuel_cap_loose")
    begun = bank.affect(STANDING, NS)
    bank.step(NS, begun)
    assert whole(bank, ENGINE, b"\x07", begun) == b"\x47\x01\x04\x57"
    assert whole(bank, ENGINE, b"\x03", begun) == b"\x43\x00"
    assert begun.lamps == frozenset()
    later = bank.affect(STANDING, NS + int(faults.FAULTS["fuel_cap_loose"].pending_s * NS))
    bank.step(30 * NS, later)
    assert whole(bank, ENGINE, b"\x07", later) == b"\x47\x00"
    assert whole(bank, ENGINE, b"\x03", later) == b"\x43\x01\x04\x57"
    assert later.lamps == {"engine"}


def test_monitors_are_not_ready_after_clearing_until_the_car_has_run() -> None:
    bank = EcuBank()
    assert whole(bank, ENGINE, b"\x04") == b"\x44"
    assert whole(bank, ENGINE, b"\x01\x01")[5] != 0
    assert whole(bank, ENGINE, b"\x01\x01", replace(STANDING, run_time_s=1300.0))[5] == 0

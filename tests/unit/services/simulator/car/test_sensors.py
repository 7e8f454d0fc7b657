"""Faulty sensors change what is told, never the car; and the car's own units find what contradicts itself."""

import math
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from services.can.diagnostics.trouble_codes import DtcBook
from services.simulator.car.car import Car, CarMessages
from services.simulator.car.condition import SensorFault
from services.simulator.car.faults import FAULTS, Faults
from services.simulator.car.monitor import RESPONSES
from services.simulator.car.sensors import SENSORS, CarSensors, read
from services.simulator.car.state import CarModel, CarState, Controls
from services.simulator.ecus.can_frames import FrameEncoder

STEP_S, STEP_NS = 0.05, 50_000_000


def drive(
    preset: str, seconds: float = 12.0, *, severity: float = 1.0, onset_s: float = 4.0
) -> tuple[Car, list[CarMessages]]:
    """A car that speeds up and slows down gently, with a fault from `onset_s` on."""
    faults, told = Faults(), []
    whole = Car(3, faults, 15.0)
    for step in range(1, round(seconds / STEP_S) + 1):
        if preset and not faults.active and step * STEP_S >= onset_s:
            faults.activate(preset, severity)
        swing = step * STEP_S * math.pi / 5.0
        controls = Controls(
            speed_mps=20.0 - 5.0 / math.pi * math.cos(swing), acceleration_mps2=math.sin(swing), accelerator=0.1
        )
        told.append(whole.step(STEP_S, controls, step * STEP_NS))
    return whole, told


def test_a_stuck_wheel_speed_sensor_freezes_and_the_others_go_on() -> None:
    _, told = drive("wheel_rl_stuck")
    after = [each.frames.wheel_speeds_mps for each in told[85:]]
    assert len({wheels[2] for wheels in after}) == 1
    assert len({wheels[0] for wheels in after}) == len(after)


def test_the_car_s_own_units_give_up_anti_lock_over_a_stuck_wheel_after_a_while() -> None:
    whole, told = drive("wheel_rl_stuck", 30.0)
    first = next(number for number, each in enumerate(told) if each.frames.abs_fault)
    assert first * STEP_S > 4.0 + 2.0
    assert told[-1].frames.stored_codes == ("C0045",)
    assert {"abs", "stability"} <= told[-1].frames.lamps
    assert not whole.ability(31 * 20 * STEP_NS).anti_lock


def test_a_missing_wheel_is_found_sooner_than_a_stuck_one_and_forgotten_when_it_is_mended() -> None:
    faults = Faults()
    faults.activate("wheel_fr_missing")
    whole, controls = Car(3, faults, 15.0), Controls(speed_mps=20.0)
    for step in range(20):
        told = whole.step(STEP_S, controls, step * STEP_NS)
    assert told.frames.stored_codes == ("C0040",)
    assert math.isnan(told.frames.wheel_speeds_mps[1])
    assert not math.isnan(told.units.wheel_speeds_mps[1])
    faults.activate("none")
    for step in range(20, 22):
        told = whole.step(STEP_S, controls, step * STEP_NS)
    assert told.frames.stored_codes == ()
    assert not told.frames.abs_fault


def test_a_silent_unit_sends_nothing_and_speaks_again_when_it_is_mended() -> None:
    faults, encoder = Faults(), FrameEncoder(data("vehicles/sim/sim.dbc"))
    whole, seen = Car(3, faults, 15.0), []
    for step in range(120):
        if step == 40:
            faults.activate("brake_unit_silent")
        if step == 80:
            faults.activate("none")
        told = whole.step(STEP_S, Controls(speed_mps=20.0), step * STEP_NS)
        seen.append({frame.arbitration_id for frame in encoder.due(told.frames, step * STEP_NS, told.silent)})
    assert 0x100 in seen[39]
    assert not any({0x100, 0x101, 0x102, 0x103} & ids for ids in seen[40:80])
    assert 0x110 in seen[60]
    assert 0x100 in seen[81]


def test_the_codes_that_faults_set_are_told_in_words() -> None:
    book = DtcBook.load(data("vehicles/dtc.toml"))
    codes = {code for fault in FAULTS.values() for code in fault.codes} | {each.code for each in RESPONSES.values()}
    for code in codes:
        text = book.explain(code, "en")
        assert text.generic
        assert text.severity in ("note", "service", "careful", "stop_soon", "stop_now")
        assert code not in text.summary


def test_a_sound_car_finds_nothing_wrong_with_itself() -> None:
    assert all(not each.frames.stored_codes and not each.frames.lamps for each in drive("", 30.0)[1])


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(sorted(SENSORS)), st.sampled_from(["stuck", "noisy", "offset", "missing"]), st.floats(0.1, 1.0))
def test_a_sensor_fault_never_changes_the_car(sensor: str, kind: str, severity: float) -> None:
    faulty, sound = drive(f"{sensor}_{kind}", severity=severity)[0].state, drive("")[0].state
    assert faulty == sound


@pytest.mark.parametrize("sensor", sorted(SENSORS))
def test_each_kind_of_fault_shows_as_what_it_is(sensor: str) -> None:
    place, state = SENSORS[sensor], replace(_driven(), brake_pressure_bar=40.0)
    true = read(place, state)

    def told(kind: str) -> list[float]:
        sensors = CarSensors(5)
        fault = SensorFault(sensor, kind)  # type: ignore[arg-type]
        return [read(place, sensors.measure(state, (fault,))) for _ in range(400)]

    assert all(math.isnan(each) for each in told("missing"))
    assert len(set(told("stuck"))) == 1
    bound = 4 * place.sigma + 5 * place.bias * (true if place.still else 1.0)
    assert sum(told("offset")) / 400 - true == pytest.approx(place.offset, abs=bound)
    spread = sum(abs(each - true) for each in told("noisy")) / 400
    assert spread > 0.5 * place.noisy


def _driven() -> CarState:
    return CarModel().step(STEP_S, Controls(speed_mps=20.0, yaw_rate_radps=0.1))

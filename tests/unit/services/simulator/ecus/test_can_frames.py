"""The encoder: every message at its cycle time, every value within its range, and read back as it was."""

import math
from collections import Counter
from dataclasses import replace
from typing import Any

import cantools.database
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from services.simulator.car.car import Car
from services.simulator.car.faults import FAULTS, Faults
from services.simulator.car.state import CarModel, CarState, Controls
from services.simulator.ecus.can_frames import MESSAGES, FrameEncoder, crc8

DBC = data("vehicles/sim/sim.dbc")
DATABASE: Any = cantools.database.load_file(DBC)
MS = 1_000_000
ENCODER = FrameEncoder(DBC)


def read(state: CarState, message: str) -> dict[str, float]:
    frame = ENCODER.encode(message, state)
    decoded: dict[str, float] = DATABASE.decode_message(frame.arbitration_id, frame.data, decode_choices=False)
    return decoded


def test_messages_come_at_the_cycle_times_of_the_bus_description() -> None:
    encoder, counts = FrameEncoder(DBC), Counter[str]()
    for step in range(101):  # five seconds in steps of the physics
        for frame in encoder.due(CarState(), step * 50 * MS):
            counts[DATABASE.get_message_by_frame_id(frame.arbitration_id).name] += 1
    expected = {m.name: 5000 / m.cycle_time + 1 for m in DATABASE.messages if m.cycle_time}
    assert {name: pytest.approx(count, abs=1) for name, count in expected.items()} == dict(counts)


def test_frames_are_stamped_when_they_were_due_and_in_that_order() -> None:
    encoder = FrameEncoder(DBC)
    encoder.due(CarState(), 0)
    stamps = [frame.stamp_ns for frame in encoder.due(CarState(), 100 * MS)]
    assert stamps == sorted(stamps)
    assert set(stamps) == {20 * MS, 40 * MS, 60 * MS, 80 * MS, 100 * MS}


def test_after_a_pause_the_bus_is_not_flooded() -> None:
    encoder = FrameEncoder(DBC)
    encoder.due(CarState(), 0)
    assert len(encoder.due(CarState(), 3600_000 * MS)) <= 20


def test_the_counter_moves_with_every_frame() -> None:
    encoder = FrameEncoder(DBC)
    counters = [
        DATABASE.decode_message(frame.arbitration_id, frame.data)["MotionCounter"]
        for step in range(20)
        for frame in encoder.due(CarState(), step * 20 * MS)
        if frame.arbitration_id == 0x101
    ]
    assert counters == [step % 16 for step in range(20)]


@settings(max_examples=60, deadline=None)
@given(st.floats(0, 80), st.floats(-10, 5), st.floats(-1, 1), st.floats(0, 1), st.floats(-40, 60))
def test_what_is_encoded_is_read_back(
    speed: float, acceleration: float, yaw_rate: float, brake: float, outside: float
) -> None:
    state = CarModel().step(
        0.05,
        Controls(
            speed_mps=speed,
            acceleration_mps2=acceleration,
            yaw_rate_radps=yaw_rate,
            brake=brake,
            outside_temperature_c=outside,
        ),
    )
    motion = read(state, "Motion")
    assert motion["VehicleSpeed"] / 3.6 == pytest.approx(speed, abs=0.01)
    assert motion["LongitudinalAcceleration"] == pytest.approx(acceleration, abs=0.001)
    assert read(state, "Body")["OutsideTemperature"] == pytest.approx(outside, abs=0.26)
    assert read(state, "Brakes")["BrakePedalPosition"] == pytest.approx(brake * 100, abs=0.26)


def test_the_fast_messages_carry_their_checksum() -> None:
    assert crc8(b"123456789") == 0x4B  # the check value that SAE J1850's CRC is known by
    for message in DATABASE.messages:
        if any(signal.name.endswith("Checksum") for signal in message.signals):
            frame = ENCODER.encode(message.name, CarState(speed_mps=12.3))
            assert frame.data[-1] == crc8(frame.data[:-1])


def test_a_value_that_is_missing_is_told_as_not_available() -> None:
    gaps = replace(CarState(), speed_mps=math.nan, brake_pressure_bar=math.nan, yaw_rate_radps=math.nan)
    motion = read(gaps, "Motion")
    assert motion["VehicleSpeed"] > 320
    assert motion["YawRate"] > 180
    assert not motion["VehicleSpeedValid"]
    assert read(gaps, "Brakes")["BrakePressure"] > 250


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(sorted(FAULTS)), st.floats(0.05, 1.0), st.floats(0.0, 45.0), st.integers(0, 1000))
def test_the_bus_carries_every_value_that_a_fault_can_reach(
    preset: str, severity: float, speed: float, seed: int
) -> None:
    faults = Faults()
    faults.activate(preset, severity)
    whole = Car(seed, faults, 30.0)
    for step in range(60):  # from that speed to standstill again and again, for two minutes
        now_mps = max(0.0, speed - 8.0 * 2.0 * (step % 6))
        braking = -8.0 if now_mps > 0.0 else 0.0
        controls = Controls(speed_mps=now_mps, acceleration_mps2=braking, brake=1.0, outside_temperature_c=30.0)
        told = whole.step(2.0, controls, step * 2000 * MS).frames
    for name, signals in MESSAGES.items():
        read_back = read(told, name)
        for signal, value in signals(told).items():
            scale = next(each.scale for each in DATABASE.get_message_by_name(name).signals if each.name == signal)
            assert math.isnan(value) or read_back[signal] == pytest.approx(float(value), abs=0.51 * scale)


def test_values_beyond_a_signal_s_range_are_held_at_its_edge() -> None:
    assert read(CarState(speed_mps=500.0), "Motion")["VehicleSpeed"] == 320


def test_hard_braking_heats_the_front_discs_most_and_air_cools_them() -> None:
    model = CarModel()
    for step in range(50):
        hot = model.step(0.1, Controls(speed_mps=30.0 - step * 0.5, acceleration_mps2=-5.0, brake=0.6))
    assert hot.brake_temperature_c[0] > hot.brake_temperature_c[2] > 30.0
    cool = model.step(600.0, Controls(speed_mps=20.0))
    assert cool.brake_temperature_c[0] < 0.5 * hot.brake_temperature_c[0]


def test_outer_wheels_run_faster_in_a_bend() -> None:
    state = CarModel().step(0.05, Controls(speed_mps=10.0, yaw_rate_radps=0.3))
    left, right, _, _ = state.wheel_speeds_mps
    assert right - left == pytest.approx(0.3 * 1.56)

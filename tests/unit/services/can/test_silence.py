"""What falls silent on the bus of the simulated car heals nothing of it, and who is stamped ahead silences nobody else."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from services.can.diagnostics.trouble_codes import DtcBook
from services.can.profiles.dbc import Dbc
from services.can.profiles.profile import Profile
from services.simulator.car.state import CarState, Controls
from tests.unit.services.can.silent_car import SilentCar

CRUISE = Controls(speed_mps=15.0)
LONG_S = 12.0
"""Longer than any field of the car may be old, and than the evidence for a missing sensor takes."""
Make = Callable[[], SilentCar]


@pytest.fixture
def car(dbc: Dbc, dbc_path: Path, profile: Profile, book: DtcBook) -> Make:
    return lambda: SilentCar(dbc, dbc_path, profile, book)


def broken(state: CarState) -> CarState:
    """A soft tyre, a hot disc and too little brake fluid."""
    return replace(
        state,
        tyre_pressure_bar=(1.5, *state.tyre_pressure_bar[1:]),
        brake_temperature_c=(80.0, 80.0, 80.0, 560.0),
        brake_fluid_low=True,
    )


def test_a_soft_tyre_stays_soft_when_its_sensor_falls_silent(car: Make) -> None:
    one = car()
    before = one.drive(3.0, CRUISE, shown=broken)
    after = one.drive(LONG_S, CRUISE, shown=broken, silent=("TyrePressures",))
    assert {fault.kind for fault in after.sensor_faults} == {"missing"}
    assert {"tyre_pressure_low_fl"} <= {each.name for each in after.indicators}
    assert (after.h or 0.0) > (before.h or 0.0)


def test_a_bus_that_dies_is_told_though_the_brakes_were_measured_before(car: Make) -> None:
    one = car()
    one.drive(2.0, Controls(speed_mps=25.0))
    for tenth in range(40):
        braking = Controls(speed_mps=25.0 - 0.4 * (tenth + 1), acceleration_mps2=-4.0, brake=0.45)
        before = one.drive(0.1, braking)
    assert one.vehicle.checks.measured()
    after = one.drive(LONG_S, CRUISE, silent=one.messages)
    assert "bus_silent" in {each.name for each in after.indicators}
    assert (after.h or 0.0) > (before.h or 0.0)


@settings(max_examples=8, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_messages_that_fall_silent_heal_nothing(car: Make, data: st.DataObject) -> None:
    one = car()
    lost = data.draw(st.sets(st.sampled_from(one.messages)))
    before = one.drive(3.0, CRUISE, shown=broken)
    after = one.drive(LONG_S, CRUISE, shown=broken, silent=lost)
    assert before.h is not None
    assert before.brake_envelope is not None
    assert (after.h or 0.0) >= before.h - 1e-12
    assert (after.brake_envelope or 1.0) <= before.brake_envelope + 1e-12


@pytest.mark.parametrize("ahead_s", [0.1, 0.3, 0.9])
@pytest.mark.parametrize("message", ["Body", "TyrePressures"])
def test_a_message_stamped_ahead_of_the_clock_convicts_no_sensor(car: Make, message: str, ahead_s: float) -> None:
    one = car()
    told = one.drive(6.0, CRUISE, ahead={message: ahead_s})
    assert told.sensor_faults == ()
    assert one.vehicle.ego(one.now_ns).speed_mps is not None

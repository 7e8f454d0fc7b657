"""The receiver of braking commands bounds them again, and lets go."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proto.decision import BrakeCommand
from services.simulator.car.brake_receiver import (
    MAX_DECELERATION_MPS2,
    MAX_DURATION_S,
    MAX_JERK_MPS3,
    Brake,
    Controls,
)

DT = 0.05
STEP_NS = 50_000_000
FREE = Controls(accelerator=0.12)


def command(deceleration: float = 3.0, jerk: float = 8.0, valid_ns: int = 200_000_000) -> BrakeCommand:
    return BrakeCommand(deceleration_mps2=deceleration, jerk_mps3=jerk, grant_id="g", valid_for_ns=valid_ns)


def test_a_command_builds_up_by_its_jerk_and_ends_on_expiry() -> None:
    brake, applied = Brake().receive(command(), 0), []
    for step in range(8):
        brake = brake.step(step * STEP_NS, DT, FREE)
        applied.append(brake.applied_mps2)
    assert applied[:4] == pytest.approx([0.4, 0.8, 1.2, 1.6])
    assert applied[4:] == [0.0] * 4


def test_a_long_validity_is_cut_to_two_hundred_milliseconds() -> None:
    brake = Brake().receive(command(valid_ns=10**12), 0)
    assert brake.step(150_000_000, DT, FREE).applied_mps2 > 0
    assert brake.step(200_000_000, DT, FREE).applied_mps2 == 0


@pytest.mark.parametrize(
    "controls",
    [
        Controls(brake=0.2),
        Controls(accelerator=0.8),
        Controls(accelerator=0.3, accelerator_rate_per_s=1.0),
        Controls(steering_rate_radps=0.6),
    ],
)
def test_the_driver_wins_at_once_and_the_command_is_gone(controls: Controls) -> None:
    brake = Brake().receive(command(), 0).step(0, DT, FREE)
    released = brake.step(STEP_NS, DT, controls)
    assert released.applied_mps2 == 0
    assert released.overridden
    assert released.step(2 * STEP_NS, DT, FREE).applied_mps2 == 0


def test_a_command_without_a_grant_or_without_sense_is_dropped() -> None:
    nameless = BrakeCommand(deceleration_mps2=3.0, jerk_mps3=8.0, grant_id="")
    for bad in (nameless, command(-1.0), command(float("nan")), command(float("inf")), command(3.0, 8.0, 0)):
        assert Brake().receive(bad, 0).command is None


@given(
    commands=st.lists(
        st.tuples(st.floats(allow_nan=True), st.floats(allow_nan=True), st.integers(-(10**9), 10**12)), max_size=60
    )
)
@settings(max_examples=60, deadline=None)
def test_no_stream_of_commands_exceeds_the_bounds(commands: list[tuple[float, float, int]]) -> None:
    brake, before, held_s = Brake(), 0.0, 0.0
    for step, each in enumerate(commands * 3):
        brake = brake.receive(command(*each), step * STEP_NS).step(step * STEP_NS, DT, FREE)
        assert 0.0 <= brake.applied_mps2 <= MAX_DECELERATION_MPS2
        assert brake.applied_mps2 - before <= MAX_JERK_MPS3 * DT + 1e-9
        held_s = held_s + DT if brake.applied_mps2 > 0 else 0.0
        assert held_s <= MAX_DURATION_S + DT
        before = brake.applied_mps2

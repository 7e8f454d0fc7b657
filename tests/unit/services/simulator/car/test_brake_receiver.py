"""The receiver of braking commands bounds them again, and lets go."""

from typing import get_args

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proto.decision import BrakeCommand, Envelope
from services.simulator.car.brake_receiver import (
    MAX_DECELERATION_MPS2,
    MAX_DURATION_S,
    MAX_JERK_MPS3,
    REST_S,
    Brake,
    Controls,
)

DT = 0.05
STEP_NS = 50_000_000
FREE = Controls(accelerator=0.12)
FAST = 20.0
ENVELOPES: tuple[Envelope, ...] = get_args(Envelope)


def command(
    deceleration: float = 3.0, jerk: float = 8.0, valid_ns: int = 200_000_000, envelope: Envelope = "soft"
) -> BrakeCommand:
    return BrakeCommand(
        deceleration_mps2=deceleration, jerk_mps3=jerk, grant_id="g", valid_for_ns=valid_ns, envelope=envelope
    )


def test_a_command_builds_up_by_its_jerk_and_ends_on_expiry() -> None:
    brake, applied = Brake().receive(command(), 0), []
    for step in range(8):
        brake = brake.step(step * STEP_NS, DT, FREE, FAST)
        applied.append(brake.applied_mps2)
    assert applied[:4] == pytest.approx([0.4, 0.8, 1.2, 1.6])
    assert applied[4:] == [0.0] * 4


def test_a_long_validity_is_cut_to_two_hundred_milliseconds() -> None:
    brake = Brake().receive(command(valid_ns=10**12), 0)
    assert brake.step(150_000_000, DT, FREE, FAST).applied_mps2 > 0
    assert brake.step(200_000_000, DT, FREE, FAST).applied_mps2 == 0


@pytest.mark.parametrize(
    "controls",
    [
        Controls(accelerator=0.8),
        Controls(accelerator=0.3, accelerator_rate_per_s=1.0),
        Controls(steering_rate_radps=0.6),
    ],
)
def test_the_driver_wins_at_once_and_stays_left_alone_for_a_rest(controls: Controls) -> None:
    brake = Brake().receive(command(), 0).step(0, DT, FREE, FAST)
    released = brake.step(STEP_NS, DT, controls, FAST)
    assert released.applied_mps2 == 0
    assert released.overridden
    for step in range(2, round(REST_S / DT)):
        released = released.receive(command(), step * STEP_NS).step(step * STEP_NS, DT, FREE, FAST)
        assert released.applied_mps2 == 0


def test_a_foot_on_the_brake_takes_nothing_away() -> None:
    brake = Brake().receive(command(), 0).step(0, DT, FREE, FAST)
    assert brake.step(STEP_NS, DT, Controls(brake=0.2), FAST).applied_mps2 > brake.applied_mps2


def test_a_command_without_a_grant_or_without_sense_is_dropped() -> None:
    nameless = BrakeCommand(deceleration_mps2=3.0, jerk_mps3=8.0, grant_id="")
    for bad in (nameless, command(-1.0), command(float("nan")), command(float("inf")), command(3.0, 8.0, 0)):
        assert Brake().receive(bad, 0).command is None


def test_a_car_at_standstill_is_held_for_as_long_as_it_is_asked_for() -> None:
    brake = Brake()
    for step in range(round(2 * MAX_DURATION_S["emergency"] / DT)):
        brake = brake.receive(command(envelope="emergency"), step * STEP_NS).step(step * STEP_NS, DT, FREE, 0.0)
        assert brake.applied_mps2 > 0.0


@given(
    commands=st.lists(
        st.tuples(
            st.floats(allow_nan=True),
            st.floats(allow_nan=True),
            st.integers(-(10**9), 10**12),
            st.sampled_from(ENVELOPES),
        )
        | st.none(),
        min_size=1,
        max_size=60,
    ),
    clock=st.lists(st.integers(-(10**13), 10**13), min_size=1, max_size=5),
)
@settings(max_examples=60, deadline=None)
def test_no_stream_of_commands_and_no_clock_exceeds_the_bounds(
    commands: list[tuple[float, float, int, Envelope] | None], clock: list[int]
) -> None:
    """The budget holds in any window, with pauses and with a clock that is set either way."""
    brake, before, held = Brake(), 0.0, []
    for step, each in enumerate(commands * 12):
        now_ns = step * STEP_NS + clock[step // 50 % len(clock)]
        brake = brake.receive(command(*each), now_ns) if each is not None else brake
        brake = brake.step(now_ns, DT, FREE, FAST)
        assert 0.0 <= brake.applied_mps2 <= max(MAX_DECELERATION_MPS2.values())
        assert brake.applied_mps2 - before <= MAX_JERK_MPS3 * DT + 1e-9
        before = brake.applied_mps2
        held.append(before > 0.0)
    window = round((MAX_DURATION_S["emergency"] + REST_S) / DT)
    for start in range(max(1, len(held) - window)):
        assert sum(held[start : start + window]) * DT <= MAX_DURATION_S["emergency"] + DT


@given(pauses=st.lists(st.integers(0, 12), min_size=1, max_size=12))
@settings(max_examples=60, deadline=None)
def test_pauses_renew_no_soft_budget(pauses: list[int]) -> None:
    brake, held, step = Brake(), [], 0
    for pause in pauses * 8:
        for asked in [True] * 10 + [False] * pause:
            now_ns = step * STEP_NS
            brake = (brake.receive(command(valid_ns=1), now_ns) if asked else brake).step(now_ns, DT, FREE, FAST)
            held.append(brake.applied_mps2 > 0.0)
            step += 1
    window = round((MAX_DURATION_S["soft"] + REST_S) / DT)
    for start in range(max(1, len(held) - window)):
        assert sum(held[start : start + window]) * DT <= MAX_DURATION_S["soft"] + DT

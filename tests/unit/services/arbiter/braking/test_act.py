"""Bounded braking."""

from hypothesis import given
from hypothesis import strategies as st

from services.arbiter.assessment.reading import Pedals
from services.arbiter.braking.act import Permission, brake, overridden, set_back
from services.arbiter.state import Intervention
from tests.unit.services.arbiter.support import CALIBRATED, GRANTED, HANDS_OFF, SECOND

TICK = SECOND // 10


def drive(
    needed: list[float], permission: Permission = GRANTED, pedals: list[Pedals] | None = None
) -> tuple[list[float], list[str]]:
    """Deceleration commanded tick by tick, and why it ended."""
    running, values, ends = Intervention(), [], []
    for tick, value in enumerate(needed):
        feet = pedals[tick] if pedals else HANDS_OFF
        running, command, why = brake(running, value, permission, feet, 100 * SECOND + tick * TICK, CALIBRATED)
        values.append(command.deceleration_mps2 if command else 0.0)
        ends.append(why)
    return values, ends


def test_braking_builds_up_with_bounded_jerk_to_the_grants_bound() -> None:
    values, _ = drive([9.0] * 8)
    assert values[:5] == [1.0, 2.0, 3.0, 4.0, 4.0]


def test_it_ends_after_the_shorter_of_the_grants_and_the_profiles_duration_and_rests() -> None:
    values, ends = drive([9.0] * 60)
    assert values[19] > 0.0
    assert set(values[20:]) == {0.0}
    assert "longest" in ends[20]
    assert "resting" in ends[40]


def test_the_drivers_foot_ends_it_at_once() -> None:
    foot = Pedals(brake=0.5, accelerator=0.0, steering_rad=0.0)
    values, ends = drive([9.0] * 6, pedals=[HANDS_OFF] * 3 + [foot] + [HANDS_OFF] * 2)
    assert values[3:] == [0.0, 0.0, 0.0]
    assert ends[3] == "the driver brakes"


def test_pressing_on_or_steering_away_since_it_began_is_an_override() -> None:
    assert overridden(Pedals(brake=0.0, accelerator=0.4, steering_rad=0.0), HANDS_OFF, CALIBRATED)
    assert overridden(Pedals(brake=0.0, accelerator=0.2, steering_rad=1.0), HANDS_OFF, CALIBRATED)
    assert not overridden(Pedals(brake=0.0, accelerator=0.2, steering_rad=0.1), HANDS_OFF, CALIBRATED)


@given(st.lists(st.floats(0.0, 30.0), min_size=1, max_size=40), st.floats(0.5, 10.0), st.floats(0.2, 5.0))
def test_no_need_and_no_grant_gets_past_the_bounds(needed: list[float], most: float, duration: float) -> None:
    values, _ = drive(needed, Permission(grant_id="g", max_deceleration_mps2=most, max_duration_s=duration, refused=""))
    assert max(values) <= min(most, CALIBRATED.act_brake_max_mps2) + 1e-9
    rises = [b - a for a, b in zip([0.0, *values], values, strict=False)]
    assert max(rises) <= CALIBRATED.act_jerk_mps3 * 0.1 + 1e-9
    assert sum(value > 0.0 for value in values) <= min(duration, CALIBRATED.act_duration_s) / 0.1 + 2


@given(since_s=st.floats(0.0, 3.0), back_s=st.floats(0.2, 1e6))
def test_a_clock_that_was_set_back_ends_an_intervention_with_its_rest_and_lengthens_no_rest(
    since_s: float, back_s: float
) -> None:
    then, now = 10**16, 10**16 - round(back_s * SECOND)
    whole = round(CALIBRATED.act_rest_s * SECOND)
    braking = Intervention(since_ns=then - round(since_s * SECOND), last_ns=then, brake_mps2=3.0, pedals=HANDS_OFF)
    assert set_back(braking, now, CALIBRATED) == Intervention(rest_until_ns=now + whole)
    left = set_back(Intervention(rest_until_ns=then + whole), now, CALIBRATED).rest_until_ns
    assert left is not None
    assert left <= now + whole
    assert set_back(Intervention(), now, CALIBRATED) == Intervention()

"""The speed bears out an acceleration, or the acceleration is not believed."""

import math

from hypothesis import given
from hypothesis import strategies as st

from domain.ego_speed import MOST_OWED_MPS, Believed, acceleration_mps2, believed
from tests.safety import safety

TICK_NS = 100_000_000
FROM_MPS = 60.0


def driven(told_mps2: list[float], slows_mps2: list[float], lag_s: float = 0.0) -> list[float | None]:
    """What is believed of accelerations told at 10 Hz, while the speed, told late by so much, falls as it does."""
    speed, shown, before, found = FROM_MPS, FROM_MPS, Believed(FROM_MPS, 0), []
    for tick, (told, slows) in enumerate(zip(told_mps2, slows_mps2, strict=True), 1):
        speed = max(0.0, speed - 0.1 * slows)
        shown += (speed - shown) * (1.0 if lag_s == 0.0 else 1.0 - math.exp(-0.1 / lag_s))
        after = believed(Believed(shown, tick * TICK_NS), before, told)
        assert after is not None
        before = after
        found.append(acceleration_mps2(told, after))
    return found


@safety(few=200)
@given(slows=st.lists(st.floats(0.0, 9.0), min_size=1, max_size=5), off=st.floats(-0.4, 0.4), lag_s=st.floats(0.0, 0.1))
def test_what_a_sound_accelerometer_tells_is_believed_also_on_a_slope(
    slows: list[float], off: float, lag_s: float
) -> None:
    slowing = [each for each in slows for _ in range(4)]
    told = [off - each for each in slowing]
    assert driven(told, slowing, lag_s) == told


@safety(few=200)
@given(slows=st.floats(0.0, 9.0), lie=st.floats(1.0, 15.0), lag_s=st.floats(0.0, 0.1))
def test_a_deceleration_that_the_speed_does_not_bear_out_is_soon_not_believed(
    slows: float, lie: float, lag_s: float
) -> None:
    count = 60
    found = driven([max(-15.0, -slows - lie)] * count, [min(slows, 14.0)] * count, lag_s)
    soon = math.ceil(10.0 * 3.0 * MOST_OWED_MPS / min(lie, 15.0 - slows))
    assert found[soon:] == [None] * (count - soon)


@given(st.floats(allow_nan=True, allow_infinity=True), st.floats(-15.0, 15.0))
def test_an_absurd_acceleration_is_none_and_owes_no_more_than_the_hardest(absurd_mps2: float, told: float) -> None:
    first = Believed(20.0, 0)
    after = believed(Believed(20.0, TICK_NS), first, absurd_mps2)
    assert after is not None
    assert 0.0 <= after.owed_mps <= 1.5
    if not abs(absurd_mps2) <= 15.0:
        assert acceleration_mps2(absurd_mps2, first) is None
    assert acceleration_mps2(told, first) == told
    assert acceleration_mps2(told, None) == (told if told >= 0.0 else None)


@safety(few=100)
@given(lie=st.floats(1.0, 15.0), slows=st.floats(0.0, 3.0))
def test_a_rise_that_the_speed_does_not_bear_out_is_soon_not_believed(lie: float, slows: float) -> None:
    found = driven([lie] * 60, [slows] * 60)
    assert found[math.ceil(30.0 / lie) :] == [None] * (60 - math.ceil(30.0 / lie))


@given(change=st.floats(-5.0, 5.0), pause_s=st.floats(0.2, 3.0))
def test_a_pause_of_the_messages_casts_no_doubt_on_what_was_steady(change: float, pause_s: float) -> None:
    after = believed(Believed(30.0 + change * pause_s, round(pause_s * 1e9)), Believed(30.0, 0), change)
    assert after is not None
    assert acceleration_mps2(change, after) == change


def test_a_sensor_that_is_sound_again_is_believed_again() -> None:
    found = driven([-5.0] * 20 + [-2.0] * 60, [0.0] * 20 + [2.0] * 60)
    assert found[19] is None
    assert found[-1] == -2.0

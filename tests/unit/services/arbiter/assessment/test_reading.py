"""The arbiter's own reading of the ego's speed: a leap is no speed."""

from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from domain.ego_speed import CHANGE_MPS2, JITTER_MPS, MOST_MPS
from proto.vehicle import Ego
from services.arbiter.assessment.reading import Latest, believed, read
from tests.safety import safety

SECOND = 1_000_000_000
AGE_S = 0.25


def told(speed_mps: float | None, at_ns: int, before: Latest | None = None) -> Latest:
    """The next reading of the car's speed, after what was believed of the one before."""
    speed = believed(before, before.ego[1]) if before is not None and before.ego is not None else None
    return Latest(ego=(Ego(speed_mps=speed_mps, acceleration_mps2=0.0, brake_pedal=0.3), at_ns), speed=speed)


def speed_mps(latest: Latest, now_ns: int) -> float | None:
    return read(latest, now_ns, AGE_S).view.ego_speed_mps


@safety(few=200)
@given(st.floats(0.0, 60.0), st.floats(allow_nan=True, allow_infinity=True) | st.floats(-200.0, 200.0))
def test_a_speed_that_leaps_is_not_believed_and_hides_no_pedal(ego_mps: float, leap_mps: float) -> None:
    first = told(ego_mps, SECOND)
    now_ns = SECOND + SECOND // 10
    second = told(leap_mps, now_ns, first)
    possible = abs(leap_mps - ego_mps) <= JITTER_MPS + CHANGE_MPS2 * 0.1 and abs(leap_mps) <= MOST_MPS
    assert speed_mps(second, now_ns) == (leap_mps if possible else ego_mps)
    assert read(second, now_ns, AGE_S).pedals.brake == 0.3


def test_the_believed_speed_ages_and_one_that_stands_is_believed_in_the_end() -> None:
    latest, found = told(10.0, SECOND), []
    for tick in range(1, 20):
        now_ns = SECOND + tick * SECOND // 10
        latest = told(30.0, now_ns, latest)
        found.append(speed_mps(latest, now_ns))
    assert found[:2] == [10.0, 10.0]
    assert found[2:12] == [None] * 10
    assert found[12:] == [30.0] * 7


def test_without_a_speed_none_is_read_and_a_clock_set_back_forgets() -> None:
    first = told(10.0, 3600 * SECOND)
    assert speed_mps(told(None, 3600 * SECOND + 1, first), 3600 * SECOND + 1) is None
    back = replace(first, ego=(Ego(speed_mps=30.0), SECOND), speed=believed(first, 3600 * SECOND))
    assert speed_mps(back, SECOND) == 30.0

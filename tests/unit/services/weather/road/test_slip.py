"""Friction from the slip of braked wheels."""

from hypothesis import assume, given
from hypothesis import strategies as st

from proto.vehicle import Ego
from services.weather.road.slip import MOST_MU, NS, SLIP_ERROR, SOFT, STIFF, Braking, friction, mu_of, slip_error

STEP_NS = NS // 20


def _ego(braking: float, slip: float, **fields: object) -> Ego:
    known = {"speed_mps": 15.0, "yaw_rate_radps": 0.0, "brake_pedal": 0.3, "abs_active": False, **fields}
    return Ego(acceleration_mps2=-9.81 * braking, wheel_slip=slip, **known)  # type: ignore[arg-type]


def _brake(braking: float, slip: float, count: int = 10, **fields: object) -> Braking:
    seen = Braking()
    for step in range(count):
        seen.add(_ego(braking, slip, **fields), (step + 1) * STEP_NS)
    return seen


def _used_share(stiffness: float, slip: float, mu: float) -> float:
    """Share of mu that braking at this slip uses, in [0, 1]."""
    x = min(3.0, stiffness * max(0.0, slip) / mu)
    return 1.0 - (1.0 - x / 3.0) ** 3


mus = st.floats(0.1, 1.0)
stiffnesses = st.floats(SOFT, STIFF)


@given(mus, stiffnesses, st.floats(0.1, 0.98))
def test_the_true_friction_lies_within_whatever_the_tyre(mu: float, stiffness: float, wanted: float) -> None:
    slip = 3.0 * mu / stiffness * (1.0 - (1.0 - wanted) ** (1.0 / 3.0))
    braking = mu * _used_share(stiffness, slip, mu)
    found = friction(braking, slip)
    assert found.low - 1e-9 <= mu <= found.high + 1e-9


@given(mus, stiffnesses, st.floats(0.35, 0.98))
def test_a_known_tyre_tells_it_exactly(mu: float, stiffness: float, wanted: float) -> None:
    slip = 3.0 * mu / stiffness * (1.0 - (1.0 - wanted) ** (1.0 / 3.0))
    assert abs(mu_of(mu * wanted, slip, stiffness) - mu) < 1e-6 * mu + 1e-9


@given(st.floats(0.05, 0.9), st.floats(0.0, 0.2), st.floats(0.0, 0.05))
def test_more_slip_under_the_same_braking_never_tells_more_grip(braking: float, slip: float, more: float) -> None:
    less_slip, more_slip = friction(braking, slip), friction(braking, slip + more)
    assert more_slip.low <= less_slip.low + 1e-9
    assert more_slip.high <= less_slip.high + 1e-9
    assert braking <= more_slip.low, "what was braked with was there"


def test_little_braking_tells_nothing_and_strained_tyres_tell_of_ice() -> None:
    assert _brake(0.2, 0.007).friction(10 * STEP_NS) is None, "stiff as on any road"
    assert friction(0.2, SLIP_ERROR).high == MOST_MU
    told = _brake(0.12, 0.05).friction(10 * STEP_NS)
    assert told is not None
    assert told.high < 0.2


def test_bends_anti_lock_standing_and_doubt_tell_nothing() -> None:
    for fields in (
        {"speed_mps": 8.0},
        {"yaw_rate_radps": 0.4},
        {"yaw_rate_radps": None},
        {"abs_active": True},
        {"speed_mps": 2.0},
    ):
        assert _brake(0.12, 0.05, **fields).friction(10 * STEP_NS) is None
    assert _brake(0.12, 0.05, count=4).friction(4 * STEP_NS) is None, "too short"


@given(st.floats(0.1, 0.9), st.floats(0.0, 0.12))
def test_what_was_told_is_forgotten_in_two_seconds(braking: float, slip: float) -> None:
    seen = _brake(braking, slip)
    assume(seen.friction(10 * STEP_NS) is not None)
    assert seen.friction(10 * STEP_NS + 3 * NS) is None


@given(st.floats(0.15, 0.6), st.floats(0.3, 0.9), st.floats(10.0, 40.0), st.floats(0.0, 0.05))
def test_speeds_of_different_moments_never_make_a_road_slippery(
    braking: float, mu: float, speed_mps: float, skew_s: float
) -> None:
    assume(braking < 0.9 * mu)
    true = 3.0 * mu / 30.0 * (1.0 - (1.0 - braking / mu) ** (1.0 / 3.0))
    measured = true + skew_s * 9.81 * braking / speed_mps
    assert friction(braking, measured, slip_error(braking, speed_mps)).high >= mu - 1e-9


def test_letting_go_of_the_brake_tells_nothing() -> None:
    seen = Braking()
    for step in range(10):
        seen.add(_ego(0.5 - 0.045 * step, 0.06), (step + 1) * STEP_NS)
    assert seen.friction(10 * STEP_NS) is None

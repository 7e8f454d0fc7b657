"""The first measured range of a vehicle, with the sweep before it, tells how fast it closes in."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from proto.perception import Track
from services.perception.range.sizes import CAR
from services.perception.track.kalman import Fix
from services.perception.track.road_user import EgoState, Sighting
from services.perception.track.sweep_speed import Sweeps
from services.perception.track.tracker import Tracker

STEP_NS, EGO = 100_000_000, EgoState(25.0, 0.0)
FIRST_M, ASIDE_M = 40.0, 11.0
"""Where its range is first measured."""


def guessed(closing_mps: float, factor: float = 0.95) -> Tracker:
    """Has followed an oncoming vehicle in eight pictures, until 0.3 s ago, by ranges that are all wrong by a factor."""
    tracker = Tracker()
    for k in range(4, 20, 2):
        far = FIRST_M + closing_mps * 0.1 * (21 - k)
        fix = Fix(np.array([factor * far, ASIDE_M]), np.diag([(0.2 * factor * far) ** 2, 0.3**2]))
        tracker.step(k * STEP_NS, [Sighting("vehicle", fix, 0.9, CAR)], EGO)
    return tracker


def rear(near_m: float, aside_m: float = ASIDE_M) -> NDArray[np.float64]:
    """Returns of a vehicle's end that is turned to us, and of its flank."""
    end = [(near_m, aside_m + y, z) for y in (-0.7, 0.0, 0.7) for z in (0.6, 1.1)]
    return np.array([*end, (near_m + 2.0, aside_m - 0.9, 0.8)])


def measured(tracker: Tracker, sweeps: Sweeps | None) -> Track:
    fix = Fix(np.array([FIRST_M, ASIDE_M]), np.diag([0.15**2, 0.3**2]), sweeps.age_s if sweeps is not None else 0.0)
    tracker.step(21 * STEP_NS, [Sighting("vehicle", fix, 0.9, CAR)], EGO, sweeps=sweeps)
    (track,) = tracker.published()
    return track


@settings(max_examples=15, deadline=None)
@given(closing=st.floats(30.0, 65.0), factor=st.floats(0.85, 0.95))
def test_two_sweeps_tell_the_speed_that_guessed_ranges_could_not(closing: float, factor: float) -> None:
    alone = measured(guessed(closing, factor), None)
    told = measured(guessed(closing, factor), Sweeps(rear(FIRST_M), rear(FIRST_M + 0.1 * closing), 0.0, 0.1))
    assert told.track_id == alone.track_id == 1
    assert abs(told.vx_mps + closing) < max(0.5, 0.4 * abs(alone.vx_mps + closing))
    assert told.sigma_vx_mps < 0.6 * alone.sigma_vx_mps


def test_the_egos_turn_between_the_sweeps_is_allowed_for() -> None:
    """Turned by 2 degrees to the left, what lies 46 m ahead lies 1.6 m further to the right than before."""
    turned = math.radians(2.0)
    c, s = math.cos(turned), math.sin(turned)
    before = rear(FIRST_M + 6.0) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    track = measured(guessed(60.0), Sweeps(rear(FIRST_M), before, 0.0, 0.1, turned))
    assert track.vx_mps == pytest.approx(-60.0, abs=2.0)


@pytest.mark.parametrize(
    "sweeps",
    [
        Sweeps(rear(FIRST_M), np.zeros((0, 3)), 0.0, 0.1),
        Sweeps(np.zeros((0, 3)), rear(FIRST_M + 6.0), 0.0, 0.1),
        Sweeps(rear(FIRST_M), np.array([(x, ASIDE_M, 0.7) for x in np.arange(20.0, 80.0, 0.5)]), 0.0, 0.1),
        Sweeps(rear(FIRST_M), rear(FIRST_M + 6.0, ASIDE_M - 3.5), 0.0, 0.1),
        Sweeps(rear(FIRST_M), rear(FIRST_M + 6.0), 0.0, 0.6),
        Sweeps(rear(FIRST_M), rear(FIRST_M + 6.0), 0.0, 0.001),
    ],
    ids=["nothing before", "nothing now", "a rail", "the next lane's", "too long between", "hardly any time between"],
)
def test_sweeps_that_do_not_show_it_tell_nothing(sweeps: Sweeps) -> None:
    assert measured(guessed(60.0), sweeps) == measured(guessed(60.0), None)


def test_a_track_that_was_measured_before_needs_no_second_sweep() -> None:
    """Its own ranges tell its speed better than what may be another's returns."""
    alone, beside = guessed(60.0), guessed(60.0)
    for tracker in (alone, beside):
        measured(tracker, None)
    near_m = FIRST_M - 6.0
    fix = Fix(np.array([near_m, ASIDE_M]), np.diag([0.15**2, 0.3**2]))
    alone.step(22 * STEP_NS, [Sighting("vehicle", fix, 0.9, CAR)], EGO)
    sweeps = Sweeps(rear(near_m), rear(near_m + 5.0), 0.0, 0.1)
    beside.step(22 * STEP_NS, [Sighting("vehicle", fix, 0.9, CAR)], EGO, sweeps=sweeps)
    assert alone.published() == beside.published()


Points = st.lists(st.tuples(st.floats(20.0, 80.0), st.floats(8.0, 14.0), st.floats(0.0, 3.0)), max_size=12)


@settings(max_examples=30, deadline=None)
@given(latest=Points, before=Points, closing=st.floats(0.0, 70.0))
def test_no_returns_move_a_speed_further_than_it_was_doubted(
    latest: list[tuple[float, float, float]], before: list[tuple[float, float, float]], closing: float
) -> None:
    sweeps = Sweeps(np.array(latest).reshape(-1, 3), np.array(before).reshape(-1, 3), 0.0, 0.1)
    alone, told = measured(guessed(closing), None), measured(guessed(closing), sweeps)
    assert abs(told.vx_mps - alone.vx_mps) <= min(30.0, 3.0 * alone.sigma_vx_mps + 3.0) + 2.0
    assert told.sigma_vx_mps <= alone.sigma_vx_mps + 1e-9
    assert told.x_m == pytest.approx(alone.x_m, abs=0.3)

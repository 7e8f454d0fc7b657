"""What speed a track is told to have, and from what."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.perception.range.sizes import CAR
from services.perception.track.kalman import Fix
from services.perception.track.road_user import EgoState, OverGround, Sighting
from services.perception.track.tracker import Tracker
from tests.unit.services.perception.support import STEP_NS, drive, sighting, steady


def test_velocity_converges_to_the_true_closing_speed() -> None:
    tracker = Tracker()
    drive(tracker, 25, 60.0, 8.0)
    (track,) = tracker.published()
    assert track.vx_mps == pytest.approx(-8.0, abs=1.0)
    assert track.sigma_vx_mps < 1.5
    assert track.x_m - track.length_m / 2 == pytest.approx(60.0 - 8.0 * 2.5, abs=0.5)


@given(ahead=st.floats(-20, 20), across=st.floats(-15, 15), speed=st.floats(0, 30))
def test_who_is_first_seen_with_a_velocity_has_it_at_once(ahead: float, across: float, speed: float) -> None:
    tracker, ego = Tracker(), EgoState(speed, 0.0)
    for k in (1, 2):
        place = sighting(50.0 + (ahead - speed) * 0.1 * k, 10.0 + across * 0.1 * k, score=0.9)
        told = replace(place, across_sigma_mps=8.0, over_ground=OverGround(ahead, across, 1.0))
        tracker.step(k * STEP_NS, [told], ego)
    (track,) = tracker.published()
    assert (track.vx_mps, track.vy_mps) == pytest.approx((ahead - speed, across), abs=1.0)
    assert track.sigma_vx_mps <= 1.1


def test_a_velocity_that_is_known_better_is_not_taken_from_two_sweeps_nor_one_without_the_egos_speed() -> None:
    tracker = Tracker()
    drive(tracker, 40, 80.0, 8.0)
    (before,) = tracker.published()
    vague = OverGround(0.0, 9.0, 6.0)
    tracker.step(41 * STEP_NS, [replace(sighting(80.0 - 8.0 * 4.1, 0.0), over_ground=vague)], EgoState(20.0, 0.0))
    (after,) = tracker.published()
    assert after.vy_mps == pytest.approx(before.vy_mps, abs=0.5)
    blind = Tracker()
    for k in (1, 2, 3):
        blind.step(k * STEP_NS, [replace(sighting(50.0, 0.0), over_ground=OverGround(9.0, 9.0, 0.5))], EgoState())
    assert abs(blind.published()[0].vy_mps) < 1.0


@given(x_m=st.floats(-15.0, 15.0), y_m=st.floats(-12.0, 12.0))
def test_whom_lidar_alone_sees_move_is_steady_however_his_speed_is_learnt(x_m: float, y_m: float) -> None:
    tracker = Tracker()
    for k in range(1, 6):
        fix = Fix(np.array([40.0 + 0.1 * x_m * k, 0.1 * y_m * k]), np.diag([0.09, 0.25]))
        alone = Sighting(kind="vehicle", fix=fix, score=0.9, body=CAR, across_sigma_mps=8.0, boxed=False)
        tracker.step(k * STEP_NS, [alone], EgoState(10.0, 0.0))
    (track,) = tracker.published()
    assert track.steady_s == pytest.approx(0.4)


def test_a_range_that_alone_tells_a_speed_makes_nobody_steady() -> None:
    tracker = Tracker()
    for k in range(1, 8):
        tracker.step(k * STEP_NS, [sighting(106.0 - 0.4 * k, 0.0, 15.0)], EgoState(16.0, 0.0))
    assert steady(tracker, 8, (103.0, 0.0)) is not None
    assert steady(tracker, 9) is not None
    assert steady(tracker, 11, (96.0, 0.0)) == 0.0, "7 m in 0.3 s"


def test_the_first_measured_range_corrects_the_speed_that_guessed_ranges_gave() -> None:
    """A small car seems a quarter further away than it is in every picture, and closes in as much faster."""
    tracker, closing = Tracker(), 40.0
    for k in range(1, 21):
        true = 160.0 - closing * 0.1 * k
        tracker.step(k * STEP_NS, [sighting(1.25 * true, 0.0, sigma_m=0.08 * true)], EgoState(20.0, 0.0))
    guessed_mps = tracker.published()[0].vx_mps
    tracker.step(21 * STEP_NS, [sighting(160.0 - closing * 2.1, 0.0, sigma_m=0.5)], EgoState(20.0, 0.0))
    (track,) = tracker.published()
    assert guessed_mps < -1.15 * closing
    assert abs(track.vx_mps + closing) < 0.4 * abs(guessed_mps + closing)


@pytest.mark.parametrize("left", [False, True])
def test_a_first_measured_range_that_the_second_contradicts_is_no_speed(left: bool) -> None:
    """Met in a rendered drive: a parked car ahead, hidden in part; the first range was of something 4 m before it."""
    tracker, ego = Tracker(), EgoState(9.2, 0.0)
    seen = [  # x, y, and one sigma along the line of sight and across it
        (60.2, 19.4, 14.5, 1.0), (59.5, 19.6, 14.2, 1.0), (56.9, 19.2, 13.3, 1.0), (55.3, 19.1, 12.7, 1.0), (43.05, 14.26, 0.43, 0.36),
        (46.91, 16.9, 1.17, 0.75), (47.5, 17.2, 9.9, 1.0), (48.4, 17.7, 10.3, 1.0), (44.2, 16.4, 1.17, 0.75), (43.4, 16.2, 0.4, 0.75),
    ]  # fmt: skip
    for k, (x_m, y_m, along_m, across_m) in enumerate(seen, 1):
        sight = np.array([x_m, y_m if left else -y_m])
        turn = np.array([sight, (-sight[1], sight[0])]).T / np.linalg.norm(sight)
        fix = Fix(sight, turn @ np.diag([along_m**2, across_m**2]) @ turn.T)
        tracker.step(k * STEP_NS, [Sighting(kind="vehicle", fix=fix, score=0.9, body=CAR)], ego)
    (track,) = tracker.published()
    assert abs(track.vx_mps + 9.2) < 5.0
    assert abs(track.vx_mps + 9.2) < 1.5 * track.sigma_vx_mps


@pytest.mark.parametrize("closing", [0.0, 28.0, 56.0])
def test_a_few_vague_ranges_tell_a_speed_whichever_way_it_goes(closing: float) -> None:
    """Followed, standing or oncoming, in eight pictures of the close camera."""
    tracker = Tracker()
    for k in range(1, 9):
        true = 80.0 + closing * (1.6 - 0.2 * k)
        tracker.step(2 * k * STEP_NS, [sighting(true, 0.0, sigma_m=0.2 * true)], EgoState(28.0, 0.0))
    (track,) = tracker.published()
    assert track.vx_mps == pytest.approx(-closing, abs=10.0)


def test_the_egos_braking_is_not_taken_for_the_others() -> None:
    """A vehicle at constant 20 m/s while the ego brakes from 20 to 10 m/s: unseen meanwhile, its track still fits."""
    tracker = Tracker()
    drive(tracker, 15, 40.0, 0.0)
    speed, gap = 20.0, 40.0
    for k in range(16, 22):
        speed -= 1.5
        gap += (20.0 - speed) * 0.1
        tracker.step(k * STEP_NS, [], EgoState(speed, 0.0))
    (track,) = tracker.published()
    assert track.vx_mps == pytest.approx(20.0 - speed, abs=0.8)
    assert track.x_m - track.length_m / 2 == pytest.approx(gap, abs=1.5)


def test_the_egos_turning_moves_tracks_to_the_other_side() -> None:
    tracker = Tracker()
    for k in range(1, 11):
        tracker.step(k * STEP_NS, [sighting(30.0, 0.0)], EgoState(0.0, 0.0))
    for k in range(11, 16):
        tracker.step(k * STEP_NS, [], EgoState(0.0, 0.2))
    (track,) = tracker.published()
    turned = 0.2 * 0.5
    assert track.y_m == pytest.approx(-30.0 * math.sin(turned), abs=0.4), (
        "turning left, what lay ahead lies to the right"
    )


def test_an_unknown_ego_speed_gives_relative_speeds_only_and_no_oncoming() -> None:
    tracker = Tracker()
    for k in range(1, 16):
        tracker.step(k * STEP_NS, [sighting(60.0 - 15.0 * k * 0.1, 3.5)], EgoState())
    (track,) = tracker.published()
    assert track.vx_mps == pytest.approx(-15.0, abs=2.0)
    assert not track.oncoming
    assert track.ax_mps2 == 0.0


def test_an_oncoming_vehicle_is_told_by_its_speed_over_ground() -> None:
    tracker = Tracker()
    for k in range(1, 16):
        tracker.step(k * STEP_NS, [sighting(80.0 - 25.0 * k * 0.1, 3.5)], EgoState(12.0, 0.0))
    (track,) = tracker.published()
    assert track.oncoming


def test_a_sweep_older_than_the_picture_is_allowed_for() -> None:
    """Ranges 0.1 s old of a vehicle closing at 10 m/s are 1 m too long; the track is not."""
    tracker = Tracker()
    for k in range(1, 26):
        true = 60.0 - 10.0 * k * 0.1
        tracker.step(k * STEP_NS, [sighting(true + 1.0, 0.0, age_s=0.1)], EgoState(20.0, 0.0))
    (track,) = tracker.published()
    assert track.x_m - track.length_m / 2 == pytest.approx(true, abs=0.4)


@pytest.mark.parametrize("closing", [-3.0, 8.0, 22.0, 45.0])
def test_a_fast_one_seen_by_old_sweeps_is_one_track(closing: float) -> None:
    """With sweeps as old as the time between pictures, a second fix lies where the first one was only if speed is forgotten."""
    tracker = Tracker()
    ids: set[int] = set()
    for k in range(1, 16):
        place = 100.0 - closing * k * 0.1 + closing * 0.1
        ids.update(tracker.step(k * STEP_NS, [sighting(place, 3.4, sigma_m=0.15, age_s=0.1)], EgoState(7.0, 0.0)))
    assert ids == {1}
    (track,) = tracker.published()
    assert track.vx_mps == pytest.approx(-closing, abs=1.0)

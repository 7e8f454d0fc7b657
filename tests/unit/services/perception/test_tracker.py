"""Tracks through noise, drop-outs, clutter and the ego's own motion."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from services.perception.kalman import Fix
from services.perception.sizes import CAR
from services.perception.tracked import EgoState, OverGround, Sighting
from services.perception.tracker import Tracker

STEP_NS = 100_000_000


def sighting(x_m: float, y_m: float, sigma_m: float = 0.3, score: float = 0.8, age_s: float = 0.0) -> Sighting:
    covariance = np.diag([sigma_m**2, 0.25**2])
    return Sighting(kind="vehicle", fix=Fix(np.array([x_m, y_m]), covariance, age_s), score=score, body=CAR)


def drive(
    tracker: Tracker, steps: int, gap_m: float, closing_mps: float, *, first: int = 1, speed: float = 20.0
) -> set[int]:
    """A vehicle straight ahead seen `steps` times with noise; the ids it had."""
    rng = np.random.default_rng(3)
    ids: set[int] = set()
    for k in range(first, first + steps):
        x = gap_m - closing_mps * k * 0.1 + rng.normal(0, 0.2)
        ids.update(tracker.step(k * STEP_NS, [sighting(x, rng.normal(0, 0.1))], EgoState(speed, 0.0)))
    return ids


def test_velocity_converges_to_the_true_closing_speed() -> None:
    tracker = Tracker()
    drive(tracker, 25, 60.0, 8.0)
    (track,) = tracker.published()
    assert track.vx_mps == pytest.approx(-8.0, abs=1.0)
    assert track.sigma_vx_mps < 1.5
    assert track.x_m - track.length_m / 2 == pytest.approx(60.0 - 8.0 * 2.5, abs=0.5)


@settings(max_examples=25, deadline=None)
@given(closing=st.floats(-5, 12), lateral=st.floats(-4, 4), missing=st.integers(1, 5))
def test_identity_survives_a_drop_out_of_half_a_second(closing: float, lateral: float, missing: int) -> None:
    tracker = Tracker()
    rng = np.random.default_rng(0)
    ids: set[int] = set()
    for k in range(1, 26):
        if 15 <= k < 15 + missing:
            tracker.step(k * STEP_NS, [], EgoState(15.0, 0.0))
            continue
        seen = sighting(45.0 - closing * k * 0.1 + rng.normal(0, 0.2), lateral + rng.normal(0, 0.1))
        ids.update(tracker.step(k * STEP_NS, [seen], EgoState(15.0, 0.0)))
    assert ids == {1}


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


def test_what_a_measured_track_explains_is_no_first_range_of_a_farther_one_that_was_only_guessed() -> None:
    tracker, ego = Tracker(), EgoState(15.0, 0.0)
    for k in range(1, 31):
        near = sighting(137.0 - 2.5 * k, 2.9)
        far = sighting(125.0 - 1.0 * k, 5.8, sigma_m=12.0)
        near_id, far_id = tracker.step(k * STEP_NS, [near, far], ego)
    assert near_id != far_id
    for k in range(31, 34):
        places = [sighting(137.0 - 2.5 * k, 2.9), sighting(137.0 - 2.5 * k, 3.6)]
        own, other = tracker.step(k * STEP_NS, places, ego)
        assert own == near_id
        assert other != far_id
    speeds = {track.track_id: track.vx_mps for track in tracker.published()}
    assert speeds[near_id] == pytest.approx(-25.0, abs=1.5)


def test_a_coasting_track_grows_unsure_and_then_ends() -> None:
    tracker = Tracker()
    drive(tracker, 12, 40.0, 2.0)
    before = tracker.published()[0]
    sigmas, confidences = [before.sigma_x_m], [before.confidence]
    for k in range(13, 22):
        tracker.step(k * STEP_NS, [], EgoState(20.0, 0.0))
        (track,) = tracker.published()
        sigmas.append(track.sigma_x_m)
        confidences.append(track.confidence)
    assert sigmas == sorted(sigmas)
    assert confidences == sorted(confidences, reverse=True)
    assert track.unseen_s == pytest.approx(0.9)
    for k in range(22, 25):
        tracker.step(k * STEP_NS, [], EgoState(20.0, 0.0))
    assert tracker.published() == []


def test_far_clutter_does_not_move_a_track() -> None:
    clean, dirty = Tracker(), Tracker()
    for k in range(1, 20):
        car = sighting(30.0, 0.0)
        clean.step(k * STEP_NS, [car], EgoState(20.0, 0.0))
        dirty.step(k * STEP_NS, [car, sighting(30.0 + 8 * (-1) ** k, 6.0)], EgoState(20.0, 0.0))
    ours, theirs = clean.published()[0], dirty.published()[0]
    assert ours.track_id == theirs.track_id == 1
    assert theirs.x_m == pytest.approx(ours.x_m, abs=1e-9)
    assert theirs.y_m == pytest.approx(ours.y_m, abs=1e-9)


def test_a_single_ghost_is_never_published() -> None:
    tracker = Tracker()
    tracker.step(STEP_NS, [sighting(20.0, 0.0, score=0.95)], EgoState(10.0, 0.0))
    published = [tracker.published()]
    for k in range(2, 12):
        tracker.step(k * STEP_NS, [], EgoState(10.0, 0.0))
        published.append(tracker.published())
    assert not any(published)
    assert tracker.tracks == ()


def test_two_vehicles_side_by_side_keep_their_ids() -> None:
    tracker = Tracker()
    rng = np.random.default_rng(5)
    owners = set()
    for k in range(1, 30):
        left = sighting(25.0 + 0.5 * k * 0.1 + rng.normal(0, 0.2), 3.5 + rng.normal(0, 0.1))
        right = sighting(25.0 - 0.5 * k * 0.1 + rng.normal(0, 0.2), rng.normal(0, 0.1))
        owners.add(tuple(tracker.step(k * STEP_NS, [left, right], EgoState(20.0, 0.0))))
    assert owners == {(1, 2)}


@pytest.mark.parametrize("swerve_mps2", [4.0, -4.0, 7.0])
def test_one_that_swerves_stays_itself(swerve_mps2: float) -> None:
    tracker, ids = Tracker(), set()
    for k in range(1, 21):
        aside = 0.5 * swerve_mps2 * max(0.0, 0.1 * (k - 12)) ** 2
        ids.update(tracker.step(k * STEP_NS, [sighting(14.0, aside, sigma_m=0.1)], EgoState(25.0, 0.0)))
    assert ids == {1}


def test_one_that_stands_suddenly_elsewhere_is_another() -> None:
    tracker = Tracker()
    drive(tracker, 12, 20.0, 0.0)
    assert tracker.step(13 * STEP_NS, [sighting(20.0, 3.5)], EgoState(20.0, 0.0)) == [2]


def test_after_a_drop_out_what_stands_beside_is_not_taken_for_it() -> None:
    tracker = Tracker()
    drive(tracker, 12, 20.0, 0.0)
    for k in range(13, 16):
        tracker.step(k * STEP_NS, [], EgoState(20.0, 0.0))
    assert tracker.step(16 * STEP_NS, [sighting(20.0, 2.4, sigma_m=0.2)], EgoState(20.0, 0.0)) == [2]
    assert tracker.step(17 * STEP_NS, [sighting(20.0, 0.0, sigma_m=0.2)], EgoState(20.0, 0.0)) == [1]


@pytest.mark.parametrize(("off_m", "aside_m"), [(-1.9, 1.5), (-1.5, -1.8), (2.2, 1.0)])
def test_one_that_swerves_and_brakes_while_unseen_comes_back_as_itself(off_m: float, aside_m: float) -> None:
    """Two vehicles cannot stand in each other: what is seen there is the same one."""
    tracker = Tracker()
    for k in range(1, 21):
        tracker.step(k * STEP_NS, [sighting(20.0, 0.0, sigma_m=0.05)] if k < 17 else [], EgoState(20.0, 0.0))
    back = sighting(20.0 + off_m, aside_m, sigma_m=0.05)
    assert tracker.step(21 * STEP_NS, [back], EgoState(20.0, 0.0)) == [1]


def steady(tracker: Tracker, k: int, *places: tuple[float, float]) -> float | None:
    tracker.step(k * STEP_NS, [sighting(x_m, y_m, 0.1) for x_m, y_m in places], EgoState(20.0, 0.0))
    return tracker.published()[0].steady_s


@given(unseen=st.integers(1, 8))
def test_who_is_seen_again_after_a_break_is_steady_from_the_next_sighting_on(unseen: int) -> None:
    tracker = Tracker()
    drive(tracker, 15, 60.0, 5.0)
    before = tracker.published()[0].steady_s
    assert before is not None
    assert before > 0.5
    for k in range(16, 16 + unseen):
        assert steady(tracker, k) == before, "unseen it becomes no less"
    again = 16 + unseen
    assert steady(tracker, again, (60.0 - 0.5 * again, 0.0)) == (
        pytest.approx(before + 0.1 * (unseen + 1)) if unseen <= 4 else 0.0
    )
    assert (steady(tracker, again + 1, (60.0 - 0.5 * (again + 1), 0.0)) or 0.0) > 0.0


def test_who_leaps_is_steady_from_the_next_sighting_on() -> None:
    tracker = Tracker()
    drive(tracker, 15, 60.0, 5.0)
    assert steady(tracker, 16, (52.0, 2.2)) == 0.0, "2.2 m aside in a tenth of a second"
    assert steady(tracker, 17, (51.5, 2.2)) == pytest.approx(0.1)


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


def test_what_is_hardly_believed_is_not_shown_and_comes_back_as_itself() -> None:
    tracker = Tracker()
    for k in range(1, 13):
        tracker.step(k * STEP_NS, [sighting(30.0, 0.0, score=0.5)] if k < 6 else [], EgoState(20.0, 0.0))
    assert tracker.published() == []
    assert tracker.step(13 * STEP_NS, [sighting(30.0, 0.0, score=0.6)], EgoState(20.0, 0.0)) == [1]


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


def test_a_vague_box_far_away_does_not_keep_a_near_track_alive() -> None:
    """A range by size at 50 m has a sigma of 17 m: 3 m is not among what it may mean."""
    tracker = Tracker()
    for k in range(1, 9):
        tracker.step(k * STEP_NS, [sighting(6.0, 0.0)], EgoState(10.0, 0.0))
    for k in range(9, 30):
        tracker.step(k * STEP_NS, [sighting(50.0, 0.0, sigma_m=17.0, score=0.3)], EgoState(10.0, 0.0))
    assert all(track.x_m > 25.0 for track in tracker.published())


def test_a_low_score_never_adds_up_to_certainty() -> None:
    doubtful, sure = Tracker(), Tracker()
    for k in range(1, 60):
        doubtful.step(k * STEP_NS, [sighting(30.0, 0.0, score=0.12)], EgoState(10.0, 0.0))
        sure.step(k * STEP_NS, [sighting(30.0, 0.0, score=0.95)], EgoState(10.0, 0.0))
    assert doubtful.published() == []
    assert sure.published()[0].confidence > 0.9


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(0.3, 1.0), min_size=5, max_size=40))
def test_a_track_is_no_surer_than_its_surest_picture(scores: list[float]) -> None:
    tracker = Tracker()
    for k, score in enumerate(scores, 1):
        tracker.step(k * STEP_NS, [sighting(30.0, 0.0, score=score)], EgoState(10.0, 0.0))
    for track in tracker.published():
        assert track.confidence <= max(scores) + 1e-9


def test_stamps_that_jump_back_start_afresh() -> None:
    tracker = Tracker()
    drive(tracker, 12, 40.0, 0.0, first=1000)
    assert tracker.published()
    tracker.step(STEP_NS, [sighting(20.0, 0.0)], EgoState(20.0, 0.0))
    assert tracker.published() == []
    assert len(tracker.tracks) == 1


@settings(max_examples=30, deadline=None)
@given(data=st.data())
def test_no_input_makes_a_track_that_is_no_number(data: st.DataObject) -> None:
    tracker = Tracker()
    stamp = 0
    for _ in range(8):
        stamp += data.draw(st.integers(-3 * 10**9, 10**9))
        places = data.draw(st.lists(st.tuples(st.floats(0, 200), st.floats(-30, 30)), max_size=4))
        ego = EgoState(data.draw(st.none() | st.floats(0, 70)), data.draw(st.none() | st.floats(-1, 1)))
        tracker.step(stamp, [sighting(x, y) for x, y in places], ego)
        for track in tracker.published():
            assert math.isfinite(track.x_m + track.y_m + track.vx_mps + track.vy_mps + track.ax_mps2)
            assert track.sigma_x_m > 0
            assert 0 <= track.confidence <= 1


def test_a_short_past_supports_a_short_coast_only() -> None:
    tracker = Tracker()
    drive(tracker, 3, 40.0, 0.0)
    shown = []
    for k in range(4, 14):
        tracker.step(k * STEP_NS, [], EgoState(20.0, 0.0))
        shown.append(len(tracker.published()))
    assert shown == [1] * 4 + [0] * 6


def test_confidence_comes_from_agreement_over_pictures() -> None:
    steady, flickering = Tracker(), Tracker()
    for k in range(1, 21):
        steady.step(k * STEP_NS, [sighting(30.0, 0.0, score=0.9)], EgoState(20.0, 0.0))
        flickering.step(k * STEP_NS, [sighting(30.0, 0.0, score=0.9)] if k % 2 else [], EgoState(20.0, 0.0))
    (sure,), (unsure,) = steady.published(), flickering.published()
    assert sure.confidence > 0.85
    assert unsure.confidence < sure.confidence - 0.05


def test_the_pictures_of_a_camera_that_looks_elsewhere_take_nothing_away() -> None:
    alone, beside, missed = Tracker(), Tracker(), Tracker()
    for k in range(1, 21):
        seen = [sighting(20.0, 3.0, score=0.4)]
        for tracker in (alone, beside, missed):
            tracker.step(k * STEP_NS, seen, EgoState(10.0, 0.0))
        beside.step(k * STEP_NS + STEP_NS // 2, [], EgoState(10.0, 0.0), lambda x_m, y_m: abs(y_m) < 0.05 * x_m)
        missed.step(k * STEP_NS + STEP_NS // 2, [], EgoState(10.0, 0.0))
    sure = [each.published()[0].confidence if each.published() else 0.0 for each in (alone, beside, missed)]
    assert sure[1] == pytest.approx(sure[0], rel=0.1)
    assert sure[2] < 0.95 * sure[1]


def test_a_doubted_box_goes_on_with_a_track_that_no_other_took_and_begins_none() -> None:
    alone, tracker = Tracker(), Tracker()
    for k in range(1, 12):
        assert alone.step(k * STEP_NS, [sighting(40.0, 0.0, score=0.25)], EgoState(10.0, 0.0)) == [0]
    assert alone.tracks == ()
    drive(tracker, 10, 60.0, 5.0)
    (known,) = [each.track_id for each in tracker.published()]
    doubted, sure = sighting(54.5, 0.0, score=0.25), sighting(54.9, 0.2, score=0.8)
    assert tracker.step(11 * STEP_NS, [doubted, sure], EgoState(20.0, 0.0)) == [0, known]
    assert tracker.step(12 * STEP_NS, [sighting(54.0, 0.0, score=0.25)], EgoState(20.0, 0.0)) == [known]


def person(x_m: float, y_m: float, nearer_m: float = 0.0) -> Sighting:
    """Somebody on foot, ranged as LiDAR ranges him, or at his bearing by something so much nearer."""
    bearing = math.atan2(y_m, x_m)
    turn = np.array([[math.cos(bearing), -math.sin(bearing)], [math.sin(bearing), math.cos(bearing)]])
    place = np.array([x_m, y_m]) * (1.0 - nearer_m / math.hypot(x_m, y_m))
    return Sighting(kind="pedestrian", fix=Fix(place, turn @ np.diag([0.15**2, 0.1**2]) @ turn.T), score=0.9)


BESIDE = st.floats(1.0, 6.0).flatmap(lambda y_m: st.sampled_from([y_m, -y_m]))


@given(y_m=BESIDE, nearer_m=st.floats(1.2, 2.4), pictures=st.integers(1, 5))
def test_a_post_before_a_person_makes_him_neither_another_nor_walk_in(
    y_m: float, nearer_m: float, pictures: int
) -> None:
    tracker, ego = Tracker(), EgoState(13.0, 0.0)
    for k in range(1, 21):
        hidden = 13 <= k < 13 + pictures
        seen = person(32.0 - 1.3 * k, y_m, nearer_m if hidden else 0.0)
        assert tracker.step(k * STEP_NS, [seen], ego) == [1]
        if k >= 13:
            (track,) = tracker.published()
            assert (track.x_m - track.length_m / 2, track.y_m) == pytest.approx((32.0 - 1.3 * k, y_m), abs=0.3)
            assert abs(track.vy_mps) < 0.5


@given(y_m=BESIDE, nearer_m=st.floats(0.6, 6.0))
def test_who_stands_nearer_from_now_on_is_believed_to_within_a_second(y_m: float, nearer_m: float) -> None:
    tracker, ego = Tracker(), EgoState(5.0, 0.0)
    for k in range(1, 25):
        tracker.step(k * STEP_NS, [person(32.0 - 0.5 * k, y_m, nearer_m if k >= 13 else 0.0)], ego)
    there = person(32.0 - 0.5 * 24, y_m, nearer_m).fix.place
    nearest = min(
        math.hypot(each.x_m - each.length_m / 2 - there[0], each.y_m - there[1]) for each in tracker.published()
    )
    assert nearest < 0.5

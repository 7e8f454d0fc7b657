"""Tracks through noise, drop-outs, clutter and the ego's own motion."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from services.perception.track.kalman import Fix
from services.perception.track.road_user import EgoState, Sighting
from services.perception.track.tracker import Tracker
from tests.unit.services.perception.support import STEP_NS, drive, sighting, steady


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


def test_what_is_hardly_believed_is_not_shown_and_comes_back_as_itself() -> None:
    tracker = Tracker()
    for k in range(1, 13):
        tracker.step(k * STEP_NS, [sighting(30.0, 0.0, score=0.5)] if k < 6 else [], EgoState(20.0, 0.0))
    assert tracker.published() == []
    assert tracker.step(13 * STEP_NS, [sighting(30.0, 0.0, score=0.6)], EgoState(20.0, 0.0)) == [1]


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

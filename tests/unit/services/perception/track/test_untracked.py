"""Without tracking each picture's road users are new ones."""

from services.perception.track.road_user import EgoState
from services.perception.track.tracker import Tracker
from services.perception.track.untracked import tracker_of
from tests.unit.services.perception.support import STEP_NS, drive, sighting


def test_every_picture_shows_new_actors_of_unknown_speed_as_sure_as_their_boxes() -> None:
    tracker = tracker_of(tracking=False)
    assert len(drive(tracker, 10, 40.0, 8.0)) == 10
    (track,) = tracker.published()
    assert (track.age_s, track.unseen_s) == (0.0, 0.0)
    assert track.sigma_vx_mps > 5.0
    assert track.confidence == 0.8
    tracker.step(12 * STEP_NS, [], EgoState(20.0, 0.0))
    assert tracker.published() == []


def test_one_box_is_shown_at_once_where_a_tracker_waits_for_more() -> None:
    for tracking, shown in ((False, 1), (True, 0)):
        tracker = tracker_of(tracking=tracking)
        tracker.step(STEP_NS, [sighting(30.0, 0.0, score=0.4)], EgoState(20.0, 0.0))
        assert len(tracker.published()) == shown
    assert type(tracker_of(tracking=True)) is Tracker

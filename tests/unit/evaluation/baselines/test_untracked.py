"""Without tracking each picture's road users are new ones."""

import pytest

from drivemcp.errors import ConfigError
from drivemcp.testing import bus
from evaluation.baselines.untracked import Untracked
from services.perception.service import SERVICE, PerceptionConfig
from services.perception.track.road_user import EgoState
from services.perception.track.tracker import Tracker
from tests.unit.services.perception.support import STEP_NS, drive, sighting


def test_every_picture_shows_new_actors_of_unknown_speed_as_sure_as_their_boxes() -> None:
    tracker = Untracked()
    assert len(drive(tracker, 10, 40.0, 8.0)) == 10
    (track,) = tracker.published()
    assert (track.age_s, track.unseen_s) == (0.0, 0.0)
    assert track.sigma_vx_mps > 5.0
    assert track.confidence == 0.8
    tracker.step(12 * STEP_NS, [], EgoState(20.0, 0.0))
    assert tracker.published() == []


def test_one_box_is_shown_at_once_where_a_tracker_waits_for_more() -> None:
    for tracker, shown in ((Untracked(), 1), (Tracker(), 0)):
        tracker.step(STEP_NS, [sighting(30.0, 0.0, score=0.4)], EgoState(20.0, 0.0))
        assert len(tracker.published()) == shown


def test_it_is_refused_outside_simulation() -> None:
    with bus() as b:
        with pytest.raises(ConfigError, match=r"perception\.tracking.*lockstep"):
            b.start(SERVICE, PerceptionConfig(tracking=False))
        b.start(SERVICE, PerceptionConfig(tracking=False, lockstep=True))

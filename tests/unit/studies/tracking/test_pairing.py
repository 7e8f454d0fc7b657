"""Who counts, who is ignored, and whose track is whose."""

import pytest

from proto.truth import TrueActor
from studies.tracking.errors import errors
from studies.tracking.pairing import scene
from tests.unit.studies.tracking.views import actor, label, track, view


def test_a_track_within_two_metres_of_the_near_surface_is_the_vehicles() -> None:
    near = scene(view((actor(1, 20.0),), (label(1),), (track(7, 21.9),)))
    far = scene(view((actor(1, 20.0),), (label(1),), (track(7, 22.1),)))
    assert near.pairs == {1: 7}
    assert far.pairs == {}


def test_a_longer_body_is_measured_by_its_near_surface() -> None:
    lorry = TrueActor(actor_id=1, kind="vehicle", x_m=26.0, y_m=0.0, vx_mps=0.0, vy_mps=0.0, length_m=16.5, width_m=2.5)
    found = scene(view((lorry,), (label(1),), (track(7, 20.0),)))
    assert found.apart_m[0, 0] == pytest.approx(0.0, abs=1e-9)


def test_half_hidden_vehicles_and_those_beyond_reach_are_ignored_with_their_tracks() -> None:
    hidden, far = actor(1, 20.0), actor(2, 66.0)
    found = scene(view((hidden, far), (label(1, visible=0.4), label(2)), (track(7, 20.0), track(8, 66.0))))
    assert found.vehicles == ()
    assert found.tracks == ()
    assert found.pairs == {1: 7, 2: 8}


def test_a_track_that_is_nobodys_stays_and_one_outside_the_view_goes() -> None:
    found = scene(view((actor(1, 20.0),), (label(1),), (track(7, 20.0), track(8, 40.0), track(9, 5.0, 6.0))))
    assert [each.track_id for each in found.tracks] == [7, 8]


def test_two_tracks_on_one_vehicle_are_one_right_and_one_wrong() -> None:
    found = scene(view((actor(1, 20.0),), (label(1),), (track(7, 20.9), track(8, 20.2))))
    assert found.pairs == {1: 8}
    assert len(found.tracks) == 2


def test_speeds_count_from_the_age_of_a_second() -> None:
    scenes = [
        scene(view((actor(1, 20.0, vx_mps=-3.0),), (label(1),), (track(7, 20.4, vx_mps=-1.0, age_s=0.5),))),
        scene(view((actor(1, 20.0, vx_mps=-3.0),), (label(1),), (track(7, 20.4, vx_mps=-2.6, age_s=1.5),))),
    ]
    found = errors(scenes)
    assert found.closing_rms_mps == pytest.approx(0.4)
    assert found.gap_m == pytest.approx(0.4)
    assert found.gap_share == pytest.approx(0.4 / (20.0 - 2.25 - 2.3))

"""Standard scores against cases worked by hand."""

import pytest

from studies.tracking.pairing import scene
from studies.tracking.scores import scores
from tests.unit.studies.tracking.views import actor, label, track, view

pytest.importorskip("trackeval", reason="the extra `evaluation` is not installed")


def test_a_perfect_drive_scores_one() -> None:
    scenes = [scene(view((actor(1, 20.0),), (label(1),), (track(7, 20.0),))) for _ in range(10)]
    found = scores(scenes)
    assert (found.idf1, found.hota, found.mota, found.identity_switches) == pytest.approx((1.0, 1.0, 1.0, 0))


def test_a_change_of_id_halfway_costs_identity_and_little_accuracy() -> None:
    """Of ten pictures five keep the better id: IDF1 = 2 * 5 / (10 + 10); one switch in ten: MOTA = 0.9."""
    scenes = [scene(view((actor(1, 20.0),), (label(1),), (track(7 + k // 5, 20.0),))) for k in range(10)]
    found = scores(scenes)
    assert found.idf1 == pytest.approx(0.5)
    assert found.mota == pytest.approx(0.9)
    assert found.identity_switches == 1


def test_misses_and_ghosts_are_counted_and_ignored_vehicles_are_not() -> None:
    """Four vehicles seen, one missed, one ghost: MOTA = 1 - 2 / 4; the hidden one's track changes nothing."""
    hidden = actor(2, 30.0, 5.0), label(2, visible=0.3), track(9, 30.0, 5.0)
    plain = view((actor(1, 20.0), hidden[0]), (label(1), hidden[1]), (track(7, 20.0), hidden[2]))
    ghostly = view((actor(1, 20.0),), (label(1),), (track(7, 20.0), track(8, 40.0)))
    missed = view((actor(1, 20.0),), (label(1),), ())
    found = scores([scene(each) for each in (plain, plain, ghostly, missed)])
    assert found.mota == pytest.approx(1.0 - 2 / 4)
    assert (found.recall, found.precision) == pytest.approx((0.75, 0.75))


def test_where_nothing_is_tracked_the_scores_are_zero() -> None:
    found = scores([scene(view((actor(1, 20.0),), (label(1),), ()))])
    assert (found.idf1, found.hota, found.recall) == (0.0, 0.0, 0.0)

"""Dark, frozen and lost are what they are called; stamps move within their bound."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.corruption.sensors import Cameras, Stamps, black
from evaluation.corruption.spec import CorruptionSpec
from tests.unit.evaluation.corruption.worlds import SECOND, SOME, TICK, drive, frame


def test_a_black_picture_is_one() -> None:
    picture = cv2.imdecode(np.frombuffer(black(64, 36), np.uint8), cv2.IMREAD_COLOR)
    assert picture is not None
    assert picture.shape == (36, 64, 3)
    assert picture.max() == 0


@SOME
@given(st.integers(0, 10**6))
def test_a_frozen_camera_shows_the_last_picture_before_and_counts_on(seed: int) -> None:
    cameras, last = Cameras(CorruptionSpec(seed=seed, freeze=0.4)), 0
    for number in range(200):
        after, windows = cameras.frame(frame(number), "front", number * TICK)
        last = last if windows and number else number
        assert after.jpeg == b"picture %d" % last
        assert after.frame == number


def test_cameras_fail_each_for_itself_and_every_window_is_told_once() -> None:
    rows = drive(CorruptionSpec(seed=2, blackout=0.3, lidar_loss=0.3), 300)
    dark = [(row[0].message.jpeg == black(64, 36), row[1].message.jpeg == black(64, 36)) for row in rows]
    assert len(set(dark)) == 4
    told = [record for row in rows for left in row for record in left.records]
    assert len({(record.subject, record.until_ns) for record in told}) == len(told)
    starts = sum(now[0] and not before[0] for before, now in zip([(False, False), *dark], dark, strict=False))
    assert sum(record.subject == "camera/front" for record in told) == starts


@SOME
@given(st.integers(0, 10**6), st.floats(0.1, 200.0), st.booleans())
def test_stamps_move_within_the_bound_and_keep_their_order_where_asked(seed: int, most_ms: float, order: bool) -> None:
    stamps = Stamps(CorruptionSpec(seed=seed, jitter_ms=most_ms, jitter_keeps_order=order))
    told = [stamps.shifted("front", SECOND + n * TICK // 2, n * TICK // 2) for n in range(60)]
    assert all(abs(after - (SECOND + n * TICK // 2)) <= most_ms * 1e6 + 60 for n, after in enumerate(told))
    assert len(set(told)) > 1
    if order:
        assert told == sorted(set(told))


@pytest.mark.parametrize("order", [True, False])
def test_much_noise_breaks_the_order_only_where_allowed(order: bool) -> None:
    stamps = Stamps(CorruptionSpec(jitter_ms=200.0, jitter_keeps_order=order))
    told = [stamps.shifted("front", n * TICK, n * TICK) for n in range(60)]
    assert (told == sorted(told)) == order

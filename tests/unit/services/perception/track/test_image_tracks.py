"""Signs keep their track ids while they grow and move out of the picture."""

import itertools
from dataclasses import replace

from hypothesis import given
from hypothesis import strategies as st

from services.perception.detect.detection import Detection
from services.perception.track.image_tracks import Approach, ImageTracker

STEP_NS = 200_000_000


def sign_at(distance_m: float, lateral_m: float, height_m: float, size_m: float = 0.6) -> Detection:
    """A sign as the tele camera sees it."""
    focal = 1443.0
    u, v, half = (
        320 + focal * lateral_m / distance_m,
        180 - focal * height_m / distance_m,
        focal * size_m / distance_m / 2,
    )
    return Detection(x0_px=u - half, y0_px=v - half, x1_px=u + half, y1_px=v + half, kind="sign", score=0.8)


def test_an_approached_sign_keeps_its_id_at_100_km_h() -> None:
    tracker = ImageTracker(itertools.count(1))
    ids = {tracker.step(k * STEP_NS, [sign_at(90.0 - 28.0 * k * 0.2, 4.0, 0.8)])[0] for k in range(1, 13)}
    assert ids == {1}


def test_two_signs_on_one_post_keep_apart() -> None:
    tracker = ImageTracker(itertools.count(1))
    seen = set()
    for k in range(1, 14):
        distance = 70.0 - 14.0 * k * 0.2
        seen.add(tuple(tracker.step(k * STEP_NS, [sign_at(distance, 4.0, 1.1), sign_at(distance, 4.0, 0.45, 0.4)])))
    assert seen == {(1, 2)}


@given(radps=st.floats(-0.2, 0.2), speed_mps=st.floats(5.0, 25.0))
def test_stacked_signs_keep_their_ids_in_a_bend(radps: float, speed_mps: float) -> None:
    """The ego turns as steadily as it drives; by 0.2 rad/s the tele camera moves 80 px aside from picture to picture."""
    tracker, seen = ImageTracker(itertools.count(1)), set()
    for k in range(1, 13):
        distance, turned_px = 90.0 - speed_mps * k * 0.2, 2020.0 * radps * k * 0.2
        both = [aside(sign_at(distance, 1.0, height_m), turned_px) for height_m in (1.1, 0.45)]
        told = [Approach(growth_per_s=speed_mps / distance, u_px=320, v_px=180)] * 2
        seen.add(tuple(tracker.step(k * STEP_NS, both, told, 2020.0 * radps)))
    assert seen == {(1, 2)}


def aside(sign: Detection, px: float) -> Detection:
    return replace(sign, x0_px=sign.x0_px + px, x1_px=sign.x1_px + px)


def test_a_lower_face_never_takes_the_track_of_an_upper_one_that_fails() -> None:
    """The two faces appear in turns; the ego's speed tells how each will move."""
    tracker = ImageTracker(itertools.count(1))
    upper_ids, lower_ids = set(), set()
    for k in range(1, 14):
        distance = 70.0 - 14.0 * k * 0.2
        told = [Approach(growth_per_s=14.0 / distance, u_px=320, v_px=180)]
        if k % 2:
            upper_ids.update(tracker.step(k * STEP_NS, [sign_at(distance, 4.0, 1.2)], told))
        else:
            lower_ids.update(tracker.step(k * STEP_NS, [sign_at(distance, 4.0, 0.55, 0.6)], told))
    assert upper_ids.isdisjoint(lower_ids)
    assert len(upper_ids) == len(lower_ids) == 1


def test_a_sign_missed_in_two_pictures_keeps_its_id() -> None:
    tracker = ImageTracker(itertools.count(1))
    ids = set()
    for k in range(1, 14):
        found = [] if k in (7, 8) else [sign_at(70.0 - 14.0 * k * 0.2, 4.0, 0.8)]
        ids.update(tracker.step(k * STEP_NS, found))
    assert ids == {1}


def test_another_class_on_the_same_spot_is_another_track() -> None:
    tracker = ImageTracker(itertools.count(1))
    first = tracker.step(STEP_NS, [sign_at(40.0, 4.0, 0.8)])
    panel = Detection(x0_px=440, y0_px=130, x1_px=470, y1_px=160, kind="panel", score=0.8)
    assert tracker.step(2 * STEP_NS, [panel]) != first


def test_a_track_ends_when_nothing_was_seen_for_long() -> None:
    tracker = ImageTracker(itertools.count(1))
    tracker.step(STEP_NS, [sign_at(40.0, 4.0, 0.8)])
    assert tracker.step(STEP_NS + 2_000_000_000, [sign_at(40.0, 4.0, 0.8)]) == [2]

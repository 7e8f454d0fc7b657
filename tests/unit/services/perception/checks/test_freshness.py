"""A camera that is dark, blank or frozen tells nothing, however new its stamps are."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proto.sensors import CameraFrame
from proto.vehicle import Ego
from services.perception.checks.decoding import Malformed
from services.perception.pipeline import Perception, Seen
from tests.unit.services.perception.pictures import plain, taken
from tests.unit.services.perception.test_pipeline import CALIBRATION, STEP_NS, Told, car_at


class _Drive:
    """A car 30 m ahead, in front of a camera that ten times a second shows what it is given."""

    def __init__(self, speed_mps: float | None = 15.0) -> None:
        self.perception = Perception(Told(found=[car_at(30.0)]))
        self.perception.calibrate("front", CALIBRATION)
        self.speed_mps, self.step = speed_mps, 0

    def see(self, frame: CameraFrame) -> Seen:
        self.step += 1
        self.perception.ego(self.step * STEP_NS, Ego(speed_mps=self.speed_mps, yaw_rate_radps=0.0))
        return self.perception.see("front", self.step * STEP_NS, frame)

    def sees(self, frame: CameraFrame) -> bool:
        try:
            return self.see(frame).tracks is not None
        except Malformed:
            return False


@pytest.mark.parametrize("level", [0, 90, 255])
def test_a_picture_of_one_brightness_shows_nothing_and_gives_no_empty_road(level: int) -> None:
    drive = _Drive()
    with pytest.raises(Malformed, match="'front' shows nothing"):
        drive.see(plain(level))


def test_the_same_picture_again_is_none_while_we_move_and_the_next_other_one_is() -> None:
    drive = _Drive()
    last = taken()
    assert drive.sees(last)
    with pytest.raises(Malformed, match="'front' is frozen"):
        drive.see(last)
    assert drive.sees(taken())


@pytest.mark.parametrize("speed_mps", [0.0, 0.9, None])
def test_a_car_that_stands_or_tells_no_speed_may_see_the_same_again(speed_mps: float | None) -> None:
    drive = _Drive(speed_mps)
    last = taken()
    assert all(drive.sees(last) for _ in range(5))


def test_a_camera_that_was_caught_frozen_stays_so_until_it_shows_something_else() -> None:
    drive = _Drive()
    last = taken()
    assert drive.sees(last)
    assert not drive.sees(last)
    drive.speed_mps = 0.0
    assert not any(drive.sees(last) for _ in range(5))
    assert drive.sees(taken())


def test_each_camera_is_judged_by_its_own_pictures() -> None:
    drive = _Drive()
    last = taken()
    assert drive.sees(last)
    assert drive.perception.see("tele", drive.step * STEP_NS + 1, last).boxes.camera == "tele"


@given(st.lists(st.integers(0, 3), min_size=2, max_size=20))
@settings(max_examples=40, deadline=None)
def test_while_we_move_a_track_is_never_surer_by_pictures_that_were_seen_before(repeats: list[int]) -> None:
    """A drive with repeated pictures knows what one without them knows, or less."""
    once, again = _Drive(), _Drive()
    for count in repeats:
        frame = taken()
        assert once.see(frame).tracks == again.see(frame).tracks
        assert not any(again.sees(frame) for _ in range(count))
        again.step -= count

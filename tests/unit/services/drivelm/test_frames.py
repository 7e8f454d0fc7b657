"""Pictures are kept for a while by their stamp; what is no picture is none."""

import cv2
import numpy as np

from services.drivelm.cameras import RecentFrames
from services.player.street import numbered

JPEG = bytes(cv2.imencode(".jpg", np.full((8, 8, 3), (0, 0, 250), np.uint8))[1].tobytes())


def test_the_picture_of_a_stamp_comes_back_in_rgb() -> None:
    frames = RecentFrames()
    frames.add("tele", 5, JPEG)
    picture = frames.picture("tele", 5)
    assert picture is not None
    assert picture[4, 4, 0] > 200 > picture[4, 4, 2]


def test_old_pictures_go_and_missing_ones_are_counted() -> None:
    frames = RecentFrames(keep=3)
    for stamp in range(5):
        frames.add("tele", stamp, numbered(JPEG, stamp))
    assert frames.picture("tele", 1) is None
    assert frames.picture("front", 4) is None
    assert frames.picture("tele", 4) is not None
    assert frames.missed == 2


def test_broken_bytes_are_no_picture() -> None:
    frames = RecentFrames()
    for stamp, jpeg in enumerate((b"", b"\xff\xd8broken")):
        frames.add("tele", stamp, jpeg)
        assert frames.picture("tele", stamp) is None


def test_a_picture_that_breaks_off_in_its_head_is_none_and_the_next_one_is_read() -> None:
    frames = RecentFrames()
    for stamp, jpeg in enumerate((JPEG[:40], JPEG)):
        frames.add("tele", stamp, jpeg)
    assert frames.picture("tele", 0) is None
    assert frames.picture("tele", 1) is not None
    assert frames.missed == 0, "both came"


def test_the_last_picture_again_is_no_new_one_until_another_came() -> None:
    frames = RecentFrames()
    for stamp, number in enumerate((1, 1, 1, 2, 1)):
        frames.add("tele", stamp, numbered(JPEG, number))
    assert [frames.picture("tele", stamp) is not None for stamp in range(5)] == [True, False, False, True, True]
    frames.add("front", 1, numbered(JPEG, 1))
    assert frames.picture("front", 1) is not None, "each camera for itself"

"""The README's moving picture: every third picture of a stretch of a drive."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from scripts import moving_picture


def test_every_third_picture_of_the_stretch_is_shown(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pictures = [np.full((120, 200, 3), 8 * number, np.uint8) for number in range(30)]
    monkeypatch.setattr(moving_picture, "annotated", lambda logs: iter(pictures))
    target = tmp_path / "drive.webp"
    assert moving_picture.write([tmp_path], target, begin=3, most=12) == 4
    read, animation = cv2.imreadanimation(str(target))
    assert read
    assert [frame.shape[1] for frame in animation.frames] == [moving_picture.WIDTH_PX] * 4
    assert [round(float(frame[..., :3].mean()) / 8) for frame in animation.frames] == [3, 6, 9, 12]


def test_a_log_without_pictures_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="no pictures of the front camera"):
        moving_picture.write([], tmp_path / "drive.webp")

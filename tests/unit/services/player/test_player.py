"""Recordings through the sensor topics."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from drivemcp.errors import UserError
from drivemcp.testing import bus
from proto import topics
from services.player.service import SERVICE, PlayerConfig
from services.player.source import open_recording


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Four pictures, each of one grey."""
    for number in range(4):
        cv2.imwrite(str(tmp_path / f"{number}.png"), np.full((90, 160, 3), 40 * number, np.uint8))
    return tmp_path


def test_a_folder_of_pictures_is_published_in_order_with_a_calibration_and_an_end(folder: Path) -> None:
    with bus() as b:
        frames = b.collect(topics.CAMERA, id="front")
        states = b.collect(topics.SCENARIO)
        calibrations = b.collect(topics.CALIBRATION, id="front")
        b.start(SERVICE, PlayerConfig(source=str(folder), picture_period_s=0.05))
        frames.wait_count(4)
        decoded = [cv2.imdecode(np.frombuffer(f.jpeg, np.uint8), cv2.IMREAD_GRAYSCALE) for f in frames.messages]
        means = [np.mean(grey) for grey in decoded if grey is not None]
        assert means == pytest.approx([0, 40, 80, 120], abs=3)
        assert states.wait(lambda state: state.finished).scenario == folder.name
        assert calibrations.wait().width_px == 160


def test_a_video_keeps_its_own_pace(tmp_path: Path) -> None:
    path = tmp_path / "clip.mp4"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 20.0, (1200, 600))
    for _ in range(20):
        writer.write(np.zeros((600, 1200, 3), np.uint8))
    writer.release()
    recording = open_recording(str(path), picture_period_s=1.0, max_rate_hz=10.0)
    pictures = list(recording.pictures)
    assert len(pictures) == 10
    assert [p.at_s for p in pictures[:3]] == pytest.approx([0.0, 0.1, 0.2])
    assert pictures[0].bgr.shape == (480, 960, 3)


@pytest.mark.parametrize("name", ["absent.mp4", "text.mp4", "empty"])
def test_what_is_no_recording_is_told_in_one_line(tmp_path: Path, name: str) -> None:
    (tmp_path / "text.mp4").write_text("no video")
    (tmp_path / "empty").mkdir()
    with pytest.raises(UserError, match=name):
        open_recording(str(tmp_path / name), picture_period_s=1.0, max_rate_hz=10.0)

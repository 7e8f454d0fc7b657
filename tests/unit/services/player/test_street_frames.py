"""Frames with LiDAR and calibration: geometry kept, everything wrong named."""

import json
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from drivemcp.errors import UserError
from drivemcp.testing import bus
from proto import topics
from proto.sensors import Calibration, CameraFrame, LidarSweep
from services.perception.checks.decoding import open_picture
from services.perception.range.camera import Camera
from services.player.recording import Options
from services.player.service import SERVICE, PlayerConfig
from services.player.source import open_recording
from services.player.street import read_frame

HEIGHT_M = 1.8
SCENE = np.array([[5.0, 20.0, -1.0], [-3.0, 12.0, 0.5], [0.0, 40.0, -1.5], [8.0, 15.0, 0.0]])
"""In the LiDAR's frame: x right, y forward, z up."""


def mount(roll_rad: float, pitch_rad: float, yaw_rad: float) -> np.ndarray[Any, Any]:
    """LiDAR to camera (x right, y down, z forward), the camera turned and 0.4 m below and 0.3 m before the LiDAR."""
    base = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    turn = cv2.Rodrigues(np.array([0.0, 0.0, roll_rad]))[0] @ cv2.Rodrigues(np.array([pitch_rad, 0.0, 0.0]))[0]
    matrix = np.eye(4)
    matrix[:3, :3] = turn @ cv2.Rodrigues(np.array([0.0, yaw_rad, 0.0]))[0] @ base
    matrix[:3, 3] = -matrix[:3, :3] @ np.array([0.0, 0.3, -0.4])
    return matrix


def write(folder: Path, lidar_to_camera: np.ndarray[Any, Any], **changes: Any) -> Path:
    """A frame of a road with SCENE's points on it."""
    folder.mkdir(exist_ok=True)
    cv2.imwrite(str(folder / "front.jpg"), np.full((90, 160, 3), 90, np.uint8))
    angles = np.linspace(0, 2 * np.pi, 400)
    road = np.column_stack([10 * np.sin(angles), 10 * np.cos(angles), np.full(400, -HEIGHT_M)])
    points = np.concatenate([SCENE, road])
    np.column_stack([points, np.zeros((len(points), 2))]).astype("<f4").tofile(folder / "lidar.bin")
    told: dict[str, Any] = {
        "timestamp_s": 100.0,
        "camera": {
            "file": "front.jpg",
            "size": [160, 90],
            "intrinsic": [[120.0, 0.0, 82.0], [0.0, 120.0, 46.0], [0.0, 0.0, 1.0]],
            "lidar_to_camera": lidar_to_camera.tolist(),
        },
        "lidar": {"file": "lidar.bin"},
    } | changes
    (folder / "frame.json").write_text(json.dumps(told))
    return folder


@pytest.mark.parametrize("turned", [(0.0, 0.0, 0.0), (0.05, 0.0, 0.0), (-0.03, 0.04, 0.1), (0.02, -0.1, -0.2)])
def test_every_return_falls_on_the_pixel_that_the_survey_gives_it(
    tmp_path: Path, turned: tuple[float, float, float]
) -> None:
    matrix = mount(*turned)
    frame = read_frame(write(tmp_path, matrix) / "frame.json")
    points = np.frombuffer(frame.sweep.points, "<f4").reshape(-1, 4)[: len(SCENE), :3].astype(np.float64)
    pixels, depths = Camera.of(frame.calibration).project(points)
    local = SCENE @ matrix[:3, :3].T + matrix[:3, 3]
    assert depths == pytest.approx(local[:, 2], abs=1e-4)
    assert pixels == pytest.approx(local[:, :2] / local[:, 2:] * 120.0 + (82.0, 46.0), abs=1e-2)


def test_the_road_is_measured_from_the_returns_and_lies_at_zero(tmp_path: Path) -> None:
    frame = read_frame(write(tmp_path, mount(0.0, 0.0, 0.0)) / "frame.json")
    assert frame.calibration.z_m == pytest.approx(HEIGHT_M - 0.4, abs=0.05)
    points = np.frombuffer(frame.sweep.points, "<f4").reshape(-1, 4)
    assert np.median(points[:, 2]) == pytest.approx(0.0, abs=0.05)


def test_a_single_frame_is_shown_for_a_while_with_sweep_and_calibration(tmp_path: Path) -> None:
    folder = write(tmp_path, mount(0.0, 0.0, 0.0), ego={"speed_mps": 7.5})
    with bus() as b:
        sweeps = b.collect(topics.LIDAR, id="roof")
        frames = b.collect(topics.CAMERA, id="front")
        egos = b.collect(topics.EGO)
        calibrations = b.collect(topics.CALIBRATION, id="front")
        b.start(SERVICE, PlayerConfig(source=str(folder), hold_s=0.3))
        assert len(frames.wait_count(3)) == 3
        assert sweeps.wait().count == len(SCENE) + 400
        assert egos.wait().speed_mps == 7.5
        assert not calibrations.wait().assumed


def test_frames_in_subfolders_are_played_by_their_stamps(tmp_path: Path) -> None:
    write(tmp_path / "b", mount(0.0, 0.0, 0.0), timestamp_s=100.0)
    write(tmp_path / "a", mount(0.0, 0.0, 0.0), timestamp_s=100.5)
    recording = open_recording(str(tmp_path), Options())
    assert not recording.ego
    times = [each.at_s for each in recording.messages if isinstance(each.message, LidarSweep | Calibration)]
    assert times == [0.0, 0.0, 0.5, 0.5]


@pytest.mark.parametrize(
    ("part", "value", "complaint"),
    [
        ("timestamp_s", None, r"timestamp_s"),
        (
            "camera",
            {"file": "front.jpg", "size": [160, 90], "lidar_to_camera": np.eye(4).tolist()},
            "intrinsic.*camera",
        ),
        ("lidar", {}, r"file.*\$\.lidar"),
        ("lidar", {"file": "absent.bin"}, "lidar.file: cannot read"),
        ("lidar", {"file": "front.jpg"}, "does not hold rows"),
        ("lidar", {"file": "lidar.bin", "height_m": -1.0}, "height_m"),
        ("ego", {"speed_mps": "fast"}, "speed_mps"),
    ],
)
def test_a_field_that_is_absent_or_wrong_is_named(tmp_path: Path, part: str, value: Any, complaint: str) -> None:
    write(tmp_path, mount(0.0, 0.0, 0.0), **{part: value})
    with pytest.raises(UserError, match=rf"frame\.json: .*{complaint}") as raised:
        open_recording(str(tmp_path), Options())
    assert "\n" not in str(raised.value)


def test_a_mount_that_is_no_rotation_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="lidar_to_camera is no rotation"):
        open_recording(str(write(tmp_path, np.ones((4, 4)))), Options())


def test_a_picture_of_another_size_is_refused(tmp_path: Path) -> None:
    folder = write(tmp_path, mount(0.0, 0.0, 0.0))
    cv2.imwrite(str(folder / "front.jpg"), np.zeros((45, 80, 3), np.uint8))
    with pytest.raises(UserError, match=r"camera\.size is 160 x 90, the picture 80 x 45"):
        open_recording(str(folder), Options())


def test_a_frame_that_is_shown_on_and_on_is_no_frozen_camera(tmp_path: Path) -> None:
    folder = write(tmp_path, mount(0.0, 0.0, 0.0), ego={"speed_mps": 7.5})
    cv2.imwrite(str(folder / "front.jpg"), np.random.default_rng(1).integers(0, 255, (90, 160, 3), np.uint8))
    pictures = [
        each.message
        for each in open_recording(str(folder), Options(hold_s=1.0)).messages
        if each.topic is topics.CAMERA
    ]
    shown = [open_picture(picture) for picture in pictures if isinstance(picture, CameraFrame)]
    assert len(shown) == 10
    assert all((each == shown[0]).all() for each in shown), "it is one picture"
    assert len({picture.jpeg for picture in pictures if isinstance(picture, CameraFrame)}) == 10


def test_rows_without_a_ring_are_told_from_those_with_one(tmp_path: Path) -> None:
    folder = write(tmp_path, mount(0.0, 0.0, 0.0))
    rows = np.fromfile(folder / "lidar.bin", "<f4").reshape(-1, 5)[:400, :4]  # 1,600 numbers are 320 rows of five
    rows.tofile(folder / "lidar.bin")
    with pytest.raises(
        UserError, match=r"lidar.file: lidar.bin holds intensities below 0; are its rows x, y, z, intensity"
    ):
        read_frame(folder / "frame.json")

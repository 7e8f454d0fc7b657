"""Measured on real photographs with a detector for photographs; skipped where the shared material is absent."""

import json
from typing import Any

import cv2
import numpy as np
import pytest

from proto.sensors import Calibration, CameraFrame
from services.perception.detect.detection import Detection, overlaps
from services.perception.detect.detector import DetectorOptions
from services.perception.detect.loading import load_detector
from services.perception.pipeline import Perception
from services.perception.range.box_range import ProjectedSweep, find_range
from services.perception.range.camera import Camera
from tests.shared import SHARED

MODEL, FUSED, CLIP = (
    SHARED / name for name in ("models/yolox_nano.onnx", "data/street/fused-frame", "data/dashcam/highway.mp4")
)
pytestmark = pytest.mark.skipif(
    not MODEL.is_file(),
    reason="no photographs and detector at ../shared (or DRIVEMCP_SHARED): they are not ours to ship",
)
SENSOR_HEIGHT_M = 1.84
TO_EGO = np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
"""From the LiDAR's frame (x right, y forward) to ours (x forward, y left)."""
HALF_LENGTHS_M = {"car": 2.3, "truck": 4.5, "pedestrian": 0.3}
"""Labelled depths are of the object's middle; ranges are of its near surface."""


@pytest.fixture(scope="module")
def fused() -> tuple[dict[str, Any], Camera, ProjectedSweep]:
    """The labelled frame, its camera and its sweep before it, in the ego frame."""
    frame = json.loads((FUSED / "frame.json").read_text(encoding="utf-8"))
    matrix, mount = np.array(frame["camera"]["intrinsic"]), np.array(frame["camera"]["lidar_to_camera"])
    lift = np.array([0.0, 0.0, SENSOR_HEIGHT_M])
    eye = TO_EGO @ (-mount[:3, :3].T @ mount[:3, 3]) + lift
    calibration = Calibration(
        fx_px=matrix[0, 0],
        fy_px=matrix[1, 1],
        cx_px=matrix[0, 2],
        cy_px=matrix[1, 2],
        width_px=1600,
        height_px=900,
        z_m=eye[2],
    )
    camera = Camera(calibration, mount[:3, :3] @ TO_EGO.T, eye, 0.005)
    points = np.fromfile(FUSED / "lidar.bin", "<f4").reshape(-1, 5)[:, :3] @ TO_EGO.T + lift
    return frame, camera, ProjectedSweep.of(points, camera)


def test_lidar_ranges_of_detected_vehicles_lie_at_their_labelled_near_surface(
    fused: tuple[dict[str, Any], Camera, ProjectedSweep],
) -> None:
    frame, camera, sweep = fused
    photograph = cv2.imread(str(FUSED / "front.jpg"))
    assert photograph is not None
    picture = cv2.cvtColor(photograph, cv2.COLOR_BGR2RGB).astype(np.uint8)
    truth = frame["objects_2d_front"]
    boxes = np.array([each["box_xyxy_px"] for each in truth], np.float32)
    errors = []
    for found in load_detector(MODEL, DetectorOptions(score_floor=0.25)).detect(picture):
        overlap = overlaps(np.array([[found.x0_px, found.y0_px, found.x1_px, found.y1_px]], np.float32), boxes)[0]
        best = truth[int(overlap.argmax())]
        measured = find_range(found, camera, sweep)
        if overlap.max() > 0.5 and best["category"] in HALF_LENGTHS_M:
            assert measured is not None
            assert measured.source == "lidar"
            errors.append(measured.depth_m - (best["depth_m"] - HALF_LENGTHS_M[best["category"]]))
    assert len(errors) >= 4
    assert np.abs(errors).max() < 1.0, errors


def test_lidar_ranges_of_labelled_people_agree_with_their_depth(
    fused: tuple[dict[str, Any], Camera, ProjectedSweep],
) -> None:
    frame, camera, sweep = fused
    errors = []
    for each in frame["objects_2d_front"]:
        x0, y0, x1, y1 = each["box_xyxy_px"]
        if each["category"] == "pedestrian" and each["depth_m"] < 50:
            box = Detection(x0_px=x0, y0_px=y0, x1_px=x1, y1_px=y1, kind="pedestrian", score=1.0)
            found = find_range(box, camera, sweep)
            if found is not None and found.source == "lidar" and found.returns >= 2:
                errors.append(abs(found.depth_m - each["depth_m"]))
    assert len(errors) >= 5
    assert np.median(errors) < 0.5
    assert np.quantile(errors, 0.8) < 1.5, "some are half hidden by another, who is then measured"


def test_vehicles_are_tracked_on_a_dashcam_clip_without_calibration_ego_speed_or_lidar() -> None:
    perception = Perception(load_detector(MODEL, DetectorOptions(score_floor=0.25)))
    clip = cv2.VideoCapture(str(CLIP))
    spans: dict[int, int] = {}
    for number in range(160):
        good, picture = clip.read()
        assert good
        if number % 2:
            continue
        jpeg = cv2.imencode(".jpg", picture)[1].tobytes()
        frame = CameraFrame(jpeg=jpeg, width_px=picture.shape[1], height_px=picture.shape[0], frame=number)
        seen = perception.see("front", 10**9 + number * 40_000_000, frame)
        assert seen.tracks is not None
        assert seen.tracks.ego_speed_used_mps is None
        assert not any(track.oncoming for track in seen.tracks.tracks)
        for track in seen.tracks.tracks:
            spans[track.track_id] = spans.get(track.track_id, 0) + 1
    assert sum(span >= 20 for span in spans.values()) >= 4, "four vehicles and more are followed for seconds"
    assert len(spans) <= 12

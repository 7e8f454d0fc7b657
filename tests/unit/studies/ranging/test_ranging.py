"""LiDAR ranges of detected objects on the labelled street frame; skipped where it is absent."""

import json
from pathlib import Path

import pytest

from drivemcp.errors import UserError
from studies.ranging.__main__ import WITHIN, sheet
from studies.ranging.labels import read_labels
from studies.ranging.measure import measure
from tests.shared import SHARED

FRAME, MODEL = SHARED / "data/street/fused-frame/frame.json", SHARED / "models/yolox_nano.onnx"
there = pytest.mark.skipif(
    not (FRAME.is_file() and MODEL.is_file()), reason="no labelled frame and detector at ../shared (or DRIVEMCP_SHARED)"
)


@there
def test_nine_in_ten_detected_objects_are_ranged_within_five_per_cent() -> None:
    ranged = measure(FRAME, read_labels(FRAME), MODEL, 0.3)
    by_lidar = [one for one in ranged if one.source == "lidar"]
    assert len(by_lidar) >= 4
    assert sum(abs(one.error) <= WITHIN for one in by_lidar) >= 0.9 * len(by_lidar)
    assert sum(one.track_error is not None and abs(one.track_error) <= WITHIN for one in by_lidar) >= 0.9 * len(
        by_lidar
    )
    assert any("4 of 4" in line for line in sheet(ranged).notes)


@there
def test_labels_carry_the_depth_that_the_frame_tells_and_a_nearer_surface() -> None:
    told = json.loads(FRAME.read_text())["objects_2d_front"]
    labels = read_labels(FRAME)
    assert len(labels) > 20
    assert {label.centre_m for label in labels} <= {each["depth_m"] for each in told}
    assert all(0.1 < label.centre_m - label.near_m < 8.0 for label in labels)


def test_a_frame_without_labels_is_told(tmp_path: Path) -> None:
    (tmp_path / "frame.json").write_text('{"camera": {"lidar_to_camera": [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}}')
    with pytest.raises(UserError, match="objects_3d"):
        read_labels(tmp_path / "frame.json")

"""Malformed pictures and sweeps are refused with a reason."""

import contextlib

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from proto.sensors import CameraFrame, LidarSweep
from services.perception.checks.decoding import Malformed, open_picture, open_sweep
from services.perception.detect.loading import load_detector
from services.perception.pipeline import Perception

GREEN = np.zeros((36, 64, 3), np.uint8)
GREEN[:, :, 1] = 200
JPEG = cv2.imencode(".jpg", GREEN)[1].tobytes()


def test_a_picture_opens_as_rgb() -> None:
    picture = open_picture(CameraFrame(jpeg=JPEG, width_px=64, height_px=36))
    assert picture.shape == (36, 64, 3)
    assert picture[:, :, 1].mean() > 150 > picture[:, :, 0].mean()


@pytest.mark.parametrize("jpeg", [b"", b"no jpeg", JPEG[:40], b"\xff" * 100])
def test_what_is_no_jpeg_is_refused(jpeg: bytes) -> None:
    with pytest.raises(Malformed):
        open_picture(CameraFrame(jpeg=jpeg, width_px=64, height_px=36))


@pytest.mark.parametrize("size", [(0, 36), (64, -1), (10**6, 36), (32, 36)])
def test_a_picture_of_another_size_than_said_is_refused(size: tuple[int, int]) -> None:
    with pytest.raises(Malformed):
        open_picture(CameraFrame(jpeg=JPEG, width_px=size[0], height_px=size[1]))


THIN = [(2000, 1), (1, 2000), (8192, 4), (4, 8192), (640, 2), (15, 15), (16, 257)]
"""Width and height."""


@pytest.mark.parametrize(("width_px", "height_px"), THIN)
def test_a_picture_that_no_camera_takes_is_refused_before_it_is_opened(width_px: int, height_px: int) -> None:
    jpeg = cv2.imencode(".jpg", np.zeros((height_px, width_px, 3), np.uint8))[1].tobytes()
    with pytest.raises(Malformed, match=f"said to be {width_px} x {height_px}"):
        open_picture(CameraFrame(jpeg=jpeg, width_px=width_px, height_px=height_px))


@pytest.mark.parametrize(("width_px", "height_px"), [(16, 16), (256, 16), (16, 256), (64, 36)])
def test_small_and_oblong_pictures_are_understood(width_px: int, height_px: int) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (height_px, width_px, 3), np.uint8)
    jpeg = cv2.imencode(".jpg", noise)[1].tobytes()
    perception = Perception(load_detector(data("models/detector.onnx")))
    seen = perception.see("front", 1, CameraFrame(jpeg=jpeg, width_px=width_px, height_px=height_px, frame=7))
    assert (seen.boxes.camera, seen.boxes.frame) == ("front", 7)
    assert seen.tracks is not None
    assert (seen.tracks.camera, seen.tracks.frame) == ("front", 7)


@settings(max_examples=40, deadline=None)
@given(position=st.integers(0, len(JPEG) - 1), value=st.integers(0, 255))
def test_a_changed_byte_gives_a_picture_or_a_refusal(position: int, value: int) -> None:
    broken = JPEG[:position] + bytes([value]) + JPEG[position + 1 :]
    with contextlib.suppress(Malformed):
        assert open_picture(CameraFrame(jpeg=broken, width_px=64, height_px=36)).shape == (36, 64, 3)


def test_a_sweep_opens_without_its_impossible_returns() -> None:
    rows = np.array([[1, 2, 3, 0], [np.nan, 0, 0, 0], [np.inf, 0, 0, 0], [1e9, 0, 0, 0]], "<f4")
    assert open_sweep(LidarSweep(points=rows.tobytes(), count=4)).tolist() == [[1.0, 2.0, 3.0]]


@pytest.mark.parametrize(("points", "count"), [(b"abc", 1), (b"\0" * 16, 2), (b"\0" * 32, -1)])
def test_a_sweep_whose_count_does_not_fit_is_refused(points: bytes, count: int) -> None:
    with pytest.raises(Malformed):
        open_sweep(LidarSweep(points=points, count=count))

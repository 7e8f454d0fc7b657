"""A camera whose field of view was not given: what is told of ranges holds for the camera that it may be."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from domain.cameras import FOCAL_SPREAD, assumed_calibration
from proto.sensors import Calibration
from services.perception.checks.decoding import Malformed
from services.perception.detect.detection import Detection
from services.perception.pipeline import Perception, in_doubt
from services.perception.range.box_range import find_range
from services.perception.range.camera import Camera
from services.perception.track.tracker import Tracker
from tests.unit.services.perception.support import drive
from tests.unit.services.perception.test_pipeline import Told, car_at, follow

WIDTH_PX, HEIGHT_PX = 960, 540
GUESSED = Camera.assumed(WIDTH_PX, HEIGHT_PX)


def box_at(depth_m: float, fov_deg: float, height_m: float) -> Detection:
    """The box of a car's rear straight ahead, as a level camera of this field of view sees it."""
    camera = Camera.of(assumed_calibration(WIDTH_PX, HEIGHT_PX, fov_deg))
    corners = np.array([(depth_m, y, z) for y in (-0.9, 0.9) for z in (0.0, height_m)])
    (x0, y0), (x1, y1) = (edge(camera.project(corners)[0], axis=0) for edge in (np.min, np.max))
    return Detection(x0_px=x0, y0_px=y0, x1_px=x1, y1_px=y1, kind="vehicle", score=0.9)


@given(depth_m=st.floats(8.0, 80.0), fov_deg=st.floats(40.0, 110.0), height_m=st.floats(1.4, 1.8))
def test_the_true_range_lies_within_two_sigmas_whatever_the_lens(
    depth_m: float, fov_deg: float, height_m: float
) -> None:
    found = find_range(box_at(depth_m, fov_deg, height_m), GUESSED, None)
    assert found is not None
    spread = GUESSED.calibration.focal_spread
    assert abs(found.depth_m - depth_m) <= 2.0 * math.hypot(found.sigma_m, spread * found.depth_m) + 0.1


@given(gap_m=st.floats(10.0, 80.0), closing_mps=st.floats(-2.0, 2.0), spread=st.floats(0.0, 0.99))
def test_an_error_that_all_pictures_share_is_not_averaged_away(gap_m: float, closing_mps: float, spread: float) -> None:
    tracker = Tracker()
    drive(tracker, 40, gap_m, closing_mps)
    (known,) = tracker.published()
    told = in_doubt(known, spread)
    assert told.sigma_x_m >= max(known.sigma_x_m, spread * known.x_m)
    assert told.range_spread == spread
    assert (told.x_m, told.vx_mps, told.y_m, told.sigma_y_m) == (known.x_m, known.vx_mps, known.y_m, known.sigma_y_m)


@pytest.mark.parametrize(("fov_deg", "spread"), [(0.0, FOCAL_SPREAD), (60.0, 0.0), (110.0, 0.0)])
def test_only_a_field_of_view_that_was_not_given_is_in_doubt(fov_deg: float, spread: float) -> None:
    told = assumed_calibration(WIDTH_PX, HEIGHT_PX, fov_deg)
    assert told.assumed
    assert told.focal_spread == spread
    assert 2 * math.degrees(math.atan(WIDTH_PX / 2 / told.fx_px)) == pytest.approx(fov_deg or 60.0)


@pytest.mark.parametrize("spread", [-0.1, 1.0, math.nan, math.inf])
def test_a_spread_that_cannot_be_is_refused(spread: float) -> None:
    calibration = Calibration(
        fx_px=800, fy_px=800, cx_px=480, cy_px=270, width_px=960, height_px=540, focal_spread=spread
    )
    with pytest.raises(Malformed, match="impossible numbers"):
        Perception(detector=None).calibrate("front", calibration)  # type: ignore[arg-type]


@pytest.mark.parametrize("fov_deg", [0.0, 60.0])
def test_tracks_of_a_guessed_camera_say_by_which_share_they_may_be_wrong(fov_deg: float) -> None:
    detector = Told(found=[car_at(25.0)])
    perception = Perception(detector)
    perception.calibrate("front", assumed_calibration(640, 360, fov_deg))
    seen = follow(perception, detector, 30, lidar=False)
    assert seen.tracks is not None
    (track,) = seen.tracks.tracks
    assert track.range_spread == (0.0 if fov_deg else FOCAL_SPREAD)
    assert (track.sigma_x_m > 0.25 * track.x_m) is not bool(fov_deg)
    assert set(perception.roads) == (set() if fov_deg else {"front"})

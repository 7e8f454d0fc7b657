"""The pinhole camera: intrinsics, clip matrix, culling."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from services.simulator.render.drawing.view import View
from services.simulator.scene.scene import FRONT, TELE, CameraSpec, Pose

LEVEL = CameraSpec(id="level", fov_deg=70.0)


def intrinsics(camera: CameraSpec) -> NDArray[np.float64]:
    """The 3 x 3 matrix K in pixels."""
    f = camera.focal_px
    return np.array([[f, 0.0, camera.width_px / 2], [0.0, f, camera.height_px / 2], [0.0, 0.0, 1.0]])


def test_a_point_straight_ahead_at_camera_height_falls_on_the_picture_centre() -> None:
    view = View.of(LEVEL, Pose(x_m=3.0, y_m=-2.0, yaw_rad=0.7))
    ahead = view.eye + 20 * np.array([math.cos(0.7), math.sin(0.7), 0.0])
    assert view.pixels(ahead[None])[0] == pytest.approx([320.0, 180.0])


def test_left_in_the_world_is_left_in_the_picture_and_up_is_up() -> None:
    view = View.of(LEVEL, Pose(x_m=0, y_m=0))
    left, high = view.pixels(np.array([[10.0, 1.0, LEVEL.z_m], [10.0, 0.0, LEVEL.z_m + 1.0]]))
    assert left[0] < 320
    assert high[1] < 180


def test_the_picture_edge_lies_at_half_the_field_of_view() -> None:
    view = View.of(LEVEL, Pose(x_m=-LEVEL.x_m, y_m=0))
    y = 30 * math.tan(math.radians(35))
    assert view.pixels(np.array([[30.0, y, LEVEL.z_m]]))[0, 0] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("camera", [FRONT, TELE])
def test_the_clip_matrix_agrees_with_the_pinhole_projection(camera: CameraSpec) -> None:
    view = View.of(camera, Pose(x_m=5.0, y_m=1.0, yaw_rad=-2.0))
    rng = np.random.default_rng(3)
    local = np.stack([rng.uniform(-5, 5, 40), rng.uniform(-3, 3, 40), rng.uniform(2, 200, 40)], axis=1)
    world = local @ view.axes + view.eye
    clip = np.hstack([world, np.ones((40, 1))]) @ view.clip_matrix().T
    ndc = clip[:, :2] / clip[:, 3:]
    pixels = np.stack([(ndc[:, 0] + 1) / 2 * camera.width_px, (1 - ndc[:, 1]) / 2 * camera.height_px], axis=1)
    assert pixels == pytest.approx(view.pixels(world), abs=1e-6)
    projected = local @ intrinsics(camera).T
    assert projected[:, :2] / projected[:, 2:] == pytest.approx(view.pixels(world), abs=1e-6)


def test_culling_keeps_whatever_touches_the_picture_and_drops_what_lies_behind() -> None:
    view = View.of(FRONT, Pose(x_m=0, y_m=0))
    centres = np.array([[20.0, 0.0, 1.0], [-20.0, 0.0, 1.0], [20.0, 40.0, 1.0], [20.0, 15.0, 1.0], [900.0, 0.0, 1.0]])
    seen = view.sees(centres, np.full(5, 2.0), 260.0)
    assert seen.tolist() == [True, False, False, True, False]

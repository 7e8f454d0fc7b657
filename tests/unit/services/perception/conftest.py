"""Rendered pictures for tests of the detector and of the service."""

from collections.abc import Iterator

import cv2
import numpy as np
import pytest

from proto.sensors import Calibration, CameraFrame
from services.simulator.render import Renderer, RendererUnavailable
from services.simulator.scene.scene import FRONT, Actor, Lane, Pose, Road, Scene, SignFace, SignPost, StaticWorld

GAP_M = 18.0


@pytest.fixture(scope="session")
def street() -> Iterator[np.typing.NDArray[np.uint8]]:
    """The front camera's picture of an estate car 18 m ahead, a person at the kerb and a speed limit sign."""
    line = np.array([(x, 0.0) for x in np.arange(-20.0, 200.0, 5.0)])
    static = StaticWorld(
        road=Road(
            lanes=tuple(Lane(centre_m=line + np.array([0.0, y]), left="dashed", right="edge") for y in (0.0, 3.5))
        ),
        signs=(
            SignPost(
                id=9, pose=Pose(x_m=15.0, y_m=-5.0, yaw_rad=np.pi), faces=(SignFace(country="DEU", code="limit:50"),)
            ),
        ),
    )
    car = Actor(
        id=1, kind="estate", pose=Pose(x_m=GAP_M + 2.25, y_m=0.0), length_m=4.5, width_m=1.8, height_m=1.55, look_seed=4
    )
    person = Actor(
        id=2, kind="pedestrian", pose=Pose(x_m=12.0, y_m=-2.6, yaw_rad=1.5), length_m=0.5, width_m=0.5, height_m=1.75
    )
    try:
        renderer = Renderer(static)
    except RendererUnavailable as error:
        pytest.skip(str(error))
    yield renderer.render(Scene(static=static, ego=Pose(x_m=0.0, y_m=0.0), actors=(car, person)), FRONT)
    renderer.close()


@pytest.fixture(scope="session")
def street_frame(street: np.typing.NDArray[np.uint8]) -> CameraFrame:
    """The same as a camera sends it."""
    jpeg = cv2.imencode(".jpg", cv2.cvtColor(street, cv2.COLOR_RGB2BGR))[1].tobytes()
    return CameraFrame(jpeg=jpeg, width_px=street.shape[1], height_px=street.shape[0], frame=7)


@pytest.fixture(scope="session")
def front_calibration() -> Calibration:
    """Of the camera that took it."""
    return Calibration(
        fx_px=FRONT.focal_px,
        fy_px=FRONT.focal_px,
        cx_px=FRONT.width_px / 2,
        cy_px=FRONT.height_px / 2,
        width_px=FRONT.width_px,
        height_px=FRONT.height_px,
        x_m=FRONT.x_m,
        z_m=FRONT.z_m,
        pitch_rad=FRONT.pitch_rad,
    )

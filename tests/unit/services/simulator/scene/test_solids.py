"""What stands still, as LiDAR meets it: as broad at each height as the pictures show it."""

import math

import numpy as np
import pytest

from services.simulator.scene.scene import Pose, Road, Scenery, SignFace, SignPost, StaticWorld, TrafficLight
from services.simulator.scene.solids import SIGN_POLE_M, hung, solids
from services.simulator.sensors import lidar
from services.simulator.sensors.lidar import Reals
from services.simulator.sensors.measurements import StaticBoxes

PLACE = Pose(x_m=6.0, y_m=-1.0, yaw_rad=math.pi)
POST = SignPost(id=1, pose=PLACE, faces=(SignFace(country="DEU", code="crossing"),), height_m=2.3)
NOISE = 6 * lidar.NOISE_M


def standing(static: StaticWorld, others: list[lidar.BoxOnGround] | None = None) -> Reals:
    """Returns above the ground in a stationary turn, without rain."""
    boxes = [*StaticBoxes(static).near(Pose(x_m=0.0, y_m=0.0)), *(others or [])]
    points = lidar.sweep(boxes, 0.0, np.random.default_rng(1))
    return points[points[:, 2] > 0.3]


def test_a_sign_is_a_thin_pole_with_a_face_above() -> None:
    points = standing(StaticWorld(road=Road(), signs=(POST,)))
    (face,) = hung(POST)
    low, high = points[points[:, 2] < 1.8], points[np.abs(points[:, 2] - face.z_m) < face.height_m / 2 - 0.1]
    assert len(low) >= 5
    assert np.abs(low[:, 1] - PLACE.y_m).max() < SIGN_POLE_M
    assert np.ptp(high[:, 1]) > 0.6 * face.width_m


def test_who_stands_behind_a_sign_is_seen_beside_its_pole() -> None:
    person = lidar.BoxOnGround(9.0, -1.5, 0.0, 0.5, 0.6, 1.75)
    points = standing(StaticWorld(road=Road(), signs=(POST,)), [person])
    assert (np.abs(points[:, 0] - 8.75) < NOISE).sum() > 20


def test_the_head_of_a_light_hangs_over_the_road_and_leaves_free_what_is_below() -> None:
    light = TrafficLight(id=2, pose=Pose(x_m=9.0, y_m=-4.0, yaw_rad=math.pi), height_m=2.3, arm_m=3.0)
    points = standing(StaticWorld(road=Road(), lights=(light,)))
    over = points[np.abs(points[:, 1] + 1.0) < 0.5]
    assert len(over) > 0
    assert over[:, 2].min() > 1.5


@pytest.mark.parametrize("kind", ["lamp", "post"])
def test_a_lamp_goes_up_and_a_delineator_ends_at_a_metre(kind: str) -> None:
    thing = Scenery(kind=kind, pose=PLACE)  # type: ignore[arg-type]
    points = standing(StaticWorld(road=Road(), scenery=(thing,)))
    assert np.ptp(points[:, 1]) < 0.2
    assert (points[:, 2].max() > 2.0) == (kind == "lamp")


def test_faces_hang_under_each_other_and_do_not_touch() -> None:
    two = SignPost(
        id=3, pose=PLACE, faces=(SignFace(country="DEU", code="crossing"), SignFace(country="DEU", code="stop"))
    )
    upper, lower = (each for each in solids(StaticWorld(road=Road(), signs=(two,))) if each.base_m > 0.0)
    assert 0.0 < upper.base_m - lower.top_m < 0.1

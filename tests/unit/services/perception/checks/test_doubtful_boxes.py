"""Boxes that something speaks against count for less."""

import math
from dataclasses import replace

import numpy as np
import pytest

from proto.sensors import Calibration
from services.perception.checks.doubtful_boxes import doubted, left_to_another, rides, too_tall
from services.perception.detect.detection import Detection
from services.perception.range.box_range import Range, find_range
from services.perception.range.camera import Camera


def camera(focal_px: float = 457.0, *, assumed: bool = False) -> Camera:
    calibration = Calibration(
        fx_px=focal_px, fy_px=focal_px, cx_px=320.0, cy_px=180.0, width_px=640, height_px=360, x_m=0.6, z_m=1.35,
        pitch_rad=math.radians(-2), assumed=assumed,
    )  # fmt: skip
    return Camera.of(calibration, assumed=assumed)


FRONT, TELE = camera(), camera(1100.0)


def standing(
    x_m: float, y_m: float, height_m: float, kind: str, feet_m: float = 0.0, seen_by: Camera = FRONT
) -> Detection:
    """The box of something `height_m` tall whose feet are `feet_m` above the road."""
    half = 0.9 if kind == "vehicle" else 0.3
    corners = np.array([(x_m, y_m + side, feet_m + up) for side in (-half, half) for up in (0.0, height_m)])
    pixels, _ = seen_by.project(corners)
    (x0, y0), (x1, y1) = pixels.min(axis=0).tolist(), pixels.max(axis=0).tolist()
    return Detection(x0_px=x0, y0_px=y0, x1_px=x1, y1_px=y1, kind=kind, score=0.5)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("box", "giant"),
    [
        (standing(20.0, 1.0, 1.75, "pedestrian"), False),
        (standing(40.0, -2.0, 1.9, "pedestrian"), False),
        (standing(35.0, 0.0, 4.0, "vehicle"), False),
        (standing(40.0, 1.0, 1.75, "pedestrian", feet_m=0.4), False),  # one in a hundred uphill
        (standing(110.0, 12.0, 5.0, "pedestrian"), True),  # a tree
        (standing(60.0, 0.0, 3.0, "vehicle", feet_m=6.0), True),  # a gantry
    ],
)
def test_giants_are_doubted_where_the_camera_is_calibrated(box: Detection, giant: bool) -> None:
    assert too_tall(box, FRONT) is giant
    assert not too_tall(box, camera(assumed=True)), "nobody measured how that one looks"


def test_what_the_lidar_confirms_is_never_doubted() -> None:
    tree, person = standing(110.0, 12.0, 5.0, "pedestrian"), standing(20.0, 1.0, 1.75, "pedestrian")
    seen = find_range(tree, FRONT, None)
    near = find_range(person, FRONT, None)
    assert seen is not None
    assert near is not None
    assert doubted(tree, seen, FRONT, [])
    assert doubted(person, replace(near, seen_through=True), FRONT, [])
    assert not doubted(person, near, FRONT, [])
    assert not doubted(tree, Range(depth_m=seen.depth_m, sigma_m=0.1, source="lidar"), FRONT, [TELE])


def test_what_is_tiny_here_is_left_to_a_camera_that_looks_closer() -> None:
    far, near, aside = (standing(x, y, 1.5, "vehicle") for x, y in ((70.0, 0.0), (20.0, 0.0), (70.0, 38.0)))
    for box, left in ((far, True), (near, False), (aside, False)):
        found = find_range(box, FRONT, None)
        assert found is not None
        assert left_to_another(box, found, FRONT, [TELE]) is left
        assert not left_to_another(box, found, FRONT, []), "no other camera looks"
        assert not left_to_another(box, found, FRONT, [FRONT]), "the other one sees no better"


def test_what_overflows_a_close_view_is_left_to_a_wider_one() -> None:
    lorry, person = (
        standing(9.0, 0.0, tall, kind, seen_by=TELE) for tall, kind in ((3.0, "vehicle"), (1.7, "pedestrian"))
    )
    lasered = Range(depth_m=8.4, sigma_m=0.1, source="lidar")
    assert left_to_another(lorry, lasered, TELE, [FRONT])
    assert not left_to_another(lorry, lasered, TELE, []), "nobody else looks"
    assert not left_to_another(lorry, lasered, FRONT, [TELE]), "the closer view holds even less of it"
    assert not left_to_another(person, lasered, TELE, [FRONT]), "of people every camera tells"


def test_who_rides_is_not_on_foot_as_well_and_whoever_a_vehicle_is_less_sure_of_is() -> None:
    motorcycle = replace(standing(25.0, 3.0, 1.6, "pedestrian"), kind="vehicle", score=0.96)
    rider = replace(motorcycle, kind="pedestrian", score=0.76, y0_px=motorcycle.y0_px - 2.0)
    assert rides(rider, [rider, motorcycle])
    assert not rides(motorcycle, [rider, motorcycle]), "the surer one is tracked"
    assert rides(replace(rider, score=0.99), [motorcycle]), "surely a vehicle, whatever else it looks like"
    assert not rides(rider, [replace(motorcycle, score=0.7)]), "rather a person than a vehicle"
    assert not rides(rider, [rider, replace(rider, score=0.99)]), "who stands before another person is a second one"
    before_a_car = standing(20.0, 0.0, 1.75, "pedestrian")
    assert not rides(before_a_car, [replace(standing(21.0, 0.0, 1.5, "vehicle"), score=0.99)])


def test_signs_are_no_road_users_and_not_doubted_here() -> None:
    sign = standing(60.0, 4.0, 0.7, "sign", feet_m=2.0)
    found = find_range(sign, FRONT, None)
    assert found is not None
    assert not doubted(sign, found, FRONT, [TELE])
    assert not left_to_another(sign, found, FRONT, [TELE])

"""Ranges from LiDAR, ground and size on a synthetic scene."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from proto.sensors import Calibration
from services.perception.detect.detection import Detection
from services.perception.range.box_range import (
    ProjectedSweep,
    Range,
    find_range,
    ground_range,
    hiding,
    lidar_range,
    size_range,
)
from services.perception.range.camera import Camera, Floats
from services.perception.track.road_user import EgoState
from services.perception.track.sightings import Lag, sighting_of
from services.perception.track.tracker import Tracker

CALIBRATION = Calibration(
    fx_px=457.0,
    fy_px=457.0,
    cx_px=320.0,
    cy_px=180.0,
    width_px=640,
    height_px=360,
    x_m=0.6,
    z_m=1.35,
    pitch_rad=math.radians(-2),
)
CAMERA = Camera.of(CALIBRATION)
REAR_M = 25.0


def box_of(low: tuple[float, float, float], high: tuple[float, float, float], kind: str = "vehicle") -> Detection:
    """The box around the corners of an ego-frame cuboid's near face."""
    corners = np.array([(low[0], y, z) for y in (low[1], high[1]) for z in (low[2], high[2])])
    pixels, _ = CAMERA.project(corners)
    (x0, y0), (x1, y1) = pixels.min(axis=0), pixels.max(axis=0)
    return Detection(x0_px=x0, y0_px=y0, x1_px=x1, y1_px=y1, kind=kind, score=0.9)  # type: ignore[arg-type]


CAR = box_of((REAR_M, -0.9, 0.0), (REAR_M, 0.9, 1.5))


def wall(x_m: float, half_m: float, count: int, seed: int, low_m: float = 0.3, high_m: float = 1.4) -> Floats:
    rng = np.random.default_rng(seed)
    return np.column_stack(
        [
            np.full(count, x_m) + rng.normal(0, 0.03, count),
            rng.uniform(-half_m, half_m, count),
            rng.uniform(low_m, high_m, count),
        ]
    )


def test_projection_follows_the_opencv_frame() -> None:
    pixels, depth = CAMERA.project(np.array([[20.6, 3.0, 1.35], [20.6, -3.0, 1.35]]))
    assert pixels[0, 0] < 320 < pixels[1, 0], "left of the ego is left in the picture"
    assert depth == pytest.approx([20.0 * math.cos(math.radians(2))] * 2, rel=1e-3)


def test_a_ray_through_a_projected_point_passes_through_the_point() -> None:
    point = np.array([30.0, 4.0, 0.7])
    pixels, depth = CAMERA.project(point[None])
    assert CAMERA.eye + CAMERA.ray(*pixels[0]) * depth[0] == pytest.approx(point)


def test_lidar_gives_the_near_surface_not_the_background() -> None:
    points = np.concatenate([wall(REAR_M, 0.9, 40, 0), wall(60.0, 8.0, 400, 1, 0.3, 6.0)])
    found = find_range(CAR, CAMERA, ProjectedSweep.of(points, CAMERA))
    assert found is not None
    assert found.source == "lidar"
    assert found.depth_m == pytest.approx(REAR_M - 0.6, abs=0.3)


def test_the_returns_of_a_nearer_vehicle_are_not_those_of_the_one_it_hides() -> None:
    """Two parked cars, the further one half hidden: what LiDAR gives in its box comes from the nearer one."""
    near = box_of((REAR_M, -3.7, 0.0), (REAR_M, -1.9, 1.5))
    far = box_of((40.0, -3.7, 0.0), (40.0, -1.9, 1.5))
    assert hiding(far, [near, far]) == [near]
    assert hiding(near, [near, far]) == []
    rng = np.random.default_rng(0)
    face = np.column_stack([np.full(60, REAR_M), rng.uniform(-3.7, -1.9, 60), rng.uniform(0.3, 1.4, 60)])
    sweep = ProjectedSweep.of(face, CAMERA)
    fooled, found = find_range(far, CAMERA, sweep), find_range(far, CAMERA, sweep, hiding(far, [near, far]))
    assert fooled is not None
    assert fooled.source == "lidar", "without knowing what hides it"
    assert found is not None
    assert found.source != "lidar"
    assert found.depth_m == pytest.approx(39.4, rel=0.15)


def parked(near_m: float, seed: int) -> Floats:
    """Returns of a car that stands beside our lane, its inner side 1.9 m right: of that side, and of its rear."""
    rng = np.random.default_rng(seed)
    flank = np.column_stack([rng.uniform(near_m, near_m + 4.5, 150), np.full(150, -1.9), rng.uniform(0.3, 1.4, 150)])
    rear = wall(near_m, 0.9, 60, seed) + np.array([0.0, -2.8, 0.0])
    return np.concatenate([flank, rear]) + rng.normal(0, 0.03, (210, 3))


@pytest.mark.parametrize("near_m", [2.6, 3.5, 5.0, 8.0, 15.0])
@pytest.mark.parametrize("inwards_px", [0.0, 6.0, 14.0])
def test_a_parked_car_stays_beside_the_lane_however_the_pictures_end_cuts_its_box(
    near_m: float, inwards_px: float
) -> None:
    near, far = (box_of((x, -3.7, 0.0), (x, -1.9, 1.5)) for x in (near_m, near_m + 4.5))
    begin, end = min(near.x0_px, far.x0_px), min(max(near.x1_px, far.x1_px), 640.0)
    inwards_px = min(inwards_px, 0.08 * (end - begin))
    box = replace(near, x0_px=begin, x1_px=end - inwards_px, y1_px=min(near.y1_px, 360.0))
    found = find_range(box, CAMERA, ProjectedSweep.of(parked(near_m, 5), CAMERA))
    assert found is not None
    seen = sighting_of(box, found, CAMERA, Lag())
    assert seen is not None
    assert seen.fix.place[1] == pytest.approx(-2.8, abs=0.25)


@given(st.floats(-3.0, 3.0), st.floats(0.3, 1.5), st.floats(3.0, 12.0), st.floats(1.5, 6.0), st.sampled_from([-1, 1]))
def test_a_wrong_range_moves_a_parked_car_along_and_not_aside(
    wrong_m: float, sigma_m: float, near_m: float, inner_m: float, side: int
) -> None:
    """Its returns tell how far beside us it is, however far they are: taken together it seemed to drive into our lane."""
    low, high = sorted((side * inner_m, side * (inner_m + 1.8)))
    near, far = (box_of((x, low, 0.0), (x, high, 1.5)) for x in (near_m, near_m + 4.5))
    box = replace(near, x0_px=max(min(near.x0_px, far.x0_px), 0.0), x1_px=min(max(near.x1_px, far.x1_px), 640.0))
    told = Range(depth_m=near_m - 0.6 + wrong_m, sigma_m=sigma_m, source="lidar", returns=20, sides_m=(-high, -low))
    tracker, ego = Tracker(), EgoState(speed_mps=0.0, yaw_rate_radps=0.0)
    for picture, found in enumerate((replace(told, depth_m=near_m - 0.6, sigma_m=0.1), told, told, told)):
        seen = sighting_of(box, found, CAMERA, Lag())
        assert seen is not None
        assume(abs(seen.fix.place[1] - side * (inner_m + 0.9)) < 0.05)
        tracker.step(picture * 100_000_000, [seen], ego)
    for track in tracker.tracks:
        assert abs(float(track.estimate.mean[3])) < 0.3, "it stands"


@pytest.mark.parametrize("far_m", [25.0, 40.0, 60.0])
@pytest.mark.parametrize("apart_m", [-0.1, 0.0, 0.2, 0.4])
def test_of_a_row_of_parked_cars_the_one_behind_stays_beside_the_lane_though_little_of_it_shows(
    far_m: float, apart_m: float
) -> None:
    near, whole = (box_of((x, -3.7, 0.0), (x, -1.9, 1.5)) for x in (0.75 * far_m, far_m))
    metre_px = whole.width_px / 1.8
    car = replace(whole, x1_px=near.x0_px - apart_m * metre_px)
    assert car.width_px < 0.75 * whole.width_px
    found = find_range(car, CAMERA, ProjectedSweep.of(wall(far_m, 0.2, 4, 3) + np.array([0.0, -2.1, 0.0]), CAMERA))
    assert found is not None
    assert found.source == "lidar"
    seen, alone = (sighting_of(car, found, CAMERA, Lag(), hiding(car, others)) for others in ([near], []))
    assert seen is not None
    assert alone is not None
    assert seen.fix.place[1] == pytest.approx(-2.8, abs=0.35)
    assert seen.fix.covariance[1, 1] < 0.9**2, "the side that shows tells it well"
    assert alone.fix.covariance[1, 1] > (0.8 * (1.85 - car.width_px / metre_px) / 2) ** 2, (
        "nobody knows which part shows"
    )
    assert seen.fix.covariance[1, 1] < 2.0 * alone.fix.covariance[1, 1]


@pytest.mark.parametrize("shown_px", [40.0, 90.0, 140.0])
def test_who_comes_into_the_picture_from_behind_is_vague_across(shown_px: float) -> None:
    """The box grows as he overtakes, and its inner side is not his middle: taken for sure he cut in, and was shouted about."""
    car = box_of((8.0, -4.5, 0.0), (8.0, -2.7, 1.5))
    box = replace(car, x0_px=640.0 - shown_px, x1_px=640.0)
    found = find_range(box, CAMERA, None)
    assert found is not None
    seen = sighting_of(box, found, CAMERA, Lag())
    assert seen is not None
    assert seen.fix.covariance[1, 1] > 0.9**2


def test_a_car_whose_inner_side_is_hidden_is_not_placed_by_the_returns_of_the_rest() -> None:
    car, before = box_of((20.0, -3.7, 0.0), (20.0, -1.9, 1.5)), box_of((10.0, -1.4, 0.0), (10.0, 0.4, 1.5))
    shown = wall(20.0, 0.3, 40, 6) + np.array([0.0, -3.4, 0.0])
    found = find_range(car, CAMERA, ProjectedSweep.of(shown, CAMERA), [before])
    assert found is not None
    assert found.sides_m is not None
    alone, hidden = (sighting_of(car, found, CAMERA, Lag(), hiders) for hiders in ((), (before,)))
    assert alone is not None
    assert hidden is not None
    assert abs(hidden.fix.place[1] + 2.8) < abs(alone.fix.place[1] + 2.8)


@pytest.mark.parametrize("post_m", [14.0, 20.0, 30.0, 40.0])
def test_a_post_before_a_far_car_does_not_lend_it_its_range(post_m: float) -> None:
    car = box_of((60.6, -0.9, 0.0), (60.6, 0.9, 1.5))
    points = np.concatenate([wall(post_m, 0.02, 6, 3), wall(60.6, 0.8, 4, 4)])
    found = find_range(car, CAMERA, ProjectedSweep.of(points, CAMERA))
    assert found is not None
    assert found.depth_m > 50.0, "no vehicle is so low that this box could show it at the post"


@pytest.mark.parametrize("post_m", [24.0, 30.0, 41.0])
def test_a_post_alone_before_a_lorry_beyond_the_lidars_reach_does_not_lend_it_its_range(post_m: float) -> None:
    """Its returns go on above and below the lorry's box."""
    lorry = box_of((110.0, -1.25, 0.0), (110.0, 1.25, 3.4))
    post = np.array([(post_m, 0.0, z) for z in np.arange(0.4, 2.7, post_m * 0.0135)])
    found = find_range(lorry, CAMERA, ProjectedSweep.of(post, CAMERA))
    assert found is not None
    assert found.source != "lidar"
    assert found.depth_m > post_m + 10.0


@settings(max_examples=40, deadline=None)
@given(
    near_m=st.floats(8.0, 60.0),
    aside_m=st.floats(-0.6, 0.6),
    heights_m=st.lists(st.floats(0.35, 1.3), min_size=2, max_size=8),
    half_m=st.sampled_from([0.35, 0.9]),
)
def test_a_vehicle_of_which_one_column_of_returns_came_back_is_no_post(
    near_m: float, aside_m: float, heights_m: list[float], half_m: float
) -> None:
    vehicle = box_of((near_m, -half_m, 0.0), (near_m, half_m, 1.5))
    column = np.array([(near_m, aside_m * half_m, z) for z in heights_m])
    found = find_range(vehicle, CAMERA, ProjectedSweep.of(column, CAMERA))
    assert found is not None
    assert found.source == "lidar"
    assert found.depth_m == pytest.approx(near_m - CALIBRATION.x_m, rel=0.02)


@pytest.mark.parametrize(("person_m", "before_m"), [(25, 2), (35, 2), (18, 5), (25, 5), (14, 9), (25, 9), (35, 9)])
def test_a_post_before_a_person_does_not_lend_him_its_range(person_m: float, before_m: float) -> None:
    """Else he begins anew there, and seems to walk in: his box is where he is, his range the post's.

    Nearer than that to each other and to us, no beam meets the post above or below his box.
    """
    person = box_of((person_m, -0.3, 0.0), (person_m, 0.3, 1.75), "pedestrian")
    post_m = person_m - before_m
    beams = np.tan(np.radians(np.arange(-15.0, 2.0, 0.8)))
    heights = 1.35 + post_m * beams
    post = np.array([(post_m, 0.0, z) for z in heights[(heights > 0.3) & (heights < 2.7)]])
    found = find_range(person, CAMERA, ProjectedSweep.of(post, CAMERA))
    assert found is not None
    assert found.source != "lidar"
    behind = np.concatenate([post, wall(person_m, 0.25, 8, 3)])
    found = find_range(person, CAMERA, ProjectedSweep.of(behind, CAMERA))
    assert found is not None
    assert found.source == "lidar"
    assert found.depth_m == pytest.approx(person_m - CALIBRATION.x_m, abs=0.2)


@settings(max_examples=60, deadline=None)
@given(
    near_m=st.floats(5.0, 60.0),
    aside_m=st.floats(-0.2, 0.2),
    heights_m=st.lists(st.floats(0.35, 1.6), min_size=2, max_size=8),
    behind_m=st.floats(2.0, 10.0),
)
def test_a_person_of_whom_one_column_of_returns_came_back_is_no_post(
    near_m: float, aside_m: float, heights_m: list[float], behind_m: float
) -> None:
    person = box_of((near_m, -0.3, 0.0), (near_m, 0.3, 1.75), "pedestrian")
    column = np.array([(near_m, aside_m, z) for z in heights_m])
    points = np.concatenate([column, wall(near_m + behind_m, 2.0, 10, 5, high_m=4.0)])
    found = find_range(person, CAMERA, ProjectedSweep.of(points, CAMERA))
    assert found is not None
    assert found.depth_m <= near_m


def test_a_nearer_person_is_never_put_further_away_by_what_stands_behind() -> None:
    person = box_of((15.0, -0.3, 0.0), (15.0, 0.3, 1.75), "pedestrian")
    points = np.concatenate([wall(15.0, 0.05, 4, 3), wall(18.0, 0.8, 40, 4)])
    found = find_range(person, CAMERA, ProjectedSweep.of(points, CAMERA))
    assert found is not None
    assert found.source == "lidar"
    assert found.depth_m < 15.0, "from the camera, which sits ahead of the ego's middle"


def test_single_returns_from_rain_before_the_car_do_not_count() -> None:
    drops = np.array([[6.0, 0.0, 1.2], [9.0, 0.1, 1.1], [3.0, -0.05, 1.25]])
    points = np.concatenate([drops, wall(REAR_M, 0.9, 40, 0)])
    found = find_range(CAR, CAMERA, ProjectedSweep.of(points, CAMERA))
    assert found is not None
    assert found.depth_m == pytest.approx(REAR_M - 0.6, abs=0.3)


def test_returns_of_the_road_are_left_out() -> None:
    x = np.linspace(3, 24, 300)
    road = np.column_stack([x, np.zeros(300), np.full(300, 0.05)])
    assert len(ProjectedSweep.of(road, CAMERA).depths) == 0


def test_lidar_that_contradicts_the_picture_is_not_used() -> None:
    found = find_range(CAR, CAMERA, ProjectedSweep.of(wall(4.0, 0.9, 100, 0, 0.9, 1.6), CAMERA))
    assert found is not None
    assert found.source != "lidar"


def test_a_lone_return_is_trusted_less_than_many() -> None:
    many = lidar_range(CAR, ProjectedSweep.of(wall(REAR_M, 0.5, 30, 0), CAMERA), size_range(CAR, CAMERA))
    one = lidar_range(CAR, ProjectedSweep.of(np.array([[REAR_M, 0.0, 0.8]]), CAMERA), size_range(CAR, CAMERA))
    assert many is not None
    assert one is not None
    assert one.sigma_m > 3 * many.sigma_m


@given(st.floats(10.0, 55.0), st.integers(1, 2), st.floats(0.3, 0.65), st.booleans())
def test_lone_returns_are_trusted_less_where_another_thing_may_have_given_them(
    near_m: float, count: int, shown: float, boxed: bool
) -> None:
    points = np.array([[near_m, 0.1 * k, 0.8] for k in range(count)])
    car = box_of((near_m, -0.9, 0.0), (near_m, 0.9, 1.5))
    before = box_of((near_m - 4.0, -2.5, 0.0), (near_m - 4.0, -0.7, 1.5))
    narrow = box_of((near_m, -0.9 * shown, 0.0), (near_m, 0.9 * shown, 1.5))
    sweep = ProjectedSweep.of(points, CAMERA)
    whole = find_range(car, CAMERA, sweep)
    hidden = find_range(car, CAMERA, sweep, [before]) if boxed else find_range(narrow, CAMERA, sweep)
    assert whole is not None
    assert hidden is not None
    assert (whole.source, hidden.source) == ("lidar", "lidar")
    assert hidden.sigma_m >= 2 * whole.sigma_m


def test_the_ground_range_is_right_on_a_level_road_and_doubtful_far_away() -> None:
    near, far = ground_range(CAR, CAMERA), ground_range(box_of((70.0, -0.9, 0.0), (70.0, 0.9, 1.5)), CAMERA)
    assert near is not None
    assert far is not None
    assert near.depth_m == pytest.approx(REAR_M - 0.6, rel=0.02)
    assert far.depth_m == pytest.approx(69.4, rel=0.05)
    assert far.sigma_m / far.depth_m > near.sigma_m / near.depth_m


def test_a_box_cut_off_below_has_no_ground_range() -> None:
    cut = Detection(x0_px=100, y0_px=100, x1_px=500, y1_px=360, kind="vehicle", score=0.9)
    assert ground_range(cut, CAMERA) is None
    assert find_range(cut, CAMERA, None) is not None


def test_a_lorry_is_ranged_by_the_ground_not_by_a_cars_size() -> None:
    lorry = box_of((40.0, -1.25, 0.0), (40.0, 1.25, 3.6))
    found = find_range(lorry, CAMERA, None)
    assert found is not None
    assert found.depth_m == pytest.approx(39.4, rel=0.25)


def test_a_sign_hanging_over_the_road_has_no_ground_range() -> None:
    sign = box_of((30.0, 2.0, 2.0), (30.0, 2.65, 2.65), "sign")
    assert ground_range(sign, CAMERA) is None
    found = find_range(sign, CAMERA, None)
    assert found is not None
    assert found.source == "size"
    assert found.depth_m == pytest.approx(29.4, rel=0.1)


def test_lidar_that_passes_through_a_box_to_what_lies_behind_denies_it() -> None:
    found = find_range(CAR, CAMERA, None)
    assert found is not None
    through = ProjectedSweep.of(wall(70.0, 6.0, 300, 1, 0.3, 6.0), CAMERA)
    nothing = ProjectedSweep.of(np.zeros((0, 3)), CAMERA)
    assert find_range(CAR, CAMERA, through) == replace(found, seen_through=True)
    assert find_range(CAR, CAMERA, nothing) == found, "no returns say nothing: sky behind, rain, a dark coat"
    there = find_range(CAR, CAMERA, ProjectedSweep.of(wall(REAR_M, 0.9, 40, 0), CAMERA))
    assert there is not None
    assert not there.seen_through

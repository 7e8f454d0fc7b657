"""A field of view learned from the road: on drawn roads of known cameras, and never from what is no road."""

import math

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from domain.cameras import assumed_calibration
from services.perception.range.camera import Camera, Floats
from services.perception.range.road_flow import FOCAL_SHARES, LEARNED_SPREAD, Image, RoadFlow, focal_of

WIDTH_PX, HEIGHT_PX, CAMERA_M, PERIOD_S = 640, 360, 1.4, 0.1
LEVEL = Camera.assumed(WIDTH_PX, HEIGHT_PX)


def asphalt() -> NDArray[np.uint8]:
    """120 m of a road 12 m wide, ten pixels to a metre, with grain, cracks and dashes."""
    rng = np.random.default_rng(4)
    grain = cv2.GaussianBlur(rng.normal(90, 40, (1200, 120)).astype(np.float32), (0, 0), 1.0)
    for x in (40, 80):
        for y in range(0, 1200, 60):
            grain[y : y + 20, x - 1 : x + 1] = 230
    return np.clip(grain, 0, 255).astype(np.uint8)


def pictures(fov_deg: float, pitch_deg: float, speed_mps: float, count: int) -> list[Image]:
    """What a camera sees that drives along it."""
    road, focal = asphalt(), WIDTH_PX / 2 / math.tan(math.radians(fov_deg) / 2)
    horizon = HEIGHT_PX / 2 + focal * math.tan(math.radians(pitch_deg))
    seen = []
    for number in range(count):
        z0 = (number * speed_mps * PERIOD_S) % 60.0
        near, far = 3.0, 40.0
        corners = [(x, z) for z in (near, far) for x in (-6.0, 6.0)]
        here = np.array(
            [[WIDTH_PX / 2 + focal * x / z, horizon + focal * CAMERA_M / z] for x, z in corners], np.float32
        )
        there = np.array([[10 * (x + 6), 1200 - 10 * (z + z0)] for x, z in corners], np.float32)
        shown = cv2.warpPerspective(road, cv2.getPerspectiveTransform(there, here), (WIDTH_PX, HEIGHT_PX))
        seen.append(np.repeat(np.asarray(shown, np.uint8)[:, :, None], 3, axis=2))
    return seen


@pytest.mark.parametrize(
    ("fov_deg", "pitch_deg", "speed_mps"), [(50.0, 0.0, 20.0), (70.0, -2.0, 20.0), (95.0, -4.0, 10.0)]
)
def test_field_of_view_and_pitch_are_learned_at_a_known_speed_and_the_doubt_shrinks(
    fov_deg: float, pitch_deg: float, speed_mps: float
) -> None:
    flow = RoadFlow()
    for number, picture in enumerate(pictures(fov_deg, pitch_deg, speed_mps, 80)):
        flow.learn(round(number * PERIOD_S * 1e9), picture, [], speed_mps, LEVEL)
    learned = flow.apply(LEVEL).calibration
    assert learned.fx_px == pytest.approx(assumed_calibration(WIDTH_PX, HEIGHT_PX, fov_deg).fx_px, rel=0.07)
    assert math.degrees(learned.pitch_rad) == pytest.approx(pitch_deg, abs=0.75)
    assert 0 < learned.focal_spread < LEVEL.calibration.focal_spread
    assert learned.assumed
    assert "learned from the road" in flow.told


@pytest.mark.parametrize("speed_mps", [None, 0.0, 3.0])
def test_without_a_speed_nothing_is_learned_and_the_doubt_stays(speed_mps: float | None) -> None:
    flow = RoadFlow()
    for number, picture in enumerate(pictures(95.0, 0.0, 10.0, 40)):
        flow.learn(round(number * PERIOD_S * 1e9), picture, [], speed_mps, LEVEL)
    assert flow.apply(LEVEL) is LEVEL
    assert flow.told == "60 degrees assumed, ranges to 30%"


@given(
    fov_deg=st.floats(45.0, 110.0),
    horizon=st.floats(0.35, 0.6),
    others=st.floats(0.0, 0.6),
    seed=st.integers(0, 2**32 - 1),
)
def test_most_points_decide_whatever_the_others_do(fov_deg: float, horizon: float, others: float, seed: int) -> None:
    rng, focal = np.random.default_rng(seed), WIDTH_PX / 2 / math.tan(math.radians(fov_deg) / 2)
    below = rng.uniform(0.65, 0.95, 500) * HEIGHT_PX - horizon * HEIGHT_PX
    driven_m = rng.uniform(1.0, 3.0, 500)
    before = 1 / (1 / below + driven_m / (focal * CAMERA_M))
    wrong = rng.random(500) < others
    before[wrong] = below[wrong] - np.abs(rng.normal(0, 15, wrong.sum()))
    middle_px = horizon * HEIGHT_PX
    points = np.column_stack([before + middle_px, below + middle_px, driven_m])
    found = focal_of(points, WIDTH_PX, HEIGHT_PX, CAMERA_M)
    assert found is not None
    assert abs(found.focal_px / focal - 1.0) < LEARNED_SPREAD / 2


@given(seed=st.integers(0, 2**32 - 1), move_px=st.floats(0.0, 60.0))
def test_points_that_move_at_random_teach_nothing(seed: int, move_px: float) -> None:
    rng = np.random.default_rng(seed)
    rows = rng.uniform(0.6, 0.95, 500) * HEIGHT_PX
    points: Floats = np.column_stack([rows - np.abs(rng.normal(0, move_px, 500)), rows, np.full(500, 2.0)])
    assert focal_of(points, WIDTH_PX, HEIGHT_PX, CAMERA_M) is None


@given(st.lists(st.tuples(*[st.floats(-1e6, 1e6)] * 3), max_size=50))
def test_what_is_found_is_a_lens_that_there_is(rows: list[tuple[float, float, float]]) -> None:
    points: Floats = np.array(rows, np.float64).reshape(-1, 3)
    found = focal_of(points[points[:, 2] > 0], WIDTH_PX, HEIGHT_PX, CAMERA_M)
    assert found is None or FOCAL_SHARES[0] <= found.focal_px / WIDTH_PX <= FOCAL_SHARES[1]

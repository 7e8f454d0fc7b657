"""Who steps out is known by where his box goes; who stands does not seem to."""

import math
from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from services.perception.detect.detection import Detection
from services.perception.range.box_range import Range
from services.perception.track.road_user import EgoState
from services.perception.track.sightings import Lag, sighting_of
from services.perception.track.tracker import Tracker
from tests.unit.services.perception.range.test_box_range import CAMERA, box_of

STEP_S, EGO_MPS = 0.05, 12.0
STANDING, STEPPING = 20, 8
"""Pictures: a second at the kerb, 0.4 s on the way."""
CAMERA_HALF_RAD = math.atan2(CAMERA.calibration.width_px / 2, CAMERA.calibration.fx_px)
KNOWN_S, SEEMS_MPS = 0.5, 0.4
"""A younger track's speed is a first guess; who goes faster towards the path seems to walk into it."""
JUMP_M, JUMP_PX = 0.02, 0.3
"""From picture to picture, as on rendered drives: 0.025 to 0.04 m up to 40 m."""


@given(
    far_m=st.floats(28.0, 45.0),
    side=st.sampled_from((-1.0, 1.0)),
    kerb_m=st.floats(2.5, 5.0),
    walk_mps=st.floats(1.0, 2.0),
    seed=st.integers(0, 10_000),
)
def test_soon_after_the_first_step_half_of_the_speed_is_known(
    far_m: float, side: float, kerb_m: float, walk_mps: float, seed: int
) -> None:
    tracker, chance = Tracker(), np.random.default_rng(seed)
    told = []
    for k in range(STANDING + STEPPING):
        walked_m = walk_mps * STEP_S * max(0, k - STANDING + 1)
        x_m, y_m = far_m - EGO_MPS * STEP_S * k, side * (kerb_m - walked_m)
        seen = sighting_of(
            _box(x_m, y_m, chance), Range(depth_m=x_m - 0.6, sigma_m=0.15, source="lidar"), CAMERA, Lag()
        )
        assert seen is not None
        tracker.step(round((k + 1) * STEP_S * 1e9), [seen], EgoState(EGO_MPS, 0.0))
        told.append([-side * track.vy_mps for track in tracker.published() if track.age_s >= KNOWN_S])
    assert all(abs(across) < SEEMS_MPS for published in told[:STANDING] for across in published)
    assert len(told[-1]) == 1
    assert told[-1][0] > 0.5 * walk_mps


@given(
    side=st.sampled_from((-1.0, 1.0)),
    beside_m=st.floats(2.0, 5.0),
    wide_m=st.floats(0.35, 0.8),
    ego_mps=st.floats(2.0, 14.0),
    inside_px=st.floats(0.0, 14.0),
    seed=st.integers(0, 10_000),
)
def test_who_stands_and_leaves_the_picture_as_he_is_passed_does_not_seem_to_step_in(
    side: float, beside_m: float, wide_m: float, ego_mps: float, inside_px: float, seed: int
) -> None:
    tracker, chance = Tracker(), np.random.default_rng(seed)
    width_px = CAMERA.calibration.width_px
    x_m, k = beside_m / math.tan(CAMERA_HALF_RAD) + 1.2 * ego_mps, 0
    while x_m > 1.5:
        x_m, k = x_m - STEP_S * ego_mps, k + 1
        box = _box(x_m, side * beside_m, chance, wide_m)
        low, high = max(box.x0_px, inside_px), min(box.x1_px, width_px - inside_px)
        if high - low < 6.0:
            break
        cut = replace(box, x0_px=low, x1_px=high)
        seen = sighting_of(cut, Range(depth_m=x_m - 0.6, sigma_m=0.15, source="lidar"), CAMERA, Lag())
        assert seen is not None
        tracker.step(round((k + 1) * STEP_S * 1e9), [seen], EgoState(ego_mps, 0.0))
        inwards = [-side * track.vy_mps for track in tracker.published() if track.age_s >= KNOWN_S]
        assert all(each < SEEMS_MPS for each in inwards)


def _box(x_m: float, y_m: float, chance: np.random.Generator, wide_m: float = 0.5) -> Detection:
    true = box_of((x_m, y_m - wide_m / 2, 0.0), (x_m, y_m + wide_m / 2, 1.75), "pedestrian")
    off_px = chance.normal(0.0, JUMP_PX + JUMP_M * CAMERA.calibration.fx_px / x_m)
    return replace(true, x0_px=true.x0_px + off_px, x1_px=true.x1_px + off_px)

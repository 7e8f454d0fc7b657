"""In a bend a vehicle stands askew to us: what shows of it is not what shows on a straight road."""

import math
import statistics

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.perception.detect.detection import Detection
from services.perception.range.box_range import Range
from services.perception.track.road_user import EgoState
from services.perception.track.sightings import Lag, sighting_of
from services.perception.track.tracker import Tracker
from tests.unit.services.perception.range.test_box_range import CAMERA

STEP_S, STEPS, EGO_MPS = 0.1, 12, 10.0
LENGTH_M, WIDTH_M, LANE_M = 4.5, 1.8, 3.5


def place_of(bend_m: float, aside_m: float, way_m: float) -> tuple[float, float, float]:
    """Place and direction, in the ego's frame, of who is so far along the ego's bend and aside of its line."""
    turn = way_m / bend_m
    radius = bend_m - aside_m
    return radius * math.sin(turn), bend_m - radius * math.cos(turn), turn


def seen_at(x_m: float, y_m: float, yaw_rad: float, chance: np.random.Generator) -> tuple[Detection, Range]:
    """The box around the whole body, and the depth of its nearest corner, with noise."""
    along, across = np.array([math.cos(yaw_rad), math.sin(yaw_rad)]), np.array([-math.sin(yaw_rad), math.cos(yaw_rad)])
    corners = np.array(
        [
            (*(np.array([x_m, y_m]) + k * along * LENGTH_M / 2 + j * across * WIDTH_M / 2), z)
            for k in (-1, 1) for j in (-1, 1) for z in (0.0, 1.5)
        ]
    )  # fmt: skip
    pixels, depths = CAMERA.project(corners)
    (x0, y0), (x1, y1) = pixels.min(axis=0) + chance.normal(0, 1, 2), pixels.max(axis=0) + chance.normal(0, 1, 2)
    box = Detection(x0_px=x0, y0_px=y0, x1_px=x1, y1_px=y1, kind="vehicle", score=0.9)
    return box, Range(depth_m=float(depths.min()) + chance.normal(0, 0.1), sigma_m=0.15, source="lidar", returns=5)


def told_and_shown(bend_m: float, ends_m: float, seed: int, *, oncoming: bool) -> tuple[float, float]:
    """By how much its middle is told aside of where it is, and what shows of it lies; `bend_m` is negative to the right."""
    tracker, chance = Tracker(), np.random.default_rng(seed)
    aside_m, closing_mps, y_m = LANE_M if oncoming else 0.0, EGO_MPS + 8.0 if oncoming else 2.0, 0.0
    for k in range(1, STEPS + 1):
        x_m, y_m, turn = place_of(bend_m, aside_m, ends_m + closing_mps * STEP_S * (STEPS - k))
        seen = sighting_of(*seen_at(x_m, y_m, turn, chance), CAMERA, Lag())
        assert seen is not None
        tracker.step(round(k * STEP_S * 1e9), [seen], EgoState(EGO_MPS, EGO_MPS / bend_m))
    (track,) = tracker.published()
    assert track.oncoming == oncoming
    return abs(track.y_m - y_m), abs(float(tracker.tracks[0].estimate.mean[1]) - y_m)


@given(
    bend_m=st.floats(50.0, 300.0),
    side=st.sampled_from((-1.0, 1.0)),
    oncoming=st.booleans(),
    ends_m=st.floats(15.0, 25.0),
    seed=st.integers(0, 10_000),
)
def test_in_a_bend_nobody_is_told_half_a_lane_aside_of_where_he_is(
    bend_m: float, side: float, oncoming: bool, ends_m: float, seed: int
) -> None:
    told_m, _ = told_and_shown(side * bend_m, ends_m, seed, oncoming=oncoming)
    assert told_m < 0.9


@pytest.mark.parametrize(("side", "oncoming"), [(1.0, True), (1.0, False), (-1.0, False)])
def test_there_the_middle_is_told_and_not_the_middle_of_what_shows(side: float, oncoming: bool) -> None:
    drives = [
        told_and_shown(side * bend_m, ends_m, 0, oncoming=oncoming)
        for bend_m in (50.0, 65.0, 80.0, 100.0)
        for ends_m in (16.0, 20.0, 24.0)
    ]
    told_m, shown_m = (statistics.fmean(each) for each in zip(*drives, strict=True))
    assert shown_m > 0.3
    assert told_m < 0.5 * shown_m

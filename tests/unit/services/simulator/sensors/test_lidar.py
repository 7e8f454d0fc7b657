"""The LiDAR: ranges to boxes and ground, noise, rain."""

import math

import numpy as np
import pytest

from services.simulator.sensors.lidar import HEIGHT_M, NOISE_M, BoxOnGround, sweep


def chance(seed: int = 1) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.mark.parametrize(("x", "yaw", "face"), [(20.0, 0.0, 18.0), (30.0, math.pi / 2, 29.0), (-15.0, math.pi, -13.0)])
def test_a_box_is_hit_at_its_nearest_face(x: float, yaw: float, face: float) -> None:
    points = sweep([BoxOnGround(x, 0.0, yaw, 4.0, 2.0, 1.5)], 0.0, chance())
    body = points[(np.abs(points[:, 1]) < 0.8) & (points[:, 2] > 0.3) & (points[:, 2] < 1.4)]
    assert len(body) > 10
    assert np.abs(body[:, 0] - face).max() < 6 * NOISE_M


@pytest.mark.parametrize("past_m", [-6.0, 0.0, 6.0])
def test_a_long_wall_close_by_is_there_all_along(past_m: float) -> None:
    points = sweep([BoxOnGround(past_m, 3.0, 0.0, 20.0, 1.0, 3.0)], 0.0, chance())
    body = points[points[:, 2] > 0.3]
    assert np.abs(body[:, 1] - 2.5).max() < 0.6
    assert not ((points[:, 1] > 4.0) & (np.abs(points[:, 0] - past_m) < 8.0) & (points[:, 1] < 6.0)).any()


def test_nothing_is_seen_behind_a_box_or_above_it() -> None:
    points = sweep([BoxOnGround(10.0, 0.0, 0.0, 2.0, 6.0, 3.0)], 0.0, chance())
    behind = points[(points[:, 0] > 12.0) & (np.abs(points[:, 1]) < 0.2 * points[:, 0])]
    assert len(behind) == 0


def test_the_ground_lies_flat_at_zero() -> None:
    points = sweep([], 0.0, chance())
    assert np.abs(points[:, 2]).max() < 0.1
    assert np.hypot(points[:, 0], points[:, 1]).min() > HEIGHT_M


def test_rain_drops_returns_and_scatters_some_back_close_by() -> None:
    dry, wet = sweep([], 0.0, chance()), sweep([], 18.0, chance())
    assert len(wet) < 0.97 * len(dry)
    floating = wet[wet[:, 2] > 0.3]
    assert 10 < len(floating) < 300
    assert np.median(np.linalg.norm(floating[:, :2], axis=1)) < 6.0


def test_the_same_chance_gives_the_same_sweep() -> None:
    box = [BoxOnGround(12.0, 3.0, 0.4, 4.0, 2.0, 1.5)]
    assert sweep(box, 9.0, chance(7)).tobytes() == sweep(box, 9.0, chance(7)).tobytes()

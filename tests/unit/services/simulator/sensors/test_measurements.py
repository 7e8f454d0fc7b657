"""Sensors: what they tell, and what they must not."""

import math

import msgspec
import numpy as np
import pytest

from services.simulator.scene.scene import FRONT
from services.simulator.sensors import measurements
from services.simulator.truth.snapshot import Snapshot
from services.simulator.world import World
from tests.unit.services.simulator._scenes import scenario

REST = """
[[signs]]
at_m = 60
codes = ["limit:70"]
[[stops]]
at_m = 90
[[vehicles]]
at_m = 60
speed_kmh = 70
"""


def snapshot_of(world: World, steps: int = 4) -> Snapshot:
    for _ in range(steps - 1):
        world.step()
    return world.step()


def test_the_map_gives_lanes_and_stop_lines_and_nothing_of_signs() -> None:
    world = World(scenario(rest=REST), 1)
    view = measurements.map_view(snapshot_of(world), world.route, world.lines)
    ego = next(lane for lane in view.lanes if lane.is_ego)
    nearest = min(ego.points, key=lambda point: abs(point[0]))
    assert abs(nearest[1]) < 0.1
    oncoming = next(lane for lane in view.lanes if lane.oncoming)
    assert min(oncoming.points, key=lambda point: abs(point[0]))[1] == pytest.approx(3.25, abs=0.1)
    assert view.stop_lines[0].kind == "stop_line"
    assert view.stop_lines[0].distance_m == pytest.approx(90 - world.ego.s_m, abs=0.1)
    text = msgspec.json.encode(view).decode()
    assert not any(word in text for word in ("limit", "DEU", "km/h", "mph", "right", "left"))


def test_the_lidar_finds_the_car_ahead_at_its_range() -> None:
    world = World(scenario(rest=REST), 1)
    snapshot = snapshot_of(world)
    noise, boxes = measurements.SensorNoise(1), measurements.StaticBoxes(world.static)
    sweep = measurements.lidar_sweep(snapshot, boxes, noise)
    points = np.frombuffer(sweep.points, dtype="<f4").reshape(-1, 4)
    assert len(points) == sweep.count
    ahead = points[(points[:, 0] > 5) & (np.abs(points[:, 1]) < 0.7) & (points[:, 2] > 0.4) & (points[:, 2] < 1.3)]
    lead = world.road_ahead.lead()
    assert lead is not None
    assert ahead[:, 0].min() == pytest.approx(lead[0] + snapshot.ego.length_m / 2, abs=0.25)


def test_noise_depends_on_seed_and_step_alone() -> None:
    world = World(scenario(rest=REST), 1)
    snapshot = snapshot_of(world)
    fixes = [measurements.gnss_fix(snapshot, measurements.SensorNoise(seed)) for seed in (3, 3, 4)]
    assert fixes[0] == fixes[1] != fixes[2]


def test_a_position_is_noisy_but_near() -> None:
    world, noise = World(scenario(), 1), measurements.SensorNoise(2)
    errors = []
    for _ in range(60):
        snapshot = world.step()
        fix = measurements.gnss_fix(snapshot, noise)
        errors.append(math.hypot(fix.x_m - snapshot.ego.pose.x_m, fix.y_m - snapshot.ego.pose.y_m))
    assert 0.1 < float(np.mean(errors)) < 1.5
    assert max(errors) < 3.0


def test_weather_sensing_never_tells_friction() -> None:
    world = World(scenario(rain=10), 1)
    sensed = measurements.weather_sensing(snapshot_of(world), measurements.SensorNoise(1))
    assert sensed.rain_mm_h == pytest.approx(10, rel=0.4)
    assert "mu" not in msgspec.to_builtins(sensed)


def test_wipers_and_lamps_follow_the_rain() -> None:
    stages = [
        measurements.car_controls(snapshot_of(World(scenario(rain=rain), 1))).wiper_stage for rain in (0, 1, 4, 15)
    ]
    assert stages == [0, 1, 2, 3]


def test_the_calibration_is_the_pinhole_of_the_camera() -> None:
    found = measurements.calibration(FRONT)
    half = math.degrees(math.atan2(found.width_px / 2, found.fx_px))
    assert 2 * half == pytest.approx(70.0)

"""Who moves, by LiDAR alone, against the simulator's LiDAR: standing worlds never move, who crosses does."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from proto.sensors import LidarSweep
from proto.vehicle import Ego
from services.perception.detect.detection import Detection
from services.perception.detect.detector import Picture
from services.perception.pipeline import Perception
from services.perception.track.lidar_motion import NEAR_M, LidarMotion
from services.perception.track.road_user import EgoState, Sighting
from services.simulator.scene.scene import FRONT
from services.simulator.sensors import lidar
from services.simulator.sensors.measurements import calibration
from tests.unit.services.perception.pictures import taken

SWEEP_S = 0.1
HOUSE, CAR, POST = (12.0, 9.0, 6.0), (4.5, 1.85, 1.5), (0.2, 0.2, 3.0)
Place = tuple[float, float, float, tuple[float, float, float]]
"""On the ground, in the world: x, y, heading, size."""


def seen_from(ego: tuple[float, float, float], places: Sequence[Place]) -> list[lidar.BoxOnGround]:
    x0, y0, heading = ego
    c, s = math.cos(heading), math.sin(heading)
    boxes = []
    for x, y, yaw, size in places:
        ahead, left = (x - x0) * c + (y - y0) * s, (y - y0) * c - (x - x0) * s
        boxes.append(lidar.BoxOnGround(ahead, left, yaw - heading, *size))
    return boxes


def movers(worlds: Sequence[Sequence[Place]], speed: float, yaw_rate: float, rain: float = 0.0) -> list[Sighting]:
    """All sightings while the ego drives among these places, a sweep each."""
    told: list[Sighting] = []
    watch, ego = LidarMotion(), (0.0, 0.0, 0.0)
    for number, places in enumerate(worlds):
        points = lidar.sweep(seen_from(ego, places), rain, np.random.default_rng(number))
        told += watch.step(int(number * SWEEP_S * 1e9), points.astype(np.float64), EgoState(speed, yaw_rate))
        x, y, heading = ego
        middle = heading + yaw_rate * SWEEP_S / 2
        ego = (
            x + speed * SWEEP_S * math.cos(middle),
            y + speed * SWEEP_S * math.sin(middle),
            heading + yaw_rate * SWEEP_S,
        )
    return told


def crossing(speed: float, x: float, from_y: float, sweeps: int) -> list[list[Place]]:
    return [[(x, from_y + speed * SWEEP_S * k, math.pi / 2, CAR)] for k in range(sweeps)]


standing = st.lists(
    st.tuples(
        st.floats(5.0, 60.0),
        st.floats(10.0, 40.0),
        st.booleans(),
        st.floats(0.0, 3.1),
        st.sampled_from([HOUSE, CAR, POST]),
    ),
    max_size=5,
)


@example(
    rows=[(5.0, 10.0, True, 1.75, CAR)], speed=11.0, yaw_rate=0.0, rain=0.0
)  # rays pass over it before its side shows
@example(rows=[(23.0, 21.0, False, 0.0, POST), (21.5, 21.0, False, 0.0, POST)], speed=3.0, yaw_rate=0.125, rain=0.0)
@given(
    rows=standing,
    speed=st.floats(0.0, 30.0),
    yaw_rate=st.floats(-0.2, 0.2),
    rain=st.sampled_from([0.0, 0.0, 4.0, 25.0]),
)
def test_what_stands_never_moves_however_the_ego_does(
    rows: list[tuple[float, float, bool, float, tuple[float, float, float]]], speed: float, yaw_rate: float, rain: float
) -> None:
    world: list[Place] = [(x, -y if right else y, yaw, size) for x, y, right, yaw, size in rows]
    assert movers([world] * 10, speed, yaw_rate, rain) == []


@example(speed=6.0, x=38.0, ego_mps=0.0, rain=0.0, left=True)
@given(
    speed=st.floats(6.0, 14.0),
    x=st.floats(25.0, 38.0),
    ego_mps=st.floats(0.0, 12.0),
    rain=st.sampled_from([0.0, 4.0]),
    left=st.booleans(),
)
def test_who_crosses_is_told_where_he_is(speed: float, x: float, ego_mps: float, rain: float, left: bool) -> None:
    side = 1.0 if left else -1.0
    worlds = crossing(-side * speed, x, side * 25.0, 10)
    told = movers(worlds, ego_mps, 0.0, rain)
    assert told, "a second is enough"
    for each in told:
        ahead, aside = each.fix.place.tolist()
        assert any(
            abs(ahead + ego_mps * SWEEP_S * k - (x - CAR[1] / 2)) < 0.6 and abs(aside - y) < CAR[0] / 2
            for k, ((_, y, _, _),) in enumerate(worlds)
        )
        assert each.kind == "vehicle"


@given(
    speed=st.floats(6.0, 14.0),
    x=st.floats(22.0, 38.0),
    ego_mps=st.floats(0.0, 12.0),
    yaw_rate=st.floats(-0.1, 0.1),
    rain=st.sampled_from([0.0, 4.0]),
    left=st.booleans(),
)
@example(speed=10.5, x=35.0, ego_mps=0.0, yaw_rate=0.0, rain=4.0, left=True)
@example(speed=11.9375, x=23.609375, ego_mps=11.5, yaw_rate=0.0, rain=4.0, left=True)
def test_who_crosses_is_told_with_his_velocity_over_ground(
    speed: float, x: float, ego_mps: float, yaw_rate: float, rain: float, left: bool
) -> None:
    across_mps = -speed if left else speed
    sweeps = 12 if rain == 0.0 else 20  # rain can take parts of him for a moment: mostly the same is enough, rarely not
    told = movers(crossing(across_mps, x, -2.5 * across_mps, sweeps), ego_mps, yaw_rate, rain)
    found = [each.over_ground for each in told if each.over_ground is not None]
    assert found, "a second is enough, in the rain two"
    for each in found:
        off_mps = 3 * each.sigma_mps + abs(speed * yaw_rate * sweeps * SWEEP_S)
        assert each.ahead_mps == pytest.approx(0.0, abs=off_mps)
        assert each.across_mps == pytest.approx(across_mps, abs=off_mps)


def test_who_comes_out_from_behind_a_house_is_as_fast_as_his_leading_side() -> None:
    house: Place = (18.0, -14.0, 0.0, HOUSE)
    worlds = [[house, *places] for places in crossing(8.0, 28.0, -18.0, 22)]
    found = [each.over_ground for each in movers(worlds, 0.0, 0.0) if each.over_ground is not None]
    assert found
    for each in found:
        assert each.across_mps == pytest.approx(8.0, abs=3 * each.sigma_mps)
    assert found[0].across_mps > 6.0, "its middle seems to move half as fast at first"


def test_where_two_may_have_been_it_no_velocity_is_told() -> None:
    behind = [[(28.0, y, math.pi / 2, CAR) for _, y, _, _ in places] for places in crossing(10.0, 28.0, -26.0, 12)]
    column = [[*one, *two] for one, two in zip(crossing(10.0, 28.0, -19.0, 12), behind, strict=True)]
    for each in movers(column, 0.0, 0.0):
        if each.over_ground is not None:
            assert each.over_ground.across_mps == pytest.approx(10.0, abs=3 * each.over_ground.sigma_mps)


@pytest.mark.parametrize("ego", [EgoState(None, 0.0), EgoState(10.0, None), EgoState()])
def test_with_the_egos_motion_unknown_nothing_is_told(ego: EgoState) -> None:
    watch = LidarMotion()
    for number, places in enumerate(crossing(9.0, 25.0, -30.0, 8)):
        points = lidar.sweep(seen_from((0.0, 0.0, 0.0), places), 0.0, np.random.default_rng(number))
        assert watch.step(int(number * SWEEP_S * 1e9), points.astype(np.float64), ego) == ()


def test_an_empty_sweep_and_stamps_that_jump_or_fall_back_tell_nothing() -> None:
    watch, ego = LidarMotion(), EgoState(0.0, 0.0)
    (places,) = crossing(9.0, 25.0, -20.0, 1)
    points = lidar.sweep(seen_from((0.0, 0.0, 0.0), places), 0.0, np.random.default_rng(1)).astype(np.float64)
    for stamp_ns in (0, 100_000_000, 5_000_000_000, 4_000_000_000, 4_000_000_000, 4_100_000_000):
        assert watch.step(stamp_ns, np.zeros((0, 4)), ego) == ()
        assert watch.step(stamp_ns, points, ego) == ()


class Blind:
    """A detector that sees nobody."""

    name = "blind"

    def detect(self, rgb: Picture, *, closer: bool = False) -> list[Detection]:
        return []


@pytest.mark.parametrize("take", [Perception.sweep, Perception.movers], ids=["sweep", "movers of a sweep alone"])
def test_who_comes_from_the_side_unseen_by_any_camera_is_in_the_path_before_he_is_there(
    take: Callable[[Perception, int, LidarSweep], None],
) -> None:
    perception = Perception(Blind())
    perception.calibrate("front", calibration(FRONT))
    first_y = None
    for number, places in enumerate(crossing(8.0, 18.0, -30.0, 34)):
        stamp_ns = 1_000_000_000 + int(number * SWEEP_S * 1e9)
        points = lidar.sweep(seen_from((0.0, 0.0, 0.0), places), 0.0, np.random.default_rng(number))
        perception.ego(stamp_ns, Ego(speed_mps=0.0, yaw_rate_radps=0.0))
        take(perception, stamp_ns, LidarSweep(points=points.astype("<f4").tobytes(), count=len(points)))
        tracks = perception.see("front", stamp_ns, taken()).tracks
        assert tracks is not None
        if tracks.tracks and first_y is None and tracks.tracks[0].in_ego_path:
            first_y = places[0][1]
            (track,) = tracks.tracks
            assert track.vy_mps == pytest.approx(8.0, abs=2.0)
            assert track.y_m == pytest.approx(first_y, abs=2.5)
    assert first_y is not None
    assert first_y < -15.0, "two seconds away"
    assert math.hypot(18.0, first_y) > NEAR_M

"""A junction ends a limit only where the ego turns at it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.orchestrator.signs.limits import in_force
from tests.unit.services.orchestrator.support import FEW, KMH, TICK, Drive, limit_sign

STEP_S = TICK / 1e9


def at_thirty(speed_mps: float = 10.0) -> Drive:
    drive = Drive(speed_mps=speed_mps)
    drive.tick(limit_sign("limit:30"))
    return drive


def travel(drive: Drive, way_m: float, turn_rad: float = 0.0) -> None:
    """Drive on, turning evenly; the map's junction comes nearer and is unknown once it is reached."""
    assert drive.speed_mps is not None
    count = max(1, round(way_m / (drive.speed_mps * STEP_S)))
    drive.yaw_radps = turn_rad / (count * STEP_S)
    for _ in range(count):
        if drive.junction_m is not None:
            nearer = drive.junction_m - drive.speed_mps * STEP_S
            drive.junction_m = nearer if nearer > 0.0 else None
        drive.tick()
    drive.yaw_radps = 0.0


@pytest.mark.parametrize("turn_rad", [1.57, -1.57])
@pytest.mark.parametrize("before_m", [0.0, 10.0, 16.0])
def test_a_turn_at_the_junction_ends_the_limit(before_m: float, turn_rad: float) -> None:
    drive = at_thirty()
    drive.junction_m = 20.0
    travel(drive, 10.0 + before_m)
    travel(drive, 15.0, turn_rad)
    assert in_force(drive.state.signs) == ()
    assert drive.target_mps == pytest.approx(50 * KMH)


def test_a_turn_at_the_second_of_two_junctions_ends_it() -> None:
    for apart_m in (12.0, 18.0, 20.0, 30.0):
        drive = at_thirty()
        drive.junction_m = 10.0
        travel(drive, 10.0)
        drive.junction_m = apart_m
        travel(drive, apart_m - 3.0)
        travel(drive, 12.0, 1.57)
        assert in_force(drive.state.signs) == (), apart_m


@FEW
@given(
    begun_rad=st.floats(-0.6, 0.6),
    straight_m=st.floats(30.0, 300.0),
    curve_m=st.floats(60.0, 400.0),
    curve_rad=st.floats(-2.5, 2.5),
)
def test_no_curve_behind_a_junction_ends_it(
    begun_rad: float, straight_m: float, curve_m: float, curve_rad: float
) -> None:
    drive = at_thirty()
    drive.junction_m = 12.0
    travel(drive, 16.0, begun_rad)
    travel(drive, straight_m)
    travel(drive, curve_m, curve_rad)
    assert drive.target_mps == pytest.approx(30 * KMH)


def test_a_junction_passed_straight_is_forgotten() -> None:
    passed, never = at_thirty(), at_thirty()
    passed.junction_m = 12.0
    for drive in (passed, never):
        travel(drive, 45.0, 0.3)
    assert passed.state.signs == never.state.signs


@pytest.mark.parametrize("junction_m", [8.0, -200.0, float("nan"), float("-inf")])
def test_a_junction_that_the_map_keeps_reporting_makes_no_turn_of_a_curve(junction_m: float) -> None:
    drive = at_thirty()
    for _ in range(200):
        drive.junction_m, drive.yaw_radps = junction_m, 0.2
        drive.tick()
    limit = drive.history[-1][2].fused.legal_limit
    assert limit is not None
    assert limit.mps == pytest.approx(30 * KMH)


def test_a_yaw_rate_that_drifts_while_the_ego_waits_is_no_turn() -> None:
    drive = at_thirty()
    drive.junction_m, drive.speed_mps, drive.yaw_radps = 6.0, 0.0, 0.03
    drive.ticks(600)
    assert drive.target_mps == pytest.approx(30 * KMH)


@FEW
@given(yaw_radps=st.floats(1.6, 1e300), sign=st.sampled_from([-1.0, 1.0]), count=st.integers(1, 10))
def test_a_yaw_rate_that_no_car_has_is_no_turn(yaw_radps: float, sign: float, count: int) -> None:
    drive = at_thirty()
    drive.junction_m = 10.0
    travel(drive, 2.0)
    drive.yaw_radps = sign * yaw_radps
    drive.ticks(count)
    assert len(in_force(drive.state.signs)) == 1

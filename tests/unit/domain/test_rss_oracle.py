"""Our RSS distances beside ad-rss-lib's own, over the whole range of speeds and of what is assumed."""

import warnings
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from domain.rss import Lateral, Longitudinal, lateral_m, opposite_direction_m, same_direction_m

with warnings.catch_warnings():  # its two modules register one converter each
    warnings.simplefilter("ignore", RuntimeWarning)
    pytest.importorskip("ad_rss")
    from ad_rss import physics, rss

FASTEST_MPS, FASTEST_ASIDE_MPS = 70.0, 9.0
"""The library takes no speed above 100 m/s, nor one above 10 m/s sideways."""
PRECISION_M = 1e-3
"""Of the library's distances: nearer to 0 they count as 0, and may be told a little below."""


def between(low: float, high: float) -> st.SearchStrategy[float]:
    """In steps of a thousandth: the library refuses what is nearly and not quite 0."""
    return st.integers(round(low * 1000), round(high * 1000)).map(lambda thousandths: thousandths / 1000)


speed = between(0.0, FASTEST_MPS)
aside = between(-FASTEST_ASIDE_MPS, FASTEST_ASIDE_MPS)
lead_brake = between(0.1, 12.0)


def drivers() -> st.SearchStrategy[Longitudinal]:
    return st.builds(
        Longitudinal,
        rho_s=between(0.01, 4.0),
        accel_max_mps2=between(0.0, 5.0),
        brake_min_mps2=between(0.1, 12.0),
    )


def neighbours() -> st.SearchStrategy[Lateral]:
    return st.builds(
        Lateral,
        rho_s=between(0.01, 4.0),
        accel_max_mps2=between(0.0, 3.0),
        brake_min_mps2=between(0.1, 6.0),
        fluctuation_m=between(0.0, 1.0),
    )


def vehicle(speed_mps: float = 0.0, *, aside_mps: float = 0.0) -> Any:
    """One of the library's vehicles that drives straight on, with dynamics that no distance here depends on."""
    found = rss.core.RelativeObjectState()
    found.object_type = rss.world.OtherVehicle
    state = found.structured_object_state
    state.velocity.speed_lon_min = state.velocity.speed_lon_max = physics.Speed(speed_mps)
    state.velocity.speed_lat_min = state.velocity.speed_lat_max = physics.Speed(aside_mps)
    state.is_in_correct_lane = True
    state.distance_to_enter_intersection = state.distance_to_leave_intersection = physics.Distance(0.0)
    dynamics = found.dynamics
    dynamics.response_time = physics.Duration(1.0)
    dynamics.max_speed_on_acceleration = physics.Speed(100.0)
    behaves(found, Longitudinal(rho_s=1.0, accel_max_mps2=1.0, brake_min_mps2=1.0))
    dynamics.alpha_lat.accel_max = physics.Acceleration(1.0)
    dynamics.alpha_lat.brake_min = physics.Acceleration(-1.0)
    _unstructured(found)
    return found


def _unstructured(found: Any) -> None:
    """Values off the lanes, which the library asks for and these distances do not use."""
    settings, place = found.dynamics.unstructured_settings, found.unstructured_object_state
    settings.pedestrian_turning_radius = settings.vehicle_min_radius = physics.Distance(3.5)
    settings.drive_away_max_angle = physics.Angle(2.4)
    settings.vehicle_yaw_rate_change = physics.AngularAcceleration(0.3)
    settings.vehicle_trajectory_calculation_step = physics.Duration(0.2)
    place.yaw = place.steering_angle = physics.Angle(0.0)
    place.yaw_rate = physics.AngularVelocity(0.0)
    place.dimension.length = place.dimension.width = physics.Distance(2.0)
    place.center_point.x = place.center_point.y = physics.Distance(0.0)
    place.speed_range.minimum = place.speed_range.maximum = physics.Speed(0.0)


def behaves(found: Any, who: Longitudinal, brake_max_mps2: float | None = None) -> Any:
    """With the accelerations of a driver; it brakes least in its own lane as elsewhere."""
    lon = found.dynamics.alpha_lon
    lon.accel_max = physics.Acceleration(who.accel_max_mps2)
    lon.brake_max = physics.Acceleration(-max(who.brake_min_mps2, brake_max_mps2 or 0.0))
    lon.brake_min = lon.brake_min_correct = physics.Acceleration(-who.brake_min_mps2)
    found.dynamics.response_time = physics.Duration(who.rho_s)
    return found


def sideways(who: Lateral, aside_mps: float) -> Any:
    found = vehicle(aside_mps=aside_mps)
    found.dynamics.alpha_lat.accel_max = physics.Acceleration(who.accel_max_mps2)
    found.dynamics.alpha_lat.brake_min = physics.Acceleration(-who.brake_min_mps2)
    found.dynamics.lateral_fluctuation_margin = physics.Distance(who.fluctuation_m)
    found.dynamics.response_time = physics.Duration(who.rho_s)
    return found


def asked(what: str, one: Any, other: Any) -> float:
    """The library's distance; it says itself whether it took what it was given."""
    distance = physics.Distance(0.0)
    assert getattr(rss.structured, f"calculateSafe{what}")(one, other, distance)
    return float(distance.mDistance)


@given(speed, speed, drivers(), lead_brake)
def test_same_direction_agrees_with_the_library(ego: float, lead: float, who: Longitudinal, brakes: float) -> None:
    ahead = behaves(vehicle(lead), Longitudinal(rho_s=1.0, accel_max_mps2=0.0, brake_min_mps2=brakes), brakes)
    theirs = asked("LongitudinalDistanceSameDirection", ahead, behaves(vehicle(ego), who))
    assert same_direction_m(ego, lead, who, brakes) == pytest.approx(theirs, rel=1e-9, abs=PRECISION_M)


@given(speed, speed, drivers(), drivers())
def test_opposite_direction_agrees_with_the_library(
    right: float, wrong: float, correct: Longitudinal, opposite: Longitudinal
) -> None:
    theirs = asked(
        "LongitudinalDistanceOppositeDirection",
        behaves(vehicle(right), correct),
        behaves(vehicle(wrong), opposite),
    )
    assert opposite_direction_m(right, wrong, correct, opposite) == pytest.approx(theirs, rel=1e-9, abs=PRECISION_M)


@given(aside, aside, neighbours(), neighbours())
def test_lateral_agrees_with_the_library(left: float, right: float, one: Lateral, other: Lateral) -> None:
    """Where both waver alike. Of two that differ the library takes the mean, and ours the larger."""
    alike = msgspec.structs.replace(other, fluctuation_m=one.fluctuation_m)
    theirs = asked("LateralDistance", sideways(one, left), sideways(alike, right))
    assert lateral_m(left, right, one, alike) == pytest.approx(theirs, rel=1e-9, abs=PRECISION_M)
    more = lateral_m(left, right, one, other) - asked("LateralDistance", sideways(one, left), sideways(other, right))
    assert -PRECISION_M <= more <= abs(one.fluctuation_m - other.fluctuation_m) / 2.0 + PRECISION_M

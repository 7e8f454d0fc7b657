"""RSS distances: by hand, against the reference implementation, and as properties."""

import json
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from domain.rss import (
    Lateral,
    Longitudinal,
    lateral_m,
    opposite_direction_m,
    paper_d_min_m,
    same_direction_m,
)
from tests.shared import SHARED

ORACLE = SHARED / "reference" / "rss_oracle.json"
KMH = 1.0 / 3.6
speed = st.floats(0.0, 60.0)


def follower(rho_s: float = 1.0, accel: float = 3.5, brake: float = 4.0) -> Longitudinal:
    return Longitudinal(rho_s=rho_s, accel_max_mps2=accel, brake_min_mps2=brake)


def neighbour(rho_s: float = 2.0) -> Lateral:
    return Lateral(rho_s=rho_s, accel_max_mps2=0.2, brake_min_mps2=0.8, fluctuation_m=0.1)


def oracle() -> dict[str, Any]:
    if not ORACLE.is_file():
        pytest.skip("the reference distances ../shared/reference/rss_oracle.json are not on this machine")
    loaded: dict[str, Any] = json.loads(ORACLE.read_text(encoding="utf-8"))
    return loaded


def test_behind_a_standing_car_one_reacts_accelerating_and_then_brakes() -> None:
    # 20 m/s, 1 s at +2 m/s^2: 21 m; then 22 m/s at 4 m/s^2: 484 / 8 = 60.5 m
    assert same_direction_m(20.0, 0.0, follower(accel=2.0), 8.0) == pytest.approx(81.5)


def test_the_leads_own_braking_way_is_given_back() -> None:
    # 81.5 m less 20^2 / 16 = 25 m
    assert same_direction_m(20.0, 20.0, follower(accel=2.0), 8.0) == pytest.approx(56.5)


def test_a_lead_that_gets_away_needs_no_distance() -> None:
    assert same_direction_m(0.0, 30.0, follower(), 8.0) == 0.0


def test_towards_each_other_both_stopping_ways_add_up() -> None:
    # right side: 10 m/s, 1 s, no acceleration, 5 m/s^2: 10 + 10; wrong side: 8 m/s, 2 s, 4 m/s^2: 16 + 8
    right, wrong = follower(accel=0.0, brake=5.0), follower(rho_s=2.0, accel=0.0)
    assert opposite_direction_m(10.0, 8.0, right, wrong) == pytest.approx(44.0)


def test_neighbours_at_rest_need_what_they_may_drift_and_waver() -> None:
    # each: 2 s at 0.2 m/s^2 is 0.4 m, then 0.4 m/s at 0.8 m/s^2 is 0.1 m; both, and 0.1 m of wavering
    assert lateral_m(0.0, 0.0, neighbour(), neighbour()) == pytest.approx(1.1)


def test_the_papers_distance_is_the_special_case() -> None:
    # 50 km/h on mu 0.4: 9.722 m, 24.580 m and 2 m of buffer
    assert paper_d_min_m(50 * KMH, 0.4, 0.7, 2.0) == pytest.approx(36.302, abs=5e-4)


def test_the_papers_distance_does_not_know_the_leads_speed_and_ours_does() -> None:
    wet = follower(rho_s=0.7, accel=0.0, brake=0.5 * 9.81)
    paper = paper_d_min_m(100 * KMH, 0.5, 0.7, 2.0)
    ours = same_direction_m(100 * KMH, 100 * KMH, wet, 8.0) + 2.0
    assert paper == pytest.approx(100.1, abs=0.1)
    assert ours == pytest.approx(51.9, abs=0.1)


def test_same_direction_agrees_with_the_reference() -> None:
    for row in oracle()["longitudinal_same"]:
        ours = same_direction_m(row["follow_kmh"] * KMH, row["lead_kmh"] * KMH, follower(rho_s=row["rho"]), 8.0)
        assert ours == pytest.approx(row["safe_m"], abs=1e-9), row


def test_opposite_direction_agrees_with_the_reference() -> None:
    for row in oracle()["longitudinal_opposite"]:
        right = follower(rho_s=row["rho_correct"], brake=3.0)
        wrong = follower(rho_s=row["rho_wrong"], brake=4.0)
        ours = opposite_direction_m(row["correct_kmh"] * KMH, row["wrong_kmh"] * KMH, right, wrong)
        assert ours == pytest.approx(row["safe_m"], abs=1e-9), row


def test_lateral_agrees_with_the_reference() -> None:
    for row in oracle()["lateral"]:
        who = neighbour(row["rho"])
        ours = lateral_m(row["left_kmh"] * KMH, row["right_kmh"] * KMH, who, who)
        assert ours == pytest.approx(row["safe_m"], abs=1e-9), row


def test_the_papers_distance_agrees_with_the_reference() -> None:
    for row in oracle()["paper_dmin_special_case"]:
        ours = paper_d_min_m(row["v_kmh"] * KMH, row["mu"], row["t_r"], row["d0"])
        assert ours == pytest.approx(row["safe_m"], abs=1e-9), row


@given(speed, speed, st.floats(0.5, 9.0), st.floats(0.0, 3.0))
def test_less_braking_never_shortens_the_distance(ego: float, lead: float, brake: float, less: float) -> None:
    worse = follower(brake=max(0.1, brake - less))
    assert same_direction_m(ego, lead, worse, 8.0) >= same_direction_m(ego, lead, follower(brake=brake), 8.0)


@given(speed, speed, st.floats(0.0, 20.0))
def test_more_speed_never_shortens_the_distance(ego: float, lead: float, more: float) -> None:
    assert same_direction_m(ego + more, lead, follower(), 8.0) >= same_direction_m(ego, lead, follower(), 8.0)


@given(speed, speed)
def test_a_car_at_exactly_the_distance_stops_behind_the_lead(ego: float, lead: float) -> None:
    """Both do their worst, moved in small steps: the gap never closes."""
    who = follower(rho_s=0.7)
    gap = same_direction_m(ego, lead, who, 8.0)
    step = 0.01
    time = 0.0
    while ego > 0.0 or lead > 0.0 or time < who.rho_s:
        accel = who.accel_max_mps2 if time < who.rho_s - 1e-9 else -who.brake_min_mps2
        after, lead_after = max(0.0, ego + accel * step), max(0.0, lead - 8.0 * step)
        gap += ((lead + lead_after) - (ego + after)) / 2.0 * step
        ego, lead, time = after, lead_after, time + step
        assert gap > -0.01


def test_without_brakes_no_distance_is_enough() -> None:
    assert same_direction_m(1.0, 0.0, follower(brake=0.0), 8.0) == math.inf

"""The numbers of an actor at the careful and at the reluctant end of what is known, by hand."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from domain.rss import GRAVITY_MPS2
from proto.decision import SafetyMetrics
from proto.perception import Track
from services.arbiter.assessment.assess import (
    Bounds,
    Numbers,
    View,
    act_bounds,
    each,
    gap_m,
    lateral_violation,
    measure,
    metrics,
    speak_bounds,
    worst,
)
from services.arbiter.braking.act import needed_mps2
from tests.unit.services.arbiter.support import CALIBRATED, PAPER, track

EGO_MPS, MU = 20.0, 0.5
WET = View(ego_speed_mps=EGO_MPS, ego_acceleration_mps2=0.0, h=0.1, brake_envelope=1.0, mu_low=MU, mu_high=0.6)


def view(*actors: Track, **fields: Any) -> View:
    return View(
        **{
            "ego_speed_mps": EGO_MPS, "ego_acceleration_mps2": 0.0, "actors": actors, "h": 0.1, "brake_envelope": 1.0,
            "mu_low": MU, "mu_high": 0.6, **fields,
        }
    )  # fmt: skip


def careful(actor: Track, **fields: Any) -> Numbers:
    seen = view(**fields)
    return measure(actor, seen, speak_bounds(seen, CALIBRATED), CALIBRATED)


def reluctant(actor: Track, **fields: Any) -> Numbers:
    seen = view(**fields)
    return measure(actor, seen, act_bounds(seen, CALIBRATED), CALIBRATED)


def test_what_is_not_known_is_taken_for_the_worst_before_speaking() -> None:
    assert speak_bounds(View(), CALIBRATED) == Bounds(
        mu=CALIBRATED.mu_unknown_low, envelope=CALIBRATED.envelope_unknown, h=CALIBRATED.h_unknown, following_factor=1.0, sigmas=0.0
    )  # fmt: skip
    assert speak_bounds(view(following_factor=1.4), CALIBRATED) == Bounds(
        mu=MU, envelope=1.0, h=0.1, following_factor=1.4, sigmas=0.0
    )


def test_what_is_not_known_is_taken_for_the_best_before_acting() -> None:
    assert act_bounds(View(), CALIBRATED) == Bounds(
        mu=CALIBRATED.mu_unknown_high, envelope=1.0, h=0.0, following_factor=1.0, sigmas=1.0
    )
    assert act_bounds(view(following_factor=1.4), CALIBRATED) == Bounds(
        mu=0.6, envelope=1.0, h=0.1, following_factor=1.0, sigmas=1.0
    )


@pytest.mark.parametrize("bounds", [speak_bounds, act_bounds])
def test_no_bound_is_out_of_this_world(bounds: Any) -> None:
    none_left = bounds(view(mu_low=0.0, mu_high=0.0, brake_envelope=0.0, following_factor=0.5), CALIBRATED)
    assert none_left.mu == CALIBRATED.mu_floor
    assert none_left.envelope == 0.05
    assert none_left.following_factor == 1.0
    assert bounds(view(brake_envelope=1.7), CALIBRATED).envelope == 1.0


def test_the_upper_bound_of_friction_is_never_below_the_lower_nor_above_the_best_road() -> None:
    assert act_bounds(view(mu_low=0.8, mu_high=0.6), CALIBRATED).mu == 0.8
    assert act_bounds(view(mu_high=1.4), CALIBRATED).mu == CALIBRATED.mu_unknown_high


def test_a_gap_lies_between_bumpers() -> None:
    assert gap_m(track(gap_m=15.0), CALIBRATED) == pytest.approx(15.0)
    assert gap_m(track(x_m=-20.0, length_m=8.5), CALIBRATED) == pytest.approx(
        20.0 - (8.5 + CALIBRATED.ego_length_m) / 2
    )


def test_before_speaking_the_rss_distance_is_that_of_the_worst_road_widened_by_weather() -> None:
    found = careful(track(gap_m=59.0, closing_mps=12.0), following_factor=1.5)
    # 0.7 s at +0.5 m/s^2: 14.1225 m and 20.35 m/s; 20.35^2 / (2 * 0.5 g); less 8^2 / 16 of the lead; half of 0.7 s more; 2 m
    distance_m = 14.1225 + 20.35**2 / (2 * MU * GRAVITY_MPS2) - 4.0 + 0.5 * EGO_MPS * 0.7 + 2.0
    assert found.d_min_m == pytest.approx(distance_m)
    assert found.gap_m == pytest.approx(59.0)
    assert found.closing_mps == 12.0
    assert found.rss_viol
    assert not careful(track(gap_m=distance_m + 0.01, closing_mps=12.0), following_factor=1.5).rss_viol
    assert careful(track(gap_m=distance_m - 0.01, closing_mps=12.0), following_factor=1.5).rss_viol


def test_before_acting_the_actor_is_a_sigma_farther_and_slower_in_closing() -> None:
    found = reluctant(track(gap_m=40.0, closing_mps=12.0, sigma_x_m=0.5, sigma_vx_mps=1.0), brake_envelope=0.5)
    assert found.gap_m == pytest.approx(40.5)
    assert found.closing_mps == pytest.approx(11.0)
    distance_m = 14.1225 + 20.35**2 / (2 * 0.6 * GRAVITY_MPS2 * 0.5) - 9.0**2 / 16.0 + 2.0
    assert found.d_min_m == pytest.approx(distance_m)


def test_a_range_that_is_a_guess_violates_earlier_in_speech_and_not_in_acting() -> None:
    distance_m = careful(track(gap_m=30.0)).d_min_m
    assert distance_m is not None
    guessed = track(gap_m=distance_m + 1.0, range_spread=0.1)
    assert careful(guessed).rss_viol
    assert not reluctant(guessed).rss_viol


def test_towards_somebody_who_comes_both_ways_to_a_halt_add_up() -> None:
    found = careful(track(gap_m=80.0, closing_mps=32.0, oncoming=True))
    ours = 14.1225 + 20.35**2 / (2 * MU * GRAVITY_MPS2)
    theirs = (12.0 + 12.5) / 2 * 1.0 + 12.5**2 / (2 * MU * GRAVITY_MPS2)
    assert found.d_min_m == pytest.approx(ours + theirs + 2.0)
    assert found.ttc_s == pytest.approx(80.0 / 32.0)


@pytest.mark.parametrize("kind", ["cyclist", "pedestrian"])
def test_a_person_who_comes_towards_the_ego_is_met_at_both_speeds(kind: str) -> None:
    found = careful(track(gap_m=80.0, closing_mps=25.0, kind=kind))
    ours = 14.1225 + 20.35**2 / (2 * MU * GRAVITY_MPS2)
    theirs = 5.0 * 1.0 + 5.0**2 / (2 * MU * GRAVITY_MPS2)
    assert found.d_min_m == pytest.approx(ours + theirs + 2.0)
    assert found.ttc_s == pytest.approx(80.0 / 25.0)
    braking = careful(track(gap_m=40.0, closing_mps=25.0, kind=kind), ego_acceleration_mps2=-10.0).ttc_s
    assert braking == pytest.approx(2.0 + (40.0 - 20.0 - 2.0 * 5.0) / 5.0), "at 5 m/s once the ego stands"


@given(
    kind=st.sampled_from(("cyclist", "pedestrian")), comes_mps=st.floats(0.0, 12.0), more_mps=st.floats(0.0, 3.0),
    gap_m=st.floats(0.0, 100.0), brakes_mps2=st.floats(0.0, 9.0), ax_mps2=st.floats(-4.0, 4.0),
)  # fmt: skip
def test_who_comes_faster_is_met_no_later_and_kept_no_less_far_from(
    kind: str, comes_mps: float, more_mps: float, gap_m: float, brakes_mps2: float, ax_mps2: float
) -> None:
    for seen in (careful, reluctant):
        slower, faster = (
            seen(
                track(gap_m, EGO_MPS + mps, kind=kind, ax_mps2=ax_mps2), ego_acceleration_mps2=-brakes_mps2,
            )
            for mps in (comes_mps, comes_mps + more_mps)
        )  # fmt: skip
        assert (faster.ttc_s or math.inf) <= (slower.ttc_s or math.inf) + 1e-6 or faster.ttc_s == 0.0
        assert (faster.d_min_m or 0.0) >= (slower.d_min_m or 0.0) - 1e-9
        assert needed_mps2(faster, EGO_MPS, CALIBRATED) >= needed_mps2(slower, EGO_MPS, CALIBRATED) - 1e-9


def test_a_lead_that_brakes_is_met_sooner_and_one_that_speeds_up_no_later() -> None:
    steady = careful(track(gap_m=30.0, closing_mps=10.0)).ttc_s
    assert steady == pytest.approx(3.0)
    braking = careful(track(gap_m=30.0, closing_mps=10.0, ax_mps2=-2.0)).ttc_s
    assert braking == pytest.approx(-5.0 + math.sqrt(25.0 + 30.0))
    assert careful(track(gap_m=30.0, closing_mps=10.0, ax_mps2=2.0)).ttc_s == steady


def test_ones_own_braking_counts() -> None:
    assert careful(track(gap_m=30.0, closing_mps=10.0), ego_acceleration_mps2=-2.0).ttc_s is None
    slower = careful(track(gap_m=24.0, closing_mps=10.0), ego_acceleration_mps2=-2.0).ttc_s
    assert slower == pytest.approx(5.0 - math.sqrt(25.0 - 24.0))
    assert careful(track(gap_m=30.0, closing_mps=10.0), ego_acceleration_mps2=None).ttc_s == pytest.approx(3.0)


def test_without_a_speed_of_ones_own_only_relative_motion_tells_and_no_distance_is_safe() -> None:
    found = careful(track(gap_m=30.0, closing_mps=10.0, ax_mps2=-2.0), ego_speed_mps=None)
    assert found.ttc_s == pytest.approx(-5.0 + math.sqrt(25.0 + 30.0))
    assert careful(track(gap_m=30.0, closing_mps=10.0, ax_mps2=2.0), ego_speed_mps=None).ttc_s == pytest.approx(3.0)
    assert found.d_min_m is None
    assert not found.rss_viol


def test_the_papers_profile_has_the_papers_numbers() -> None:
    found = measure(track(gap_m=30.0, closing_mps=10.0, ax_mps2=-2.0), WET, speak_bounds(WET, PAPER), PAPER)
    assert found.ttc_s == pytest.approx(3.0)
    assert found.d_min_m == pytest.approx(EGO_MPS * PAPER.t_r_s + EGO_MPS**2 / (2 * MU * GRAVITY_MPS2) + PAPER.d0_m)
    overlaps = measure(track(gap_m=-1.0, closing_mps=10.0), WET, speak_bounds(WET, PAPER), PAPER)
    assert overlaps.ttc_s == 0.0


def test_everyone_ahead_counts_who_is_more_than_noise() -> None:
    sure, floor = track(track_id=1), track(track_id=2, confidence=CALIBRATED.actor_floor)
    noise, behind = track(track_id=3, confidence=CALIBRATED.actor_floor - 1e-6), track(track_id=4, x_m=-10.0)
    beside = track(track_id=5, x_m=0.0)
    seen = view(sure, floor, noise, behind, beside)
    found = each(seen, speak_bounds(seen, CALIBRATED), CALIBRATED)
    assert [numbers.track.track_id for numbers in found] == [1, 2]


def test_the_worst_has_the_highest_risk_and_of_equals_the_nearest_and_first_told() -> None:
    def found(*actors: Track) -> int:
        numbers = worst(view(*actors), speak_bounds(WET, CALIBRATED), CALIBRATED)
        assert numbers is not None
        return numbers.track.track_id

    far, near = track(gap_m=30.0, closing_mps=10.0, track_id=1), track(gap_m=15.0, closing_mps=10.0, track_id=2)
    assert found(far, near) == 2
    apart = track(gap_m=190.0, closing_mps=0.0, track_id=3), track(gap_m=200.0, closing_mps=0.0, track_id=4)
    assert found(*apart) == found(*apart[::-1]) == 3
    twins = track(track_id=6), track(track_id=5)
    assert found(*twins) == found(*twins[::-1]) == 5
    assert worst(view(), speak_bounds(WET, CALIBRATED), CALIBRATED) is None


RESTS_M = 2 * (0.7 * 0.14 / 2 + 0.14**2 / 1.6) + 0.1
"""Two that drift 0.7 s at 0.2 m/s^2 and straighten with 0.8 m/s^2, and 0.1 m of wavering."""


def beside(aside_m: float, vy_mps: float = 0.0, **fields: Any) -> Track:
    """A car alongside, so far from the ego's flank; negative: on its right."""
    y_m = math.copysign(abs(aside_m) + (1.8 + CALIBRATED.ego_width_m) / 2, aside_m)
    return track(
        **{"x_m": 0.0, "y_m": y_m, "vx_mps": 0.0, "vy_mps": vy_mps, "width_m": 1.8, "in_ego_path": False, **fields}
    )


def violates(*tracks: Track) -> bool | None:
    return lateral_violation(tracks, EGO_MPS, CALIBRATED)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_neighbour_is_too_near_below_the_lateral_rss_distance_on_either_side(side: float) -> None:
    assert violates(beside(side * (RESTS_M - 0.001)))
    assert not violates(beside(side * (RESTS_M + 0.001)))
    assert violates(beside(side * 1.0, vy_mps=-side * 1.0))
    assert not violates(beside(side * 1.0, vy_mps=side * 1.0))


def test_a_neighbour_who_closes_in_needs_the_way_of_that_too() -> None:
    theirs = (1.0 + 1.14) / 2 * 0.7 + 1.14**2 / 1.6
    ours = 0.7 * 0.14 / 2 + 0.14**2 / 1.6
    assert violates(beside(theirs + ours + 0.1 - 0.001, vy_mps=-1.0))
    assert not violates(beside(theirs + ours + 0.1 + 0.001, vy_mps=-1.0))


def test_only_vehicles_alongside_and_out_of_the_path_are_neighbours() -> None:
    near_m = RESTS_M / 2
    assert violates(beside(near_m))
    assert not violates(beside(near_m, kind="pedestrian"))
    assert not violates(beside(near_m, in_ego_path=True))
    assert violates(beside(near_m, x_m=4.5))
    assert not violates(beside(near_m, x_m=4.6))
    assert violates(beside(3.0), beside(near_m))
    assert violates() is False
    assert lateral_violation((beside(near_m),), None, CALIBRATED) is None


def test_without_anybody_the_numbers_tell_the_car_alone() -> None:
    assert metrics(None, None, WET, CALIBRATED) == SafetyMetrics(h=0.1, r=CALIBRATED.gamma * 0.1)
    assert metrics(None, None, View(), CALIBRATED).r == pytest.approx(CALIBRATED.gamma * CALIBRATED.h_unknown)


def test_the_numbers_that_are_published_are_those_of_both_ends() -> None:
    actor = track(gap_m=15.0, closing_mps=12.0)
    speak, act = careful(actor), reluctant(actor)
    found = metrics(speak, act, WET, CALIBRATED)
    assert (found.ttc_s, found.gap_m, found.closing_mps) == (speak.ttc_s, speak.gap_m, speak.closing_mps)
    assert found.headway_s == pytest.approx(15.0 / EGO_MPS)
    assert (found.d_min_low_mu_m, found.d_min_high_mu_m) == (speak.d_min_m, act.d_min_m)
    assert (found.rss_viol_low_mu, found.rss_viol_high_mu) == (speak.rss_viol, act.rss_viol)
    assert (found.r, found.r_act, found.lead_track_id, found.h) == (speak.r, act.r, 7, 0.1)


@given(st.none() | st.floats(0.0, 0.5))
def test_who_stands_has_no_headway(ego_mps: float | None) -> None:
    stands = view(ego_speed_mps=ego_mps)
    assert metrics(careful(track()), None, stands, CALIBRATED).headway_s is None


def test_what_is_unknown_or_without_end_is_told_as_unknown() -> None:
    blind = careful(track(), ego_speed_mps=None)
    found = metrics(blind, None, WET, CALIBRATED)
    assert (found.d_min_low_mu_m, found.rss_viol_low_mu) == (None, None)
    assert (found.d_min_high_mu_m, found.rss_viol_high_mu, found.r_act) == (None, None, 0.0)
    assert metrics(careful(track()), blind, WET, CALIBRATED).rss_viol_high_mu is None

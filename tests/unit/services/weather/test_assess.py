"""The assessment of grip and sight, as behaviour."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.weather import Conditions
from services.weather.assess import assess
from services.weather.memory import DRIES_S, Memory
from services.weather.observations.observation import NS, Interval, Observation
from services.weather.road import friction
from services.weather.road.car import Car
from services.weather.road.friction import DRY
from tests.unit.services.weather.support import CLEAR, COLD, DRIVING, NOW, RAIN, WATCHED, changed, conditions

WIPING = Observation(source="car", stamp_ns=NOW, confidence=0.85, rain_mm_h=Interval(3.0, 40.0))


def test_a_clear_dry_day_leaves_speed_and_distance_alone() -> None:
    answer = conditions(CLEAR)
    assert (answer.speed_factor, answer.following_factor) == (1.0, 1.0)
    assert (answer.risk_level, answer.precipitation, answer.wet) == ("low", "none", False)
    assert answer.bounded_by == "none"
    assert answer.confidence > 0.7


def test_heavy_rain_slows_widens_and_says_why_in_metres() -> None:
    answer = conditions(RAIN, limit_mps=13.9)
    assert 0.6 < answer.speed_factor < 0.9
    assert answer.following_factor > 1.2
    assert (answer.wet, answer.precipitation, answer.bounded_by) == (True, "rain", "grip")
    assert answer.stopping_m is not None
    assert f"stopping from 50 km/h takes up to {answer.stopping_m:.0f} m" in answer.reason


def test_nothing_known_is_a_wide_careful_interval_of_no_confidence() -> None:
    answer = conditions(car=Car(), memory=Memory())
    assert answer.mu_low <= 0.3
    assert answer.mu_high >= 0.9
    assert answer.confidence == 0.0
    assert answer.risk_level == "unknown"
    assert answer.speed_factor < 0.8


def test_a_wet_road_below_freezing_counts_as_ice_but_may_be_salted() -> None:
    answer = conditions(changed(RAIN, air_c=Interval(-3.0, -2.0), road_c=Interval(-4.0, -2.0)))
    assert answer.mu_low <= 0.1
    assert answer.mu_high < 0.8
    assert answer.risk_level == "severe"


def test_a_cold_dry_road_may_carry_frost_unless_it_is_known_warmer_than_the_dew_point() -> None:
    frosty = conditions(changed(COLD, dew_point_c=Interval(-5.0, -3.5)))
    bare = conditions(changed(COLD, dew_point_c=Interval(-12.0, -11.0)))
    assert frosty.mu_low <= conditions(COLD).mu_low <= 0.2
    assert bare.mu_low == DRY.low


def test_dew_above_freezing_makes_a_road_damp() -> None:
    dewy = changed(CLEAR, road_c=Interval(6.0, 8.0), dew_point_c=Interval(7.0, 8.0))
    assert conditions(dewy).mu_low < conditions(CLEAR).mu_low


def test_snow_on_a_cold_road_is_slippery_and_hides_the_view() -> None:
    answer = conditions(changed(COLD, snow_mm_h=Interval(1.5, 2.5), visibility_m=None))
    assert answer.precipitation == "snow"
    assert answer.mu_low <= 0.2
    seen = conditions(changed(COLD, road="packed_snow"))
    assert 0.1 < seen.mu_high <= 0.45
    assert answer.visibility_m == pytest.approx(320.0)


def test_snow_that_falls_on_a_warm_road_melts() -> None:
    assert conditions(changed(CLEAR, snow_mm_h=Interval(0.5, 1.0))).mu_low > 0.4


def test_wipers_contradicting_a_dry_road_sensor_widen_the_interval_and_lower_confidence() -> None:
    agreeing, contradicting = conditions(CLEAR), conditions(CLEAR, WIPING)
    assert contradicting.mu_low < agreeing.mu_low
    assert contradicting.mu_high == agreeing.mu_high
    assert contradicting.confidence < agreeing.confidence
    assert contradicting.disagree
    assert "disagree" in contradicting.reason


def test_a_wet_road_under_soft_tyres_grips_less_at_speed_and_under_a_deep_tread_more() -> None:
    fast = Car(speed_mps=22.0, tyre_low=0.0)
    assert conditions(RAIN, car=Car(speed_mps=22.0, tyre_low=1.0)).mu_low < conditions(RAIN, car=fast).mu_low
    assert conditions(RAIN, car=Car(speed_mps=22.0, tread_mm=8.0)).mu_low > conditions(RAIN, car=fast).mu_low


def test_measured_friction_bounds_grip_and_is_remembered_for_a_while() -> None:
    slipping = Observation(source="car", stamp_ns=NOW, confidence=0.85, mu=Interval(0.3, 0.375))
    first = assess((CLEAR, slipping), DRIVING, WATCHED, NOW)
    soon = assess((changed(CLEAR, stamp_ns=NOW + 10 * NS),), DRIVING, first.memory, NOW + 10 * NS).conditions
    later = assess((changed(CLEAR, stamp_ns=NOW + 120 * NS),), DRIVING, first.memory, NOW + 120 * NS).conditions
    assert first.conditions.mu_low == pytest.approx(0.27)
    assert soon.mu_low == pytest.approx(0.27)
    assert later.mu_low == pytest.approx(DRY.low)


def test_a_road_stays_wet_after_the_rain_until_its_film_is_measured_dry() -> None:
    memory = assess((RAIN,), DRIVING, WATCHED, NOW).memory
    later = NOW + 1000 * NS
    measured = changed(CLEAR, stamp_ns=later)
    guessed = changed(measured, film_mm=None)
    assert assess((guessed,), DRIVING, memory, later).conditions.mu_low < 0.55
    assert assess((measured,), DRIVING, memory, later).conditions.mu_low == pytest.approx(DRY.low)


def after_a_puddle(film_mm: float, left_s: float) -> Conditions:
    """Half a minute of drizzle with a thin film, a second in a puddle so deep, and so long behind it."""
    drizzle = changed(RAIN, rain_mm_h=Interval(1.2, 1.8), film_mm=Interval(0.03, 0.05))
    puddle = changed(drizzle, film_mm=Interval(0.8 * film_mm, 1.2 * film_mm))
    memory, now_ns = WATCHED, NOW
    for seen, seconds in ((drizzle, 30.0), (puddle, 1.0), (drizzle, left_s)):
        for _ in range(max(1, round(2 * seconds))):
            now_ns += NS // 2
            found = assess([changed(seen, stamp_ns=now_ns)], DRIVING, memory, now_ns)
            memory = found.memory
    return found.conditions


def test_a_puddle_is_warned_of_for_a_while_behind_it_and_not_for_minutes() -> None:
    drizzle, puddle = after_a_puddle(0.04, 0.5), after_a_puddle(1.8, 0.0)
    assert puddle.speed_factor < 0.5 * drizzle.speed_factor
    assert after_a_puddle(1.8, 8.0).speed_factor < 0.7 * drizzle.speed_factor, "another may follow"
    minute = after_a_puddle(1.8, 60.0)
    assert 0.85 * drizzle.speed_factor <= minute.speed_factor < drizzle.speed_factor, "a film may lie as after rain"


@given(st.floats(0.02, 4.0), st.floats(0.0, 900.0), st.floats(0.0, 900.0))
def test_what_is_left_of_water_only_falls_and_never_below_what_a_film_of_rain_leaves(
    lay_mm: float, one_s: float, other_s: float
) -> None:
    early_s, late_s = sorted((one_s, other_s))
    lay = Memory(lay_mm=lay_mm, lay_ns=NOW)
    early_mm, late_mm = (lay.left_mm(NOW + round(gone_s * NS)) for gone_s in (early_s, late_s))
    assert late_mm <= early_mm <= lay_mm + 1e-9
    assert late_mm >= min(lay_mm, friction.UNKNOWN_FILM_MM) * math.exp(-late_s / DRIES_S) - 1e-9


def test_a_drive_that_begins_without_rain_does_not_know_yet_that_the_road_is_dry() -> None:
    rainless = changed(CLEAR, film_mm=None)
    assert conditions(rainless, memory=Memory()).mu_low < conditions(rainless).mu_low == DRY.low


def test_fog_limits_speed_by_sight_whatever_the_grip() -> None:
    answer = conditions(changed(CLEAR, visibility_m=Interval(60.0, 90.0), road_c=Interval(8.0, 9.0)), limit_mps=27.8)
    assert answer.safe_speed_mps is not None
    stop_m = answer.safe_speed_mps * 1.5 + answer.safe_speed_mps**2 / (2 * answer.mu_low * 9.81)
    assert 53.0 < stop_m <= 55.0
    assert answer.speed_factor == pytest.approx(answer.safe_speed_mps / 27.8)
    assert answer.visibility_risk == "high"
    assert answer.bounded_by == "sight"


def test_weak_brakes_lengthen_the_stop_and_lower_the_speed_for_sight() -> None:
    foggy = changed(CLEAR, visibility_m=Interval(60.0, 90.0))
    sound, weak = (conditions(foggy, car=Car(speed_mps=14.0, brake_envelope=share)) for share in (1.0, 0.5))
    assert sound.stopping_m is not None
    assert weak.stopping_m is not None
    assert weak.stopping_m > 1.3 * sound.stopping_m
    assert (weak.safe_speed_mps or 0.0) < (sound.safe_speed_mps or 0.0)
    assert weak.following_factor > sound.following_factor


def test_gusts_slow_a_car_more_on_a_slippery_road_and_on_a_bridge() -> None:
    gusts = Interval(30.0, 36.0)
    dry, bridge, wet = (
        conditions(changed(seen, gust_mps=gusts, bridge=on), limit_mps=30.0)
        for seen, on in ((CLEAR, False), (CLEAR, True), (RAIN, False))
    )
    assert dry.bounded_by == bridge.bounded_by == wet.bounded_by == "wind"
    assert 1.0 > dry.speed_factor > bridge.speed_factor
    assert dry.speed_factor > wet.speed_factor
    assert "gusts" in dry.reason


@pytest.mark.parametrize("value", [math.nan, math.inf, -5.0, 1e9])
def test_a_broken_sensor_is_unknown_and_not_dry(value: float) -> None:
    broken = changed(CLEAR, rain_mm_h=Interval(value, value), film_mm=Interval(value, value))
    assert conditions(broken).mu_low <= conditions(changed(CLEAR, rain_mm_h=None, film_mm=None)).mu_low

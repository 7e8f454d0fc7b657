"""The assessment of grip and sight, as behaviour and as properties."""

import math
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proto.weather import Conditions
from services.weather.assess import assess
from services.weather.senses import NS, Memory, Senses

NOW = 1_000 * NS
CLEAR = Senses(
    rain_mm_h=0.0,
    snow_mm_h=0.0,
    visibility_m=10_000.0,
    air_c=18.0,
    road_c=22.0,
    film_mm=0.0,
    wiper_stage=0,
    outside_c=18.0,
    speed_mps=14.0,
    fog_lamp_rear=False,
    tyre_low=0.0,
)
RAIN = msgspec.structs.replace(
    CLEAR, rain_mm_h=20.0, film_mm=0.4, visibility_m=1500.0, wiper_stage=3, air_c=12.0, road_c=12.0, outside_c=12.0
)


def conditions(senses: Senses, limit_mps: float | None = None) -> Conditions:
    return assess(senses, Memory(), NOW, limit_mps).conditions


def changed(senses: Senses, **changes: Any) -> Senses:
    return msgspec.structs.replace(senses, **changes)


def test_a_clear_dry_day_leaves_speed_and_distance_alone() -> None:
    answer = conditions(CLEAR)
    assert (answer.speed_factor, answer.following_factor) == (1.0, 1.0)
    assert (answer.risk_level, answer.precipitation, answer.wet) == ("low", "none", False)
    assert answer.confidence > 0.7


def test_heavy_rain_slows_widens_and_says_why() -> None:
    answer = conditions(RAIN, limit_mps=13.9)
    assert 0.6 < answer.speed_factor < 0.9
    assert answer.following_factor > 1.2
    assert answer.wet is True
    assert answer.precipitation == "rain"
    assert "water film" in answer.reason
    assert "stopping from 50 km/h" in answer.reason


def test_nothing_known_is_a_wide_careful_interval_of_low_confidence() -> None:
    answer = conditions(Senses())
    assert answer.mu_low <= 0.3
    assert answer.mu_high >= 0.9
    assert answer.confidence == 0.0
    assert answer.risk_level == "unknown"
    assert answer.speed_factor < 0.8


def test_a_frozen_wet_road_counts_as_ice_from_below_and_from_above() -> None:
    answer = conditions(changed(RAIN, air_c=-2.0, road_c=-3.0, outside_c=-2.0))
    assert answer.mu_low <= 0.1
    assert answer.mu_high <= 0.3
    assert answer.risk_level == "severe"


def test_wipers_contradicting_a_dry_sensor_widen_the_interval_and_lower_confidence() -> None:
    agreeing, contradicting = conditions(CLEAR), conditions(changed(CLEAR, wiper_stage=3))
    assert contradicting.mu_low < agreeing.mu_low
    assert contradicting.mu_high == agreeing.mu_high
    assert contradicting.confidence < agreeing.confidence
    assert "disagree" in contradicting.reason


def test_a_wet_road_under_soft_tyres_grips_less_at_speed() -> None:
    fast = changed(RAIN, speed_mps=22.0)
    assert conditions(changed(fast, tyre_low=1.0)).mu_low < conditions(fast).mu_low


def test_the_anti_lock_system_at_work_bounds_grip_and_is_remembered_for_a_while() -> None:
    first = assess(changed(CLEAR, abs_mu=0.3), Memory(), NOW)
    soon = assess(CLEAR, first.memory, NOW + 10 * NS).conditions
    later = assess(CLEAR, first.memory, NOW + 120 * NS).conditions
    assert first.conditions.mu_low == pytest.approx(0.27)
    assert soon.mu_low == pytest.approx(0.27)
    assert later.mu_low == pytest.approx(0.7)


def test_a_road_stays_wet_after_the_rain_until_its_film_is_measured_dry() -> None:
    memory = assess(RAIN, Memory(), NOW).memory
    later = NOW + 300 * NS
    guessed = assess(changed(CLEAR, film_mm=None), memory, later).conditions
    measured = assess(CLEAR, memory, later).conditions
    assert guessed.mu_low < 0.5
    assert measured.mu_low == pytest.approx(0.7)


def test_fog_limits_speed_by_sight_whatever_the_grip() -> None:
    answer = conditions(changed(CLEAR, visibility_m=60.0), limit_mps=27.8)
    assert answer.safe_speed_mps is not None
    stop_m = answer.safe_speed_mps * 1.5 + answer.safe_speed_mps**2 / (2 * answer.mu_low * 9.81)
    assert stop_m == pytest.approx(55.0, abs=0.1)
    assert answer.speed_factor == pytest.approx(answer.safe_speed_mps / 27.8)
    assert answer.visibility_risk == "high"


VALUES: dict[str, st.SearchStrategy[Any]] = {
    "rain_mm_h": st.floats(0, 100),
    "snow_mm_h": st.floats(0, 20),
    "visibility_m": st.floats(5, 20_000),
    "air_c": st.floats(-20, 40),
    "road_c": st.floats(-20, 50),
    "film_mm": st.floats(0, 3),
    "wiper_stage": st.integers(0, 3),
    "outside_c": st.floats(-20, 40),
    "speed_mps": st.floats(0, 55),
    "fog_lamp_rear": st.booleans(),
    "tyre_low": st.floats(0, 1),
    "abs_mu": st.none() | st.floats(0.05, 1.0),
}
SENSES = st.builds(Senses, **VALUES)
BENIGN: dict[str, Any] = {
    "rain_mm_h": 0.0,
    "snow_mm_h": 0.0,
    "film_mm": 0.0,
    "wiper_stage": 0,
    "tyre_low": 0.0,
    "abs_mu": None,
}


def no_less_careful(answer: Conditions, than: Conditions) -> None:
    assert answer.mu_low <= than.mu_low + 1e-9
    assert answer.speed_factor <= than.speed_factor + 1e-9
    assert answer.following_factor >= than.following_factor - 1e-9


@settings(max_examples=150, deadline=None)
@given(SENSES, st.sets(st.sampled_from(sorted(VALUES))))
def test_a_sense_that_falls_silent_never_makes_the_next_assessment_less_careful(senses: Senses, lost: set[str]) -> None:
    before = assess(senses, Memory(), NOW, 20.0)
    after = assess(changed(senses, **dict.fromkeys(lost)), before.memory, NOW + NS // 2, 20.0)
    no_less_careful(after.conditions, before.conditions)
    assert after.conditions.confidence <= before.conditions.confidence + 1e-9


@settings(max_examples=150, deadline=None)
@given(SENSES, st.sampled_from(["rain_mm_h", "film_mm", "tyre_low", "speed_mps"]), st.floats(0, 1))
def test_more_water_softer_tyres_and_more_speed_never_raise_the_lower_bound(
    senses: Senses, name: str, more: float
) -> None:
    worse = changed(
        senses, **{name: min(getattr(senses, name) * (1 + more) + more, 55.0 if name == "speed_mps" else 100.0)}
    )
    if name == "tyre_low":
        worse = changed(senses, tyre_low=min(1.0, (senses.tyre_low or 0.0) + more))
    assert conditions(worse).mu_low <= conditions(senses).mu_low + 1e-9


@settings(max_examples=200, deadline=None)
@given(SENSES, st.sampled_from(sorted(BENIGN)))
def test_an_unknown_sense_is_never_better_than_a_harmless_one(senses: Senses, name: str) -> None:
    harmless, unknown = changed(senses, **{name: BENIGN[name]}), changed(senses, **{name: None})
    no_less_careful(conditions(unknown, 20.0), conditions(harmless, 20.0))


@settings(max_examples=150, deadline=None)
@given(st.builds(Senses, **{name: st.none() | values for name, values in VALUES.items()}), st.none() | st.floats(1, 40))
def test_whatever_is_sensed_the_answer_keeps_its_bounds(senses: Senses, limit_mps: float | None) -> None:
    answer = conditions(senses, limit_mps)
    assert 0.0 < answer.mu_low <= answer.mu_high <= 1.0
    assert 0.0 < answer.speed_factor <= 1.0
    assert 1.0 <= answer.following_factor <= 4.0
    assert 0.0 <= answer.confidence <= 1.0


@pytest.mark.parametrize("value", [math.nan, math.inf, -5.0, 1e9])
def test_a_broken_sensor_is_unknown_and_not_dry(value: float) -> None:
    assert (
        conditions(changed(CLEAR, rain_mm_h=value, film_mm=value)).mu_low
        <= conditions(changed(CLEAR, rain_mm_h=None, film_mm=None)).mu_low
    )

"""What never makes an assessment less careful, for any sources whatever."""

from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proto.vehicle import Degradation, Indicator
from services.weather.assess import assess
from services.weather.memory import Memory
from services.weather.observations.claim import share
from services.weather.observations.observation import FIELDS, LIMITS, NS, SURE, Interval, Observation, trust
from services.weather.road.car import Car
from services.weather.senses import tyre_low
from tests.unit.services.weather.support import (
    BAD_END,
    CARS,
    CLEAR,
    DRIVING,
    MEMORIES,
    NOW,
    OBSERVATIONS,
    RAIN,
    WATCHED,
    changed,
    conditions,
    no_less_careful,
    observation,
)

Seen = tuple[Observation, ...]
LIMITS_MPS = st.none() | st.floats(1, 40)
many = settings(max_examples=30, deadline=None)


def with_one(seen: Seen, index: int, **changes: Any) -> Seen:
    return tuple(changed(each, **changes) if n == index else each for n, each in enumerate(seen))


@many
@given(OBSERVATIONS, CARS, MEMORIES, LIMITS_MPS, st.sets(st.integers(0, 3)), st.sets(st.sampled_from(FIELDS)))
def test_what_falls_silent_never_makes_the_next_assessment_less_careful(
    seen: Seen, car: Car, memory: Memory, limit: float | None, lost: set[int], fields: set[str]
) -> None:
    fresh = tuple(changed(each, stamp_ns=NOW) for each in seen)
    before = assess(fresh, car, memory, NOW, limit)
    kept = tuple(
        changed(each, **dict.fromkeys(fields)) if n in lost else each
        for n, each in enumerate(fresh)
        if n != min(lost, default=-1)
    )
    after = assess(kept, Car(speed_mps=car.speed_mps), before.memory, NOW + NS // 2, limit)
    no_less_careful(after.conditions, before.conditions)
    assert after.conditions.confidence <= before.conditions.confidence + 1e-3


@many
@given(OBSERVATIONS, CARS, MEMORIES, LIMITS_MPS, st.booleans(), st.sampled_from([1, 3, 61, 3600, 8000]))
def test_a_clock_that_falls_back_never_makes_anything_look_better(
    seen: Seen, car: Car, memory: Memory, limit: float | None, silent: bool, back_s: int
) -> None:
    then = NOW - back_s * NS
    known = assess(seen, car, memory, NOW, limit).memory
    driven = msgspec.structs.replace(car, speed_mps=None) if silent else car
    shifted = tuple(changed(each, stamp_ns=each.stamp_ns - back_s * NS) for each in seen)
    after = assess(shifted, driven, known, then, limit)
    before = assess(seen, driven, known, NOW, limit)
    no_less_careful(after.conditions, before.conditions)
    assert after.conditions.confidence <= before.conditions.confidence


@pytest.mark.parametrize("back_s", [1, 3, 3600])
@pytest.mark.parametrize("memory", [Memory(), Memory(wet_ns=NOW - 60 * NS, since_ns=NOW - 5_000 * NS)])
def test_a_road_that_may_be_wet_is_not_dry_because_the_clock_fell_back(memory: Memory, back_s: int) -> None:
    wipers_off = changed(CLEAR, film_mm=None, rain_mm_h=Interval(0.0, 0.25))
    before = assess((wipers_off,), DRIVING, memory, NOW)
    then = NOW - back_s * NS
    after = assess((changed(wipers_off, stamp_ns=then),), DRIVING, before.memory, then)
    no_less_careful(after.conditions, before.conditions)


def test_a_disagreement_is_not_over_because_the_clock_fell_back() -> None:
    assert Memory(contradiction_ns=NOW).doubted(NOW - 3600 * NS)


def test_a_fast_car_is_not_taken_for_a_slower_one_because_the_clock_fell_back() -> None:
    fast = assess((RAIN,), Car(speed_mps=45.0), WATCHED, NOW)
    then = NOW - 60 * NS
    after = assess((changed(RAIN, stamp_ns=then),), Car(), fast.memory, then)
    no_less_careful(after.conditions, fast.conditions)


def test_a_road_that_dried_before_the_clock_fell_back_dries_by_the_new_clock() -> None:
    fallen = Memory(wet_ns=NOW, since_ns=NOW).by(NOW - 3600 * NS)
    assert fallen.drying(NOW - 3600 * NS)
    assert not fallen.drying(NOW)


@many
@given(OBSERVATIONS, CARS, MEMORIES, LIMITS_MPS, st.integers(0, 3), st.floats(0, 1))
def test_a_source_that_is_less_sure_never_makes_anything_look_better(
    seen: Seen, car: Car, memory: Memory, limit: float | None, index: int, less: float
) -> None:
    unsure = tuple(
        changed(each, confidence=each.confidence * less) if n == index else each for n, each in enumerate(seen)
    )
    answer, before = (conditions(*each, car=car, memory=memory, limit_mps=limit) for each in (unsure, seen))
    no_less_careful(answer, before)
    assert answer.mu_high >= before.mu_high - 1e-9


@many
@given(OBSERVATIONS, CARS, MEMORIES, LIMITS_MPS, st.integers(0, 3), st.integers(0, 7200))
def test_an_older_observation_never_makes_anything_look_better(
    seen: Seen, car: Car, memory: Memory, limit: float | None, index: int, age_s: int
) -> None:
    older = tuple(
        changed(each, stamp_ns=each.stamp_ns - age_s * NS) if n == index else each for n, each in enumerate(seen)
    )
    answer, before = (conditions(*each, car=car, memory=memory, limit_mps=limit) for each in (older, seen))
    no_less_careful(answer, before)
    assert answer.mu_high >= before.mu_high - 1e-9


@many
@given(OBSERVATIONS, CARS, MEMORIES, LIMITS_MPS, observation("another"))
def test_another_source_that_is_unsure_never_makes_anything_look_better(
    seen: Seen, car: Car, memory: Memory, limit: float | None, another: Observation
) -> None:
    unsure = changed(another, confidence=min(another.confidence, SURE))
    answer = conditions(*seen, unsure, car=car, memory=memory, limit_mps=limit)
    no_less_careful(answer, conditions(*seen, car=car, memory=memory, limit_mps=limit))


def worse(seen: Observation, by: float) -> Observation:
    """The same with every bad end worse, or as it is where nothing is worse."""
    changes: dict[str, Any] = {}
    for name, limits in LIMITS.items():
        value = getattr(seen, name)
        if value is None or name == "humidity":
            continue
        low, high = value
        if BAD_END.get(name) == "low":
            changes[name] = Interval(low - by * (low - limits.low), high - by * (high - limits.low))
        else:
            changes[name] = Interval(
                low + by * (min(60.0, limits.high) - low), high + by * (max(high, min(60.0, limits.high)) - high)
            )
    return msgspec.structs.replace(seen, **changes)


@many
@given(OBSERVATIONS, CARS, MEMORIES, LIMITS_MPS, st.data(), st.floats(0, 0.5))
def test_one_more_source_that_sees_it_worse_never_makes_anything_look_better(
    seen: Seen, car: Car, memory: Memory, limit: float | None, data: st.DataObject, by: float
) -> None:
    like = data.draw(st.sampled_from(seen)) if seen else CLEAR
    another = changed(worse(like, by), source="another") if seen else changed(RAIN, source="another", confidence=0.4)
    answer = conditions(*seen, another, car=car, memory=memory, limit_mps=limit)
    no_less_careful(answer, conditions(*seen, car=car, memory=memory, limit_mps=limit))


DRIEST = Interval(low=-60.0, high=-60.0)
"""A dew point so low that no road takes on frost. Who says nothing of it reassures less than a source that is believed and does."""


@many
@given(OBSERVATIONS, CARS, observation("liar"))
def test_a_source_that_sees_nothing_bad_never_lifts_grip_above_what_another_warns_of(
    seen: Seen, car: Car, liar: Observation
) -> None:
    fields = {name: getattr(CLEAR, name) for name in LIMITS} | {"dew_point_c": DRIEST}
    rosy = changed(liar, **fields, road="dry", confidence=1.0, stamp_ns=NOW)
    warned = conditions(*(changed(each, confidence=0.0) for each in seen), rosy, car=car)
    assert conditions(*seen, rosy, car=car).mu_low <= warned.mu_low + 1e-9


@many
@given(OBSERVATIONS, CARS, st.sampled_from(["tyre_low", "speed_mps", "brake_envelope"]), st.floats(0, 1))
def test_softer_tyres_more_speed_and_weaker_brakes_never_look_better(
    seen: Seen, car: Car, name: str, more: float
) -> None:
    full = msgspec.structs.replace(car, speed_mps=car.speed, tyre_low=car.tyre_low or 0.0, brake_envelope=car.brakes)
    value = getattr(full, name)
    changes = {"tyre_low": min(1.0, value + more), "speed_mps": value + 20.0 * more, "brake_envelope": value * more}
    harder = msgspec.structs.replace(full, **{name: changes[name]})
    no_less_careful(conditions(*seen, car=harder, limit_mps=20.0), conditions(*seen, car=full, limit_mps=20.0))


TYRES = tuple(f"tyre_pressure_low_{wheel}" for wheel in ("fl", "fr", "rl", "rr"))
SOFT = st.dictionaries(st.sampled_from(TYRES), st.floats(0, 1))


def health(soft: dict[str, float], silent: set[str]) -> Degradation:
    indicators = tuple(Indicator(name=name, value=each, weight=0.6, source="can") for name, each in soft.items())
    return Degradation(indicators=indicators, unknown=tuple(sorted(silent)))


@many
@given(OBSERVATIONS, SOFT, st.sets(st.sampled_from(TYRES)), st.booleans(), st.floats(0, 55), st.data())
def test_one_more_silent_tyre_sensor_never_raises_the_grip_that_is_counted_on(
    seen: Seen, soft: dict[str, float], silent: set[str], forgotten: bool, speed_mps: float, data: st.DataObject
) -> None:
    name = data.draw(st.sampled_from(TYRES))
    before = Car(speed_mps=speed_mps, tyre_low=tyre_low(health(soft, silent), None))
    left = {each: value for each, value in soft.items() if not (forgotten and each == name)}
    after = Car(speed_mps=speed_mps, tyre_low=tyre_low(health(left, silent | {name}), before.tyre_low))
    no_less_careful(conditions(*seen, car=after), conditions(*seen, car=before))


@given(SOFT, st.sets(st.sampled_from(TYRES)), st.none() | st.floats(0, 1))
def test_a_tyre_known_to_be_soft_counts_whichever_others_are_silent(
    soft: dict[str, float], silent: set[str], before: float | None
) -> None:
    assert tyre_low(health(soft, silent), before) >= max(soft.values(), default=0.0)


def test_tyres_that_all_read_well_again_are_no_longer_soft() -> None:
    assert tyre_low(health({}, set()), 0.8) == 0.0


HARMLESS: dict[str, Any] = {name: getattr(CLEAR, name) for name in ("rain_mm_h", "snow_mm_h", "film_mm", "road_c")}


@many
@given(OBSERVATIONS, CARS, MEMORIES, st.sampled_from(sorted(HARMLESS)), st.integers(0, 3))
def test_an_unknown_field_is_never_better_than_a_harmless_one(
    seen: Seen, car: Car, memory: Memory, name: str, index: int
) -> None:
    harmless, unknown = (with_one(seen, index, **{name: value}) for value in (HARMLESS[name], None))
    if name == "road_c":
        harmless = with_one(harmless, index, dew_point_c=None)
        unknown = with_one(unknown, index, dew_point_c=None)
    no_less_careful(
        conditions(*unknown, car=car, memory=memory, limit_mps=20.0),
        conditions(*harmless, car=car, memory=memory, limit_mps=20.0),
    )


@many
@given(OBSERVATIONS, CARS, MEMORIES, LIMITS_MPS)
def test_whatever_is_seen_the_answer_keeps_its_bounds(
    seen: Seen, car: Car, memory: Memory, limit: float | None
) -> None:
    answer = conditions(*seen, car=car, memory=memory, limit_mps=limit)
    assert 0.0 < answer.mu_low <= answer.mu_high <= 1.0
    assert 0.0 < answer.speed_factor <= 1.0
    assert 1.0 <= answer.following_factor <= 4.0
    assert 0.0 <= answer.confidence <= 1.0


def test_a_wrong_clock_and_old_age_leave_a_source_without_reassurance() -> None:
    ahead = changed(CLEAR, stamp_ns=NOW + 60 * NS)
    old = changed(CLEAR, stamp_ns=NOW - 3600 * NS)
    assert trust(ahead, NOW) == 0.0
    assert share(trust(old, NOW)) == 0.0
    assert conditions(ahead).mu_low == conditions(old).mu_low <= 0.3


def test_of_two_sure_sources_the_worse_one_counts() -> None:
    assert conditions(CLEAR, changed(RAIN, source="camera")).mu_low == pytest.approx(conditions(RAIN).mu_low, abs=0.02)

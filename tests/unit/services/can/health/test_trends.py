"""Trends before the lamp: a leak is told in time, sound drives tell nothing, warmth and weather are no leak."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from services.can.health.ratios import TYRES
from services.can.health.trends import QUIET_S, RULES, Trends, compensated, in_words, judged, theil_sen
from studies.trends.drives import NOMINAL_BAR, Leak, drive, in_time

NS = 1_000_000_000
BATTERY = next(rule for rule in RULES if rule.name == "battery_sinking")


@pytest.mark.parametrize("seed", range(3))
def test_a_sound_drive_of_half_an_hour_announces_nothing(seed: int) -> None:
    assert drive(seed).trend is None


@pytest.mark.parametrize(("wheel", "bar_per_min"), [(0, 0.03), (3, 0.1)])
def test_a_leak_is_told_before_its_lamp(wheel: int, bar_per_min: float) -> None:
    leak = Leak(wheel, bar_per_min, 120.0)
    outcome = drive(70 + wheel, leak, 60.0)
    assert in_time(leak, outcome)
    assert outcome.trend is not None
    assert outcome.trend.minutes_low <= outcome.trend.minutes_left


@given(st.floats(-1.0, 1.0), st.floats(-50.0, 50.0), st.integers(12, 40))
@settings(max_examples=50, deadline=None)
def test_the_slope_of_a_line_is_its_slope_whatever_single_errors_there_are(
    slope: float, start: float, count: int
) -> None:
    points = [(float(t), start + slope * t) for t in range(count)]
    points[count // 2] = (float(count // 2), 1e6)
    found = theil_sen(points)
    assert found is not None
    assert found.middle == pytest.approx(slope, abs=1e-6)
    assert found.low <= found.middle <= found.high


@given(st.floats(-20.0, 60.0), st.floats(-20.0, 60.0))
def test_warmth_of_one_tyre_and_weather_of_all_are_taken_out(all_c: float, one_c: float) -> None:
    def at(celsius: float, bar: float) -> float:
        return (bar + 1.013) * (273.15 + celsius) / 293.15 - 1.013

    temperatures = [all_c, all_c, all_c, one_c]
    values: dict[str, float | None] = {}
    for name, bar, celsius in zip(TYRES, NOMINAL_BAR, temperatures, strict=True):
        values[name] = at(celsius, bar)
        values[name.replace("pressure", "temperature").replace("_bar", "_c")] = celsius
    assert all(share == pytest.approx(1.0, abs=1e-6) for share in compensated(values, NOMINAL_BAR).values())


def test_fewer_than_three_tyres_tell_of_no_leak() -> None:
    assert set(compensated({TYRES[0]: 2.0, TYRES[1]: 2.4}, NOMINAL_BAR).values()) == {None}


def sinking(volts_per_min: float) -> list[tuple[float, float]]:
    rng = random.Random(1)
    return [(10.0 * i, 13.0 + volts_per_min * i / 6.0 + rng.gauss(0.0, 0.03)) for i in range(40)]


def test_minutes_left_are_the_way_to_the_threshold_by_the_slope() -> None:
    points = sinking(-0.1)
    trend = judged(BATTERY, points)
    assert trend is not None
    assert trend.minutes_left == pytest.approx((trend.value - 12.0) / 0.1, rel=0.1)


@given(st.floats(0.06, 0.3), st.floats(1.0, 2.0))
@settings(max_examples=30, deadline=None)
def test_a_steeper_trend_leaves_no_more_minutes(volts_per_min: float, steeper: float) -> None:
    slow, fast = judged(BATTERY, sinking(-volts_per_min)), judged(BATTERY, sinking(-volts_per_min * steeper))
    assert fast is not None
    assert slow is None or fast.minutes_left <= slow.minutes_left + 1e-6


def test_an_announced_trend_stays_for_a_while_after_it_was_last_seen() -> None:
    trends, rng = Trends(NOMINAL_BAR), random.Random(2)
    seen_s, last_s = 0, 0
    for second in range(0, 2400, 5):
        volts = max(12.4, 13.1 - 0.1 * second / 60.0) if second < 420 else 14.2
        trends.step({"battery_voltage_v": volts + rng.gauss(0.0, 0.03)}, second * NS + 1)
        if trends.found:
            seen_s, last_s = seen_s or second, second
    assert 0 < seen_s < 420
    assert last_s >= 420 + QUIET_S - 30
    assert trends.found == ()


@pytest.mark.parametrize("language", ["en", "de", "fr", "nl", "pl", "it", "es"])
@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.name)
def test_every_trend_has_words(rule: object, language: str) -> None:
    trend = judged(BATTERY, sinking(-0.1))
    assert trend is not None
    assert isinstance(rule, type(BATTERY))
    named = type(trend)(
        name=rule.name, value=1.0, threshold=0.8, unit="", rate_per_min=0.1, minutes_left=7.2, minutes_low=5.0
    )
    assert "8 min" in in_words(named, language)

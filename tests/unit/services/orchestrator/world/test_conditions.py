"""The weather that is held: unsure words tighten, sure ones replace, and nobody drives faster than sight allows."""

from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.tools import Outcome
from proto.weather import Conditions
from services.orchestrator.law import rules_question
from services.orchestrator.observations.inputs import Stamped
from services.orchestrator.world.conditions import WEATHER_SURE
from tests.unit.services.orchestrator.support import EXPERTS, FEW, SECOND, Drive, Played, conditions, fact, law_of


def drive_in(weather: Conditions | None) -> Drive:
    drive = Drive(Played({"applicable_limit": law_of}))
    drive.weather = weather
    if weather is None:
        held = msgspec.structs.replace(drive.state.held, conditions=None, conditions_ns=None)
        drive.state = msgspec.structs.replace(drive.state, held=held)
    drive.ticks(3)
    return drive


def then(drive: Drive, **fields: Any) -> Conditions:
    """The weather held after a report that is better in all that is not named."""
    drive.weather = conditions(**{"confidence": 0.05, "visibility_m": 5000.0, **fields})
    drive.ticks(3)
    held = drive.state.held.conditions
    assert held is not None
    return held


BAD = conditions(
    mu=0.3, factor=0.6, wet=True, precipitation="snow", visibility_m=40.0, safe_speed_mps=9.0, following_factor=1.8
)


def test_an_unsure_report_of_fine_weather_changes_no_part_of_what_was_known() -> None:
    drive = drive_in(BAD)
    target_mps, asked = drive.target_mps, rules_question.situation(drive.state)
    held = then(drive)
    assert msgspec.structs.replace(held, confidence=0.9, risk_level="low") == msgspec.structs.replace(
        BAD, mu_high=held.mu_high
    )
    assert rules_question.situation(drive.state) == asked
    assert drive.target_mps <= target_mps


def test_a_sure_report_replaces_what_was_known() -> None:
    drive = drive_in(BAD)
    assert then(drive, confidence=WEATHER_SURE).wet is False
    assert rules_question.situation(drive.state).snow is False


@pytest.mark.parametrize(
    ("unsure", "worse"),
    [
        ({"visibility_m": 60.0}, {"visibility_m": 50.0}),
        ({"wet": True}, {"wet": True}),
        ({"precipitation": "snow"}, {"snow": True}),
    ],
)
def test_an_unsure_report_of_worse_weather_is_heeded(unsure: dict[str, Any], worse: dict[str, Any]) -> None:
    drive = drive_in(conditions())
    then(drive, **unsure)
    asked = rules_question.situation(drive.state)
    assert {name: getattr(asked, name) for name in worse} == worse


def test_a_limit_when_wet_stands_while_dryness_is_unsure() -> None:
    drive = drive_in(conditions(wet=True))
    drive.tick(
        fact(
            "limit",
            "limit:30",
            track_id=5,
            distance_m=0.0,
            passed=True,
            scope="when_wet",
            plates=("plate:when_wet:de",),
        )
    )
    drive.ticks(2)
    wet_mps = drive.target_mps
    then(drive, wet=False)
    assert drive.target_mps <= wet_mps < 9.0
    then(drive, wet=False, confidence=0.9)
    assert drive.target_mps > wet_mps


def test_an_unsure_first_report_is_no_better_than_none() -> None:
    drive = drive_in(None)
    unknown_mps = drive.target_mps
    then(drive)
    assert drive.target_mps <= unknown_mps
    assert rules_question.situation(drive.state).wet is None


reports = st.builds(
    conditions,
    mu=st.floats(0.05, 0.9),
    factor=st.floats(0.3, 1.0),
    confidence=st.floats(0.0, WEATHER_SURE, exclude_max=True),
    wet=st.sampled_from([True, False, None]),
    visibility_m=st.none() | st.floats(0.0, 5000.0),
    safe_speed_mps=st.none() | st.floats(1.0, 60.0),
    precipitation=st.sampled_from(["none", "rain", "snow", "unknown"]),
    following_factor=st.floats(1.0, 3.0),
)


@FEW
@given(
    st.none() | reports.map(lambda each: msgspec.structs.replace(each, confidence=0.9)), st.lists(reports, max_size=4)
)
def test_no_unsure_report_raises_the_target(sure: Conditions | None, unsure: list[Conditions]) -> None:
    drive = drive_in(sure)
    for report in unsure:
        before_mps = drive.target_mps
        drive.weather = report
        drive.ticks(2)
        assert drive.target_mps <= before_mps + 1e-9


def test_nobody_drives_faster_than_one_can_stop_within_sight() -> None:
    drive = drive_in(conditions(factor=0.4, visibility_m=15.0, safe_speed_mps=3.0))
    assert drive.target_mps == 3.0
    assert "sight" in drive.history[-1][2].fused.justification


@FEW
@given(st.lists(st.sampled_from(["moderate", "high", "severe"]), min_size=6, max_size=10))
def test_where_grip_wavers_between_two_levels_each_is_news_once(levels: list[str]) -> None:
    drive = Drive(Played({"applicable_limit": law_of}), speed_mps=13.0)
    drive.ticks(20)
    for level in levels:
        drive.weather = conditions(mu=0.4, factor=0.8, risk_level=level)
        drive.ticks(25)
    said = [words for words in drive.spoken() if words.startswith("Slippery")]
    assert 1 <= len(said) <= len(set(levels))


@pytest.mark.parametrize(("level", "spoken"), [("moderate", False), ("high", True), ("severe", True)])
def test_ordinary_rain_is_shown_beside_the_limit_and_spoken_only_where_it_is_grave(level: str, spoken: bool) -> None:
    rain = conditions(mu=0.4, factor=0.8, risk_level=level, wet=True, precipitation="rain")
    drive = Drive(Played({**EXPERTS, "assess_weather": lambda a: rain}), speed_mps=27.0, road="rural")
    drive.weather = rain
    drive.tick(fact("road_type", "rural"))
    drive.ticks(60)
    assert any(words.startswith("Water") for words in drive.spoken()) is spoken
    advised_mps = drive.history[-1][2].assistance.advised_mps
    assert advised_mps is not None
    assert advised_mps < 27.0


@pytest.mark.parametrize(("level", "waits"), [("moderate", True), ("high", False), ("severe", False)])
def test_a_word_on_grip_that_is_not_grave_waits_until_a_junction_is_passed(level: str, waits: bool) -> None:
    drive = Drive(Played({"applicable_limit": law_of}), speed_mps=12.5)
    drive.junction_m = 70.0
    drive.ticks(20)
    drive.weather = conditions(mu=0.4, factor=0.8, risk_level=level)
    drive.ticks(25)
    assert any(words.startswith("Slippery") for words in drive.spoken()) is not waits
    drive.junction_m = None
    drive.ticks(25)
    assert any(words.startswith("Slippery") for words in drive.spoken())


ICY = conditions(mu=0.15, factor=0.5, wet=True, risk_level="severe", following_factor=2.0, safe_speed_mps=6.0)


def test_the_last_message_of_a_silent_topic_does_not_take_back_a_newer_answer() -> None:
    drive = Drive(Played({**EXPERTS, "assess_weather": lambda a: ICY}))
    drive.ticks(5)
    last = Stamped(seq=99, stamp_ns=drive.now_ns, message=conditions())
    targets = []
    for _ in range(120):
        drive.tick(conditions=last, unhealthy=("weather/conditions",))
        targets.append(drive.target_mps)
    assert targets[-1] == 6.0
    assert targets == sorted(targets, reverse=True)


@FEW
@given(age_s=st.floats(0.0, 1.9), mu=st.floats(0.1, 1.0), factor=st.floats(0.3, 1.0))
def test_an_answer_that_is_no_newer_than_the_topic_never_raises_the_target(
    age_s: float, mu: float, factor: float
) -> None:
    drive = Drive()
    drive.weather = ICY
    drive.ticks(10)
    stood = drive.target_mps
    told = msgspec.to_builtins(conditions(mu=mu, factor=factor))
    late = Outcome(tool="assess_weather", status="ok", result=told, arguments={}, late=True, age_ms=age_s * 1e3)
    drive.tick(late=(late,))
    assert drive.target_mps <= stood


@pytest.mark.parametrize("ahead_s", [0.5, 3600.0])
def test_a_word_from_the_future_holds_off_no_later_one(ahead_s: float) -> None:
    drive = Drive()
    drive.tick(conditions=Stamped(seq=99, stamp_ns=drive.now_ns + round(ahead_s * SECOND), message=conditions(mu=0.8)))
    drive.weather = ICY
    drive.tick()
    assert drive.target_mps == 6.0


@pytest.mark.parametrize(
    "absurd",
    [
        {"confidence": 7.0},
        {"confidence": -0.1},
        {"visibility_m": -1.0},
        {"rain_mm_h": -2.0},
        {"following_factor": -3.0},
    ],
)
def test_a_report_with_a_number_that_no_weather_has_changes_nothing(absurd: dict[str, float]) -> None:
    drive = drive_in(BAD)
    stood = drive.target_mps
    assert then(drive, **{"confidence": 0.9, **absurd}) == BAD
    assert drive.target_mps <= stood

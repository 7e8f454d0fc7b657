"""A lower limit ahead: announced while there is time, and told to slow down for when there is none left to lose."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.orchestrator.speech.candidates.limits_ahead import FIRM_MPS2, NEAR
from services.orchestrator.world.stops import COMFORT_MPS2, REACTION_S
from tests.unit.services.orchestrator.judge import arbiter
from tests.unit.services.orchestrator.support import (
    EXPERTS,
    FEW,
    KMH,
    Drive,
    Played,
    conditions,
    end_sign,
    fact,
    limit_answer,
    limit_sign,
)

TICK_S = 0.1
FIRM, CALM = "Slow down: 80 ahead", "80 ahead"


def approached(
    speed_mps: float, from_m: float, slows_mps2: float = 0.0, wet: bool | None = False, **fields: Any
) -> tuple[Drive, dict[str, float]]:
    """A drive past a sign of 80, and how far ahead the sign was when each directive was spoken first."""
    weather = conditions(wet=wet)
    drive = Drive(
        Played({**EXPERTS, "assess_weather": lambda _: weather}, arbiter=arbiter()), speed_mps=speed_mps, road="rural"
    )
    drive.weather = weather
    drive.ticks(20)
    spoken: dict[str, float] = {}
    left_m = from_m
    while left_m > 0.0:
        ticked = drive.tick(limit_sign("limit:80", passed=False, distance_m=left_m, **fields))
        if ticked.advisory.kind != "SILENT":
            spoken.setdefault(ticked.advisory.directive, left_m)
        assert drive.speed_mps is not None
        if spoken:
            drive.comes_to(max(80 * KMH, drive.speed_mps - slows_mps2 * TICK_S))
        left_m -= drive.speed_mps * TICK_S
    return drive, spoken


def test_who_slows_down_when_it_is_announced_is_told_no_more() -> None:
    _, spoken = approached(27.0, 165.0, slows_mps2=1.5)
    assert CALM in spoken
    assert FIRM not in spoken


def test_who_does_not_is_told_once_more_while_firm_braking_still_keeps_it() -> None:
    _, spoken = approached(27.0, 165.0)
    assert list(spoken) == [CALM, FIRM]
    slowing_m = (27.0**2 - (80 * KMH) ** 2) / (2 * FIRM_MPS2)
    assert spoken[FIRM] == pytest.approx(slowing_m, abs=2 * 27.0 * TICK_S)


def test_who_sees_the_sign_late_hears_it_while_comfortable_braking_keeps_it() -> None:
    _, spoken = approached(27.0, 100.0)
    slowing_m = (27.0**2 - (80 * KMH) ** 2) / (2 * COMFORT_MPS2)
    assert max(spoken.values()) >= min(100.0, 27.0 * REACTION_S + slowing_m) - 2 * 27.0 * TICK_S


def firm_words(drive: Drive) -> list[str]:
    """Of the words to slow down, how urgent each was."""
    said = (ticked.advisory for _, _, ticked in drive.history)
    return [each.urgency for each in said if each.directive == FIRM and each.kind != "SILENT"]


def test_who_was_told_in_vain_hears_it_once_more_and_more_urgently() -> None:
    assert firm_words(approached(27.0, 165.0)[0]) == ["warning"]


def test_who_would_overspeed_at_the_sign_does_and_who_is_hardly_above_it_does_not() -> None:
    assert firm_words(approached(27.0, 165.0)[0]) == ["warning"]
    assert firm_words(approached(23.2, 165.0)[0]) == []


@FEW
@given(speed_mps=st.floats(20.0, 45.0), from_m=st.floats(3.0, 250.0), slows_mps2=st.floats(0.0, 3.0))
def test_nobody_hears_it_a_third_time(speed_mps: float, from_m: float, slows_mps2: float) -> None:
    words = firm_words(approached(speed_mps, from_m, slows_mps2)[0])
    assert words in ([], ["advice"], ["warning"], ["advice", "warning"])


def test_another_sign_of_a_limit_that_has_ended_is_announced_again() -> None:
    drive, spoken = approached(27.0, 165.0)
    assert FIRM in spoken
    drive.tick(limit_sign("limit:80"))
    drive.ticks(30)
    drive.tick(end_sign("limit_end"))
    drive.ticks(30)
    before = len(drive.spoken())
    drive.tick(limit_sign("limit:80", track_id=9, passed=False, distance_m=150.0))
    drive.ticks(10)
    assert drive.spoken()[before:] == [CALM]


def announced_after_another_reading(seconds: float) -> list[str]:
    """What is spoken of a gantry's 80 that was announced, then read as 120 for so long, and then as 80 again."""
    drive = Drive(Played(arbiter=arbiter()), speed_mps=27.0, road="motorway")
    drive.ticks(20)
    for reading, ticks, from_m in (("80", 10, 200.0), ("120", round(seconds / TICK_S), 175.0), ("80", 10, 150.0)):
        for tick in range(ticks):
            left_m = from_m - 2.7 * tick
            drive.tick(limit_sign(f"led:{reading}", scope="gantry", passed=False, distance_m=max(left_m, 150.0)))
    return [each for each in drive.spoken() if each == CALM]


def test_what_a_gantry_shows_again_after_something_else_is_announced_again() -> None:
    assert announced_after_another_reading(8.0) == [CALM, CALM]


def test_a_reading_that_flickers_is_announced_once() -> None:
    assert announced_after_another_reading(1.0) == [CALM]


def test_who_sees_the_sign_late_is_told_to_slow_down_at_once_and_nothing_calmer_after_it() -> None:
    _, spoken = approached(27.0, 70.0)
    assert list(spoken) == [FIRM]


def spoken_speeding_up(speed_mps: float, change_mps2: float, from_m: float) -> list[str]:
    """What is spoken while the ego speeds up past a sign of 80, until it is passed."""
    drive = Drive(Played(arbiter=arbiter()), speed_mps=speed_mps, road="rural")
    drive.ticks(20)
    drive.acceleration_mps2 = change_mps2
    before = len(drive.spoken())
    left_m = from_m
    while left_m > 0.0:
        drive.tick(limit_sign("limit:80", passed=False, distance_m=left_m))
        assert drive.speed_mps is not None
        drive.speed_mps += change_mps2 * TICK_S
        left_m -= drive.speed_mps * TICK_S
    return drive.spoken()[before:]


@FEW
@given(speed_mps=st.floats(3.0, 30.0), change_mps2=st.floats(0.3, 2.5), from_m=st.floats(20.0, 200.0))
def test_no_ego_speeds_up_past_a_limit_ahead_untold(speed_mps: float, change_mps2: float, from_m: float) -> None:
    reached_mps = (speed_mps**2 + 2.0 * change_mps2 * from_m) ** 0.5
    said = spoken_speeding_up(speed_mps, change_mps2, from_m)
    assert {CALM, FIRM} & set(said) or reached_mps <= NEAR * 80 * KMH + 3 * change_mps2 * TICK_S


def test_it_is_advice_of_that_limit() -> None:
    drive, _ = approached(27.0, 70.0)
    said = next(t.advisory for _, _, t in drive.history if t.advisory.directive == FIRM and t.advisory.kind != "SILENT")
    assert (said.topic, said.urgency, said.hazard) == ("ahead", "advice", "")
    assert said.ahead_mps == pytest.approx(80 * KMH)


@pytest.mark.parametrize("plate", ["plate:time", "plate:school", "plate:distance", "plate:arrow_left"])
def test_a_limit_that_may_not_hold_right_behind_its_sign_is_announced_only(plate: str) -> None:
    _, spoken = approached(27.0, 165.0, plates=(plate,))
    assert list(spoken) == [CALM]


@pytest.mark.parametrize("road", ["dry", "wet", "unknown"])
def test_of_a_limit_for_wet_roads_it_depends_on_what_is_known_of_the_road(road: str) -> None:
    wet = None if road == "unknown" else road == "wet"
    _, spoken = approached(27.0, 165.0, wet=wet, scope="when_wet", plates=("plate:when_wet:en",))
    assert [each for each in spoken if "80" in each] == {"dry": [], "wet": [CALM, FIRM], "unknown": [CALM]}[road]


def test_a_limit_for_lorries_is_none_for_a_car() -> None:
    drive, spoken = approached(27.0, 165.0, plates=("plate:lorries",))
    assert spoken == {}
    assert drive.target_mps > 26.0


def test_who_brakes_already_as_hard_as_it_takes_hears_of_it_only_when_the_braking_ends() -> None:
    drive = Drive(Played(arbiter=arbiter()), speed_mps=27.0, road="rural")
    drive.ticks(20)
    before = len(drive.spoken())
    for slowing_mps2, said in ((2.0, []), (0.0, [CALM])):
        drive.acceleration_mps2 = -slowing_mps2
        for _ in range(8):
            assert drive.speed_mps is not None
            drive.speed_mps -= slowing_mps2 * TICK_S
            drive.tick(limit_sign("limit:80", passed=False, distance_m=125.0))
        assert drive.spoken()[before:] == said


def test_a_lower_limit_that_may_not_hold_hides_no_other_that_does() -> None:
    drive = Drive(Played(arbiter=arbiter()), speed_mps=27.0, road="rural")
    drive.ticks(20)
    timed = limit_sign("limit:60", track_id=4, passed=False, distance_m=70.0, plates=("plate:time",))
    drive.tick(limit_sign("limit:80", passed=False, distance_m=70.0), timed)
    drive.ticks(25)
    assert FIRM in drive.spoken()
    assert "Slow down: 60 ahead" not in drive.spoken()


@pytest.mark.parametrize("plates", [(), ("plate:time",)], ids=["that holds", "that may not hold"])
def test_a_limit_that_ends_before_a_lower_one_in_sight_makes_nobody_speed_up(plates: tuple[str, ...]) -> None:
    drive = Drive(Played(arbiter=arbiter()), speed_mps=15.0, road="rural")
    drive.tick(limit_sign("limit:70"))
    drive.ticks(40)
    for left_m in range(120, 0, -2):
        lower = limit_sign("limit:30", track_id=7, passed=False, distance_m=float(left_m), plates=plates)
        drive.tick(*([end_sign("limit_end")] if left_m == 120 else []), lower)
    assert "Limit 100" not in drive.spoken()
    drive.tick(limit_sign("limit:30", track_id=7, plates=plates))
    drive.ticks(30)
    assert any("30" in each for each in drive.spoken())


def behind_the_sign(drive: Drive, seconds: float = 8.0) -> tuple[list[str], bool]:
    """What is spoken behind a sign of 80 that the driver ignores, and whether the overspeed sounds."""
    before, began = len(drive.spoken()), len(drive.history)
    drive.comes_to(27.0)
    drive.tick(limit_sign("limit:80"))
    drive.ticks(round(seconds * 10))
    sounds = any(each.assistance.warning == "sounded" for _, _, each in drive.history[began:])
    return drive.spoken()[before:], sounds


def test_a_driver_told_twice_of_a_limit_in_vain_hears_the_tone_behind_its_sign_and_no_third_word() -> None:
    drive, _ = approached(27.0, 165.0)
    assert drive.spoken() == [CALM, FIRM]
    assert behind_the_sign(drive) == ([], True)
    drive.comes_to(22.0)
    drive.ticks(100)
    drive.comes_to(27.0)
    drive.ticks(60)
    assert drive.spoken()[2:] == ["Slow down: 80"], "the limit was kept, and is broken again"


def test_a_limit_that_rises_while_the_tone_of_a_lower_one_sounds_is_no_overspeed() -> None:
    drive, _ = approached(27.0, 165.0)
    behind_the_sign(drive, 5.0)
    assert drive.history[-1][2].assistance.warning == "sounded"
    drive.tick(limit_sign("limit:100", track_id=12))
    drive.ticks(10)
    assert drive.spoken() == [CALM, FIRM]


@pytest.mark.parametrize(
    ("over_ours", "closed", "off_m", "told"),
    [
        ("led:lane_closed", {}, 5.0, True),
        ("led:lane_closed", {"believed": False}, 5.0, False),
        ("led:lane_closed", {"lane_id": "offset:-1"}, 5.0, False),
        ("led:lane_closed", {}, 60.0, False),
        ("led:lane_open", {}, 5.0, False),
    ],
)
def test_beside_a_closed_lane_the_limit_over_the_next_one_is_announced(
    over_ours: str, closed: dict[str, Any], off_m: float, told: bool
) -> None:
    drive = Drive(Played(EXPERTS, arbiter=arbiter()), speed_mps=27.0, road="motorway")
    drive.ticks(20)
    for tick in range(20):
        left_m = 110.0 - 2.7 * tick
        drive.tick(
            fact("message", over_ours, **{"track_id": 11, "distance_m": left_m, **closed}),
            limit_sign("led:80", track_id=12, passed=False, distance_m=left_m + off_m, lane_id="offset:+1"),
        )
    assert bool(drive.spoken()) is told


def test_a_driver_told_once_of_a_limit_hears_the_word_behind_its_sign() -> None:
    drive, _ = approached(27.0, 30.0)
    assert drive.spoken() == [FIRM]
    assert behind_the_sign(drive) == (["Slow down: 80"], True)


@pytest.mark.parametrize("announced", [False, True])
def test_no_overspeed_is_spoken_when_a_lower_limit_is_about_to_be_announced(announced: bool) -> None:
    drive = Drive(Played(arbiter=arbiter()), speed_mps=27.0, road="rural")
    drive.tick(limit_sign("limit:80", track_id=1))
    drive.ticks(20)
    before = len(drive.spoken())
    for tick in range(25):
        left_m = 267.0 - 2.7 * (20 + tick)
        drive.tick(*[limit_sign("limit:50", track_id=7, passed=False, distance_m=left_m)] * announced)
    assert drive.history[-1][2].assistance.warning == "sounded"
    assert drive.spoken()[before:] == (["50 ahead"] if announced else ["Slow down: 80"])


@pytest.mark.parametrize("speed_mps", [23.5, 24.0, 25.0, 26.0])
def test_a_driver_told_of_a_lower_limit_hears_no_word_on_the_higher_one_right_before_the_sign(speed_mps: float) -> None:
    drive, left_m = Drive(Played(arbiter=arbiter()), speed_mps=22.0, road="rural"), 230.0
    drive.tick(limit_sign("limit:80", track_id=1))
    drive.ticks(100)
    before = len(drive.spoken())
    drive.comes_to(speed_mps)
    while left_m > 0.0:
        drive.tick(*[limit_sign("limit:70", track_id=7, passed=False, distance_m=left_m)] * (left_m < 133.0))
        left_m -= speed_mps * TICK_S
    assert drive.history[-1][2].assistance.warning == "sounded"
    assert drive.spoken()[before:] == ["70 ahead", "Slow down: 70 ahead"]


@FEW
@given(speed_mps=st.floats(5.0, 45.0), from_m=st.floats(3.0, 250.0))
def test_nobody_who_is_slow_enough_is_told_and_everybody_else_in_time(speed_mps: float, from_m: float) -> None:
    _, spoken = approached(speed_mps, from_m)
    over = speed_mps > NEAR * 80 * KMH
    assert (FIRM in spoken or CALM in spoken) <= over
    needed_m = speed_mps * REACTION_S + (speed_mps**2 - (80 * KMH) ** 2) / (2 * COMFORT_MPS2)
    if over and from_m > needed_m:
        told_m = max(spoken.get(FIRM, 0.0), spoken.get(CALM, 0.0))
        assert told_m >= min(from_m, needed_m) - 3 * speed_mps * TICK_S


def test_a_limit_that_was_announced_and_proved_to_be_of_lorries_silences_no_later_one() -> None:
    drive = Drive(
        Played({**EXPERTS, "applicable_limit": lambda _: limit_answer(120)}, arbiter=arbiter()),
        speed_mps=27.0,
        road="motorway",
    )
    drive.ticks(20)
    drive.tick(limit_sign("limit:80", passed=False, distance_m=150.0))
    for left_m in (100.0, 50.0, 10.0):
        drive.tick(limit_sign("limit:80", passed=False, distance_m=left_m, plates=("plate:lorries",)))
    drive.tick(limit_sign("limit:80", plates=("plate:lorries",)))
    drive.ticks(60)
    before = len(drive.spoken())
    drive.tick(limit_sign("limit:80", track_id=9, passed=False, distance_m=150.0))
    drive.ticks(10)
    assert drive.spoken()[before:] == [CALM]

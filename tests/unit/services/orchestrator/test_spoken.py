"""What the driver hears of a tick, and how often."""

from typing import Any

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from proto.messages import Kind
from proto.rules import RulesAnswer
from proto.scene import Fact
from tests.unit.services.orchestrator.judge import arbiter
from tests.unit.services.orchestrator.support import (
    EXPERTS,
    FEW,
    KMH,
    TICK,
    Drive,
    Played,
    actor,
    conditions,
    doubted,
    end_sign,
    fact,
    law_of,
    limit_answer,
    limit_sign,
    locally,
    meaning,
    preferences,
    replace,
)


def test_an_overspeed_is_told_by_the_table_of_times_and_not_nagged() -> None:
    drive = Drive()
    drive.ticks(30)
    drive.comes_to(17.0)
    drive.ticks(100)
    assert [text for text in drive.spoken() if text.startswith("Slow down")] == ["Slow down: 50"]


@pytest.mark.parametrize("line", [False, True])
def test_no_overspeed_is_spoken_when_a_word_on_a_line_is_about_to_cut_it(line: bool) -> None:
    drive = Drive(speed_mps=15.0)
    drive.tick(limit_sign("limit:50", track_id=1))
    for tick in range(75):
        stop = fact("sign", "stop", track_id=8, distance_m=180.0 - 1.5 * tick)
        drive.tick(*[stop] * line)
    assert drive.history[-8][2].assistance.warning == "sounded"
    assert drive.spoken() == (["Stop at the line"] if line else ["Slow down: 50"])


def after_a_sign(reading: str, drive: Drive, ticks: int = 70) -> list[str]:
    """What is spoken from that sign on."""
    before = len(drive.spoken())
    drive.tick(limit_sign(reading, track_id=len(drive.history)))
    drive.ticks(ticks)
    return drive.spoken()[before:]


def test_a_limit_below_the_speed_is_told_once_and_the_next_one_again() -> None:
    drive = Drive(speed_mps=90 * KMH, road="rural")
    drive.ticks(30)
    assert after_a_sign("limit:70", drive) == ["Limit 70", "Slow down: 70"]
    drive.comes_to(67 * KMH)
    assert after_a_sign("limit:60", drive, 90) == ["Limit 60", "Slow down: 60"]
    drive.comes_to(45 * KMH)
    assert after_a_sign("limit:50", drive) == [], "a limit that is kept is shown alone"


def test_a_limit_that_was_told_with_its_border_is_not_told_again() -> None:
    drive = Drive(speed_mps=40 * KMH)
    drive.ticks(70)
    before = len(drive.spoken())
    drive.tick(fact("jurisdiction", "NLD"), limit_sign("limit:45"))
    drive.ticks(70)
    assert drive.spoken()[before:] == ["Netherlands: 45"]


def test_the_overspeed_of_another_limit_is_a_first_notice_of_its_own_however_unsure_the_law_is() -> None:
    def unsure(arguments: dict[str, Any]) -> RulesAnswer:
        return replace(law_of(arguments), confidence=0.45)

    drive = Drive(Played({**EXPERTS, "applicable_limit": unsure}, arbiter=arbiter()), speed_mps=31.0, road="rural")
    drive.ticks(65)
    drive.comes_to(27.0)
    drive.ticks(25)
    drive.tick(limit_sign("limit:80"))
    drive.ticks(65)
    told = [each for each in drive.spoken() if each.startswith("Slow down")]
    assert told == ["Slow down: 100", "Slow down: 80"]


@FEW
@given(before=st.integers(5, 10), lower=st.integers(2, 9), over=st.floats(1.06, 1.6), left=st.floats(0.0, 0.9))
def test_who_is_too_fast_for_the_next_limit_as_well_is_told_though_nothing_is_left_of_the_budget(
    before: int, lower: int, over: float, left: float
) -> None:
    assume(lower < before)
    drive = Drive(Played(arbiter=arbiter(budget=left)), speed_mps=10 * before * KMH * over, road="rural")
    drive.tick(limit_sign(f"limit:{10 * before}"))
    drive.ticks(70)
    assert drive.spoken()[-1] == f"Slow down: {10 * before}"
    assert after_a_sign(f"limit:{10 * lower}", drive, ticks=70)[-1] == f"Slow down: {10 * lower}"


def test_the_overspeed_of_a_higher_limit_in_the_same_episode_is_no_first_notice() -> None:
    drive = Drive(Played(arbiter=arbiter(budget=0.0)), speed_mps=53.0 * KMH)
    assert after_a_sign("limit:30", drive, ticks=40) == ["Slow down: 30"]
    assert after_a_sign("limit:50", drive, ticks=40) == []
    assert "overspeed" in {each.kind for each in drive.history[-1][2].events}


def test_what_the_wet_asks_for_is_shown_beside_a_limit_and_not_spoken() -> None:
    drive = Drive(speed_mps=90 * KMH, road="rural")
    drive.weather = conditions(mu=0.5, factor=0.8, wet=True)
    drive.ask.table = {**drive.ask.table, "assess_weather": lambda a: drive.weather}
    drive.ticks(60)
    assert after_a_sign("limit:70", drive) == ["Limit 70", "Slow down: 70"]
    assert drive.history[-1][2].assistance.advised_mps == pytest.approx(0.8 * 70 * KMH)


def test_who_slows_down_from_far_too_fast_hears_no_calmer_word_on_it() -> None:
    drive = Drive(speed_mps=90 * KMH, road="rural")
    drive.ticks(30)
    assert after_a_sign("limit:70", drive) == ["Limit 70", "Slow down: 70"]
    drive.comes_to(78 * KMH)
    before = len(drive.spoken())
    drive.ticks(600)
    assert drive.spoken()[before:] == []
    drive.comes_to(69 * KMH)
    drive.ticks(5)
    drive.comes_to(78 * KMH)
    drive.ticks(60)
    assert drive.spoken()[before:] == ["Slow down: 70"], "the limit was kept, and is broken again"


def test_the_driver_hears_german_and_miles_from_the_tick_in_which_he_asks_for_them() -> None:
    drive = Drive()
    drive.ticks(20)
    drive.tick(preferences=preferences(language="de", unit="mph", converts=True))
    drive.comes_to(17.0)
    drive.ticks(50)
    assert drive.spoken()[-1] == "Langsamer: 31 Meilen pro Stunde"


def test_mute_silences_news_but_not_hazards() -> None:
    drive = Drive(speed_mps=7.0)
    drive.tick(preferences=preferences(muted=True))
    count = len(drive.spoken())
    drive.tick(limit_sign("limit:30"))
    drive.ticks(20)
    assert len(drive.spoken()) == count
    drive.tracks, drive.lead = (actor(12.0, 8.0),), 5
    assert drive.tick().advisory.kind == "SPEAK"


def test_a_foreign_plate_is_explained_in_the_drivers_language() -> None:
    drive = Drive()
    drive.ticks(60)
    sign = limit_sign("limit:30", passed=False, scope="when_wet", plates=("plate:when_wet:de",), distance_m=40.0)
    drive.tick(sign)
    drive.ticks(12)
    assert "30 when wet" in drive.spoken()


def test_a_foreign_plate_under_a_limit_that_the_driver_keeps_is_explained_once_he_goes_beyond_it() -> None:
    drive = Drive(speed_mps=40 * KMH, road="rural")
    drive.ticks(60)
    wet: dict[str, Any] = {"scope": "when_wet", "plates": ("plate:when_wet:de",), "distance_m": 60.0}

    def explained(speed_kmh: float) -> bool:
        drive.comes_to(speed_kmh * KMH)
        seen = [drive.tick(limit_sign("limit:50", passed=False, **wet)) for _ in range(12)]
        return any(each.advisory.topic == "foreign" for each in seen)

    assert not explained(40.0)
    assert explained(66.0)


def test_a_plate_under_a_limit_that_holds_and_was_announced_is_not_explained_as_well() -> None:
    drive = Drive(Played({**EXPERTS, "assess_weather": lambda a: conditions(wet=True)}), speed_mps=27.0, road="rural")
    drive.weather = conditions(wet=True)
    drive.ticks(60)
    sign: dict[str, Any] = {"passed": False, "distance_m": 70.0}
    drive.tick(limit_sign("limit:80", **sign))
    before = len(drive.spoken())
    for _ in range(30):
        drive.tick(limit_sign("limit:80", scope="when_wet", plates=("plate:when_wet:de",), **sign))
    assert drive.spoken()[before - 1] == "Slow down: 80 ahead"
    assert not any("when wet" in words for words in drive.spoken())


def test_a_foreign_plate_under_the_end_of_a_limit_is_shown_and_not_explained() -> None:
    drive = Drive(speed_mps=27.0, road="motorway")
    drive.ticks(60)
    drive.tick(end_sign("all_end", passed=False, plates=("plate:when_wet:de",), distance_m=40.0))
    drive.ticks(20)
    assert not any(each.advisory.topic == "foreign" for _, _, each in drive.history)


def test_two_foreign_plates_in_turn_are_explained_once_each() -> None:
    drive = Drive(speed_mps=20.0)
    drive.ticks(60)
    for track_id, value in ((11, 60), (12, 50), (13, 60), (14, 50)):
        wet: dict[str, Any] = {
            "scope": "when_wet",
            "plates": ("plate:when_wet:de",),
            "distance_m": 40.0,
            "track_id": track_id,
        }
        drive.tick(limit_sign(f"limit:{value}", passed=False, **wet))
        drive.ticks(50)
    assert [each for each in drive.spoken() if "when wet" in each] == ["60 when wet", "50 when wet"]


def test_a_foreign_plate_under_a_sign_and_a_number_on_one_post_is_explained_with_the_number() -> None:
    wet: dict[str, Any] = {"plates": ("plate:when_wet:de",), "passed": False}

    def shown(*facts: Fact) -> str:
        drive = Drive(speed_mps=10.0)
        drive.ticks(60)
        drive.tick(*facts)
        return drive.ticks(3).advisory.directive

    far, near = (fact("sign", "slippery", track_id=21, distance_m=each, **wet) for each in (80.0, 45.0))
    number = limit_sign("limit:30", scope="when_wet", distance_m=95.0, track_id=22, **wet)
    assert "slippery" not in shown(far), "a number may be read on its post yet"
    assert "slippery" in shown(near)
    assert shown(far, number) == shown(near, number) == "30 when wet"


@pytest.mark.parametrize(
    ("decided", "words", "urgency"),
    [
        ({"kind": "SPEAK", "reason": "hazard: closing_lead"}, "Brake: vehicle ahead", "warning"),
        (
            {"kind": "SPEAK", "reason": "ACT withheld: no grant", "act_withheld": "no grant"},
            "Brake! Vehicle",
            "alarm",
        ),
        (
            {"kind": "ACT", "reason": "U_act - U_speak = 0.3 > Delta = 0.2 and RSS is violated"},
            "Brake! Vehicle",
            "alarm",
        ),
    ],
)
def test_what_only_the_arbiter_sees_is_said_in_words(decided: dict[str, Any], words: str, urgency: str) -> None:
    drive = Drive()
    local = drive.tick().decision
    told_before = drive.state.memory
    drive.ask.decide = lambda request: replace(
        local, tick=request.tick, hazard="closing_lead", profile="calibrated", **decided
    )
    ticked = drive.tick()
    assert ticked.fused.topic == ""
    assert (ticked.advisory.directive, ticked.advisory.hazard) == (words, "closing_lead")
    assert ticked.advisory.urgency == urgency
    told = ticked.state.memory.last(Kind.CAUTION)
    assert told is not None
    assert [each.hazard for each in ticked.state.memory.hazards] == ["closing_lead"]
    assert told_before.last(Kind.CAUTION) is None


@pytest.mark.parametrize(
    ("y_m", "vy_mps", "directive"),
    [
        (-18.0, 7.0, "Vehicle from the right"),
        (18.0, -7.0, "Vehicle from the left"),
        (2.0, 7.0, "Brake: vehicle ahead"),  # it is through, and its tail is not
        (-4.0, 1.0, "Brake: vehicle ahead"),  # it changes lanes
    ],
)
def test_who_drives_across_our_way_is_told_with_the_side_he_comes_from(
    y_m: float, vy_mps: float, directive: str
) -> None:
    drive = Drive(speed_mps=12.0)
    drive.ticks(20)
    speed_mps = 0.0 if abs(vy_mps) > 2.0 else 4.0
    for _ in range(4):
        drive.tracks = (
            actor(gap_m=25.0 if speed_mps == 0.0 else 22.0, closing_mps=12.0 - speed_mps, y_m=y_m, vy_mps=vy_mps),
        )
        drive.tick()
    told = next(t.advisory for _, _, t in drive.history if t.advisory.hazard and t.advisory.kind == "SPEAK")
    assert (told.directive, told.topic, told.hazard) == (directive, "lead", "closing_lead")


def test_a_first_notice_is_owed_until_it_is_spoken() -> None:
    drive = Drive()
    drive.comes_to(20.0)
    drive.ask.decide = lambda request: replace(
        locally(request), kind="SPEAK", hazard="closing_lead", profile="calibrated"
    )
    shouted = drive.ticks(60)
    assert shouted.fused.first_notice
    assert not any("slow down" in text.lower() for text in drive.spoken())
    drive.ask.decide = lambda request: None
    drive.ticks(19)
    assert not any("slow down" in text.lower() for text in drive.spoken())
    assert drive.tick().advisory.directive == "Slow down: 50"
    assert drive.tick().fused.first_notice is False


def test_what_the_rules_said_of_a_junction_is_quoted_at_that_one_alone() -> None:
    note = "You are on a priority road: others wait."
    told = limit_answer(50, legal_action="proceed", limit=None, note=note)
    drive = Drive(Played({**EXPERTS, "right_of_way": lambda a: told}))
    drive.ticks(30)
    drive.tracks = (person := actor(25.0, closing_mps=12.0, kind="pedestrian", length_m=0.6),)
    ticked = drive.tick(fact("sign", "priority_road", track_id=70, distance_m=20.0))
    assert note in ticked.fused.justification
    drive.tracks = ()
    drive.ticks(600)
    drive.tracks = (replace(person, track_id=6),)
    drive.ticks(3)
    assert drive.history[-1][2].fused.topic == "person"
    assert note not in drive.history[-1][2].fused.justification


def test_what_the_rules_said_of_one_doubted_sign_is_not_quoted_for_another() -> None:
    drive = Drive(Played({**EXPERTS, "interpret_sign": lambda a: meaning(a["reading"], note=f"Of {a['reading']}.")}))
    drive.tick(doubted("limit:30", ("limit:80", 0.4), track_id=30, distance_m=40.0))
    del drive.ask.table["interpret_sign"]
    drive.ticks(10)
    for _ in range(20):
        drive.tick(doubted("limit:20", ("limit:70", 0.4), track_id=31, distance_m=20.0))
    doubts = [t.fused for _, _, t in drive.history if t.fused.topic == "doubt"]
    assert doubts
    assert all("Of limit:30" not in fused.justification for fused in doubts)


@pytest.mark.parametrize(("waited_s", "told"), [(20, True), (100, True), (300, False)])
def test_green_is_told_to_who_waits_for_it_and_not_for_a_red_of_long_ago(waited_s: int, told: bool) -> None:
    drive = Drive(speed_mps=10.0)
    drive.ticks(30)
    for tick in range(10):
        drive.tick(fact("light", "light:red", track_id=4, distance_m=30.0 - tick))
    drive.comes_to(0.0)
    for _ in range(waited_s):
        drive.now_ns += 9 * TICK
        drive.tick(fact("light", "light:red", track_id=4, distance_m=15.0))
    drive.tick(fact("light", "light:green", track_id=4, distance_m=15.0))
    drive.tick(fact("light", "light:green", track_id=4, distance_m=15.0))
    assert any("Green" in text for text in drive.spoken()[1:]) is told


def test_while_the_car_brakes_the_words_are_the_gravest_whatever_the_driver_was_told_before() -> None:
    """A person that is an alarm in one tick and a warning in the next would else change the words ten times a second."""
    drive = Drive(speed_mps=12.0)
    drive.ticks(20)
    drive.ask.decide = lambda request: replace(locally(request), kind="SPEAK", hazard="closing_lead")
    for braking in range(8):
        if braking == 2:
            drive.ask.decide = lambda request: replace(
                locally(request), kind="ACT", hazard="closing_lead", brake_mps2=4.0
            )
        drive.tracks = (actor(gap_m=30.0 - braking, closing_mps=10.0),)
        drive.tick()
    told = [(t.advisory.directive, t.advisory.urgency) for _, _, t in drive.history if t.advisory.kind == "ACT"]
    assert told == [("Brake! Vehicle", "alarm")] * 6


def test_a_driver_whose_car_is_held_at_standstill_is_told_what_ends_it() -> None:
    drive = Drive(speed_mps=0.0)
    drive.ticks(20)
    drive.ask.decide = lambda request: replace(locally(request), kind="ACT", hazard="closing_lead", brake_mps2=2.0)
    drive.tracks = (actor(gap_m=2.0, closing_mps=0.0),)
    held = drive.tick().advisory
    assert (held.directive, held.urgency, held.hazard) == ("Foot on the brake", "alarm", "held")

"""The tick end to end in pure form."""

import itertools
from typing import Any

import msgspec
import pytest

from proto.decision import TraceRecord
from proto.rules import RulesAnswer
from proto.sensors import StopLine
from services.orchestrator.local import decide_locally
from services.orchestrator.state import State, digest
from services.orchestrator.tick import redecide, state_of, trace_of
from tests.unit.services.orchestrator.judge import arbiter
from tests.unit.services.orchestrator.support import (
    EXPERTS,
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
    meaning,
    preferences,
    replace,
)


def test_the_law_bounds_the_target_and_is_said_once() -> None:
    drive = Drive()
    drive.ticks(30)
    assert drive.target_mps == pytest.approx(50 * KMH)
    assert drive.spoken() == ["Limit 50 km/h"]


def test_rain_recommends_less_than_the_law_allows_and_both_are_said() -> None:
    drive = Drive()
    drive.weather = conditions(mu=0.35, factor=0.7, wet=True, risk_level="high")
    drive.ask.table = {**drive.ask.table, "assess_weather": lambda a: drive.weather}
    drive.ticks(80)
    last = drive.history[-1][2].fused
    assert last.target_mps == pytest.approx(35 * KMH)
    assert last.legal_limit is not None
    assert last.legal_limit.mps == pytest.approx(50 * KMH)
    assert "Legal limit 50 km/h (§ 3 StVO)" in last.justification
    assert "Recommended 35 km/h: reduced grip on a wet road" in last.justification
    assert last.citations[0].document == "stvo.md"


def test_a_calm_drive_calls_no_tool_twice() -> None:
    drive = Drive()
    drive.ticks(40)
    assert sorted(call.tool for call in drive.ask.calls) == ["applicable_limit"]


def test_a_recommended_speed_is_not_called_a_limit_and_nobody_is_too_fast_by_it() -> None:
    from proto.rules import LegalLimit

    advised = LegalLimit(value=130, unit="km/h", mps=130 * KMH, advisory=True)
    ask = Played({**EXPERTS, "applicable_limit": lambda a: limit_answer(130, limit=advised)})
    drive = Drive(ask, road="motorway", speed_mps=45.0)
    drive.ticks(70)
    assert "No limit, recommended 130 km/h" in drive.spoken()
    assert not any(text.startswith("Slow down: limit 130") for text in drive.spoken())


def test_a_late_answer_is_used_in_the_next_tick() -> None:
    drive = Drive()
    drive.ask.table = {tool: expert for tool, expert in drive.ask.table.items() if tool != "applicable_limit"}
    drive.tick(end_sign("town_exit"))
    held = drive.target_mps
    missed = next(o for o in drive.history[-1][2].outcomes if o.tool == "applicable_limit")
    answer = msgspec.to_builtins(limit_answer(100))
    late = msgspec.structs.replace(missed, status="ok", result=answer, late=True, age_ms=120.0)
    advisory = drive.tick(late=(late,)).advisory
    assert held == pytest.approx(50 * KMH)
    assert drive.target_mps == pytest.approx(100 * KMH)
    assert advisory.late_tools == ("applicable_limit",)


def test_a_late_answer_to_yesterdays_question_is_not() -> None:
    drive = Drive()
    question = next(o for o in drive.history[0][2].outcomes if o.tool == "applicable_limit")
    drive.tick(limit_sign("limit:30"))
    drive.tick(late=(msgspec.structs.replace(question, late=True, age_ms=200.0),))
    assert drive.target_mps == pytest.approx(30 * KMH)


def test_a_stale_weather_is_asked_for_again() -> None:
    drive = Drive()
    drive.ticks(5)
    drive.weather, drive.ask.calls[:] = None, []
    drive.ticks(60)
    assert "assess_weather" in {call.tool for call in drive.ask.calls}


def test_a_dead_service_does_not_cost_every_tick() -> None:
    drive = Drive(Played(experts={}))
    drive.ticks(50)
    assert sum(call.tool == "applicable_limit" for call in drive.ask.calls) <= 11


def test_a_tool_that_just_failed_counts_as_failed_while_it_is_left_in_peace() -> None:
    drive = Drive()
    drive.ticks(20)
    drive.ask.table = {tool: expert for tool, expert in EXPERTS.items() if tool != "right_of_way"}
    drive.tracks = (actor(25.0, closing_mps=12.0, kind="pedestrian"),)
    drive.lines = (StopLine(distance_m=30.0, kind="crossing"),)
    for _ in range(20):
        ticked = drive.tick()
        assert ticked.request.tool_timed_out
        assert "tool:right_of_way" in ticked.fused.degraded
        assert ticked.fused.confidence == pytest.approx(0.9 * 0.9)
    drive.ask.table = EXPERTS
    drive.ticks(6)
    assert not drive.tick().request.tool_timed_out


def test_a_lead_that_closes_in_is_a_hazard() -> None:
    drive = Drive(speed_mps=14.0)
    drive.ticks(3)
    drive.tracks, drive.lead = (actor(30.0, 10.0),), 5
    ticked = drive.tick()
    assert (ticked.advisory.kind, ticked.advisory.hazard) == ("SPEAK", "closing_lead")
    assert ticked.advisory.urgency == "warning"
    assert ticked.request.lead is not None
    assert drive.target_mps < 50 * KMH


def test_an_advisory_tells_what_its_target_is_for() -> None:
    drive = Drive()
    drive.ticks(3)
    assert drive.history[-1][2].advisory.target_why == "law"
    drive.tracks, drive.lead = (actor(8.0, 2.0),), 5
    drive.tick()
    assert drive.history[-1][2].advisory.target_why == "lead"


def test_a_person_stepping_out_is_braked_for() -> None:
    drive = Drive(speed_mps=13.0)
    drive.ticks(3)
    drive.tracks = (actor(35.0, 13.0, kind="pedestrian", y_m=3.0, vy_mps=-1.4, in_ego_path=False, length_m=0.5),)
    ticked = drive.tick()
    assert ticked.advisory.hazard == "pedestrian"
    assert drive.target_mps < 13.0


def test_what_keeps_its_distance_is_not_shouted_about_as_standing() -> None:
    """Part of the car ahead, read as a person who stands: it never comes nearer."""
    drive = Drive(speed_mps=15.0)
    drive.ticks(3)
    for _ in range(30):
        drive.tracks = (actor(16.0, 15.0, kind="pedestrian", length_m=0.5),)
        drive.tick()
    hazards = [
        t.advisory for _, _, t in drive.history if t.advisory.hazard == "pedestrian" and t.advisory.kind == "SPEAK"
    ]
    assert len(hazards) == 1, "said at once, and not again once it is seen through"
    assert drive.target_mps < 12.0, "the target stays careful"


@pytest.mark.parametrize("fields", [{"age_s": 0.1}, {"confidence": 0.2}, {"sigma_vx_mps": 8.0}, {"confidence": 0.1}])
def test_a_ghost_is_not_shouted_about(fields: dict[str, float]) -> None:
    drive = Drive(speed_mps=15.0)
    drive.ticks(3)
    drive.tracks, drive.lead = (actor(20.0, 12.0, **fields),), 5
    assert drive.tick().advisory.hazard == ""


def test_doubtful_news_of_better_weather_loosens_nothing() -> None:
    drive = Drive()
    drive.weather = conditions(mu=0.3, factor=0.6, wet=True)
    drive.ask.table = {**drive.ask.table, "assess_weather": lambda a: drive.weather}
    drive.ticks(3)
    before = drive.target_mps
    drive.weather = conditions(mu=0.9, factor=1.0, confidence=0.2)
    drive.ticks(3)
    assert drive.target_mps <= before
    drive.weather = conditions(mu=0.9, factor=1.0, confidence=0.9)
    drive.ticks(3)
    assert drive.target_mps > before


def test_a_red_light_lowers_the_target_down_to_a_stop() -> None:
    drive = Drive()
    drive.ticks(3)
    targets = []
    for distance in (60, 40, 20, 8, 4):
        drive.lines = (StopLine(distance_m=float(distance), kind="light"),)
        drive.tick(fact("light", "light:red", track_id=4, distance_m=float(distance)))
        targets.append(drive.target_mps)
    assert targets == sorted(targets, reverse=True)
    assert targets[-1] < 3.0
    drive.tick(fact("light", "light:green", track_id=4, distance_m=4.0))
    assert drive.target_mps == pytest.approx(50 * KMH)


def test_a_red_light_out_of_sight_is_still_red() -> None:
    drive = Drive(speed_mps=5.0)
    drive.lines = (StopLine(distance_m=40.0, kind="light"),)
    drive.tick(fact("light", "light:red", track_id=4, distance_m=40.0))
    drive.tracks = None
    before = drive.target_mps
    drive.ticks(20)
    assert drive.target_mps <= before


def test_an_unsure_green_grants_nothing() -> None:
    drive = Drive()
    drive.lines = (StopLine(distance_m=25.0, kind="light"),)
    drive.tick(fact("light", "light:red", track_id=4, distance_m=25.0))
    drive.tick(fact("light", "light:green", track_id=4, distance_m=25.0, confidence=0.4))
    drive.tick(fact("light", "light:green", track_id=4, distance_m=25.0, believed=False))
    assert drive.target_mps < 10.0


def test_the_first_notice_of_an_overspeed_comes_at_once_and_is_not_nagged() -> None:
    drive = Drive()
    drive.ticks(30)
    drive.speed_mps = 17.0
    drive.ticks(100)
    assert [text for text in drive.spoken() if text.startswith("Slow down")] == ["Slow down: limit 50 km/h"]


def after_a_sign(reading: str, drive: Drive, ticks: int = 70) -> list[str]:
    """What is spoken from that sign on."""
    before = len(drive.spoken())
    drive.tick(limit_sign(reading, track_id=len(drive.history)))
    drive.ticks(ticks)
    return drive.spoken()[before:]


def test_a_limit_below_the_speed_is_told_once_and_the_next_one_again() -> None:
    drive = Drive(speed_mps=90 * KMH, road="rural")
    drive.ticks(30)
    assert after_a_sign("limit:70", drive) == ["Slow down: limit 70 km/h"]
    drive.speed_mps = 65 * KMH
    assert after_a_sign("limit:60", drive) == ["Slow down: limit 60 km/h"]
    drive.speed_mps = 45 * KMH
    assert after_a_sign("limit:50", drive) == ["Limit 50 km/h"], "a restriction that nobody breaks is news all the same"


def test_a_limit_that_was_told_with_its_border_is_not_told_again() -> None:
    drive = Drive(speed_mps=40 * KMH)
    drive.ticks(70)
    before = len(drive.spoken())
    drive.tick(fact("jurisdiction", "NLD"), limit_sign("limit:45"))
    drive.ticks(70)
    assert drive.spoken()[before:] == ["Now NLD: limit 45 km/h"]


def test_the_overspeed_of_another_limit_is_a_first_notice_of_its_own_however_unsure_the_law_is() -> None:
    def unsure(arguments: dict[str, Any]) -> RulesAnswer:
        return replace(law_of(arguments), confidence=0.45)

    drive = Drive(Played({**EXPERTS, "applicable_limit": unsure}, arbiter=arbiter()), speed_mps=31.0, road="rural")
    drive.ticks(25)
    drive.speed_mps = 27.0
    drive.ticks(25)
    drive.tick(limit_sign("limit:80"))
    drive.ticks(25)
    told = [each for each in drive.spoken() if each.startswith("Slow down: limit")]
    assert told == ["Slow down: limit 100 km/h", "Slow down: limit 80 km/h"]


def test_an_overspeed_in_the_wet_tells_what_is_safe_with_the_limit() -> None:
    drive = Drive(speed_mps=90 * KMH, road="rural")
    drive.weather = conditions(mu=0.5, factor=0.8, wet=True)
    drive.ask.table = {**drive.ask.table, "assess_weather": lambda a: drive.weather}
    drive.ticks(30)
    assert after_a_sign("limit:70", drive) == ["Slow down: limit 70 km/h, drive 55 km/h"]


def test_who_slows_down_from_far_too_fast_hears_no_calmer_word_on_it() -> None:
    drive = Drive(speed_mps=90 * KMH, road="rural")
    drive.ticks(30)
    assert after_a_sign("limit:70", drive, 20) == ["Slow down: limit 70 km/h"]
    drive.speed_mps = 78 * KMH
    before = len(drive.spoken())
    drive.ticks(40)
    assert drive.spoken()[before:] == []
    drive.ticks(560)
    assert drive.spoken()[before:] == ["Slow down: limit 70 km/h"], "who goes on too fast is told again after a minute"


def test_the_driver_hears_german_and_miles_from_the_tick_in_which_he_asks_for_them() -> None:
    drive = Drive()
    drive.ticks(20)
    drive.tick(preferences=preferences(language="de", unit="mph"))
    drive.speed_mps = 17.0
    ticked = drive.tick()
    assert ticked.advisory.directive == "Langsamer: Limit 50 km/h (31 mph)"


def test_mute_silences_news_but_not_hazards() -> None:
    drive = Drive(speed_mps=7.0)
    drive.tick(preferences=preferences(muted=True))
    count = len(drive.spoken())
    drive.tick(limit_sign("limit:30"))
    drive.ticks(20)
    assert len(drive.spoken()) == count
    drive.tracks, drive.lead = (actor(12.0, 8.0),), 5
    assert drive.tick().advisory.kind == "SPEAK"


def test_a_doubted_sign_slows_down_gently_and_carries_its_candidates_into_the_query() -> None:
    drive = Drive(road="rural")
    drive.ticks(5)
    before = drive.target_mps
    drive.tick(doubted("limit:80", ("limit:60", 0.3), distance_m=60.0))
    query = next(call for call in drive.ask.calls if call.tool == "interpret_sign")
    assert [c["reading"] for c in query.arguments["candidates"]] == ["limit:80", "limit:60"]
    targets = [drive.target_mps]
    for _ in range(30):
        drive.tick(doubted("limit:80", ("limit:60", 0.3), distance_m=40.0))
        targets.append(drive.target_mps)
    steps = [a - b for a, b in zip([before, *targets], targets, strict=False)]
    assert max(steps) <= 0.7 * 0.1 + 1e-9
    assert targets[-1] == pytest.approx(before - 0.7 * 3.1, abs=0.05)


def test_in_bad_weather_a_doubt_comes_down_no_faster_and_is_scaled_once() -> None:
    drive = Drive(road="rural")
    drive.weather = conditions(mu=0.4, factor=0.7, wet=True)
    drive.ask.table = {**drive.ask.table, "assess_weather": lambda a: drive.weather}
    drive.ticks(5)
    targets = [drive.target_mps]
    for _ in range(150):
        drive.tick(doubted("limit:60", distance_m=40.0))
        targets.append(drive.target_mps)
    assert max(a - b for a, b in itertools.pairwise(targets)) <= 0.7 * 0.1 + 1e-9
    assert targets[0] == pytest.approx(70 * KMH)
    assert targets[-1] == pytest.approx(0.7 * 60 * KMH)


def test_a_doubt_that_no_such_road_can_have_lowers_nothing() -> None:
    drive = Drive(road="motorway")
    drive.ticks(5)
    before = drive.target_mps
    for _ in range(20):
        drive.tick(doubted("limit:10", confidence=0.4, candidates=()))
    assert drive.target_mps == pytest.approx(before)


def test_a_foreign_plate_is_explained_in_the_drivers_language() -> None:
    drive = Drive()
    drive.ticks(60)
    sign = limit_sign("limit:30", passed=False, scope="when_wet", plates=("plate:when_wet:de",), distance_m=40.0)
    drive.tick(sign)
    drive.ticks(12)
    assert "Sign: the sign limit:30" in drive.spoken()


@pytest.mark.parametrize(
    "decided",
    [
        {"kind": "SPEAK", "reason": "hazard: closing_lead"},
        {"kind": "SPEAK", "reason": "ACT withheld: no grant", "act_withheld": "no grant"},
        {"kind": "ACT", "reason": "U_act - U_speak = 0.3 > Delta = 0.2 and RSS is violated"},
    ],
)
def test_what_only_the_arbiter_sees_is_said_in_words(decided: dict[str, Any]) -> None:
    drive = Drive()
    local = drive.tick().decision
    told_before = drive.state.memory
    drive.ask.decide = lambda request: replace(
        local, tick=request.tick, hazard="closing_lead", profile="calibrated", **decided
    )
    ticked = drive.tick()
    assert ticked.fused.topic == "limit"
    assert (ticked.advisory.directive, ticked.advisory.hazard) == ("Brake: vehicle close ahead", "closing_lead")
    assert ticked.advisory.urgency == ("alarm" if "act_withheld" in decided else "warning")
    assert ticked.state.memory.hazards == told_before.hazards + 1


@pytest.mark.parametrize(
    ("y_m", "vy_mps", "directive"),
    [
        (-18.0, 7.0, "Brake: vehicle from the right"),
        (18.0, -7.0, "Brake: vehicle from the left"),
        (2.0, 7.0, "Brake: vehicle close ahead"),  # it is through, and its tail is not
        (-4.0, 1.0, "Brake: vehicle close ahead"),  # it changes lanes
    ],
)
def test_who_drives_across_our_way_is_told_with_the_side_he_comes_from(
    y_m: float, vy_mps: float, directive: str
) -> None:
    drive = Drive(speed_mps=12.0)
    drive.ticks(20)
    speed_mps = 0.0 if abs(vy_mps) > 2.0 else 4.0
    for _ in range(4):
        drive.tracks = (actor(gap_m=25.0, closing_mps=12.0 - speed_mps, y_m=y_m, vy_mps=vy_mps),)
        drive.tick()
    told = next(t.advisory for _, _, t in drive.history if t.advisory.hazard and t.advisory.kind == "SPEAK")
    assert (told.directive, told.topic, told.hazard) == (directive, "lead", "closing_lead")


def test_a_first_notice_is_owed_until_it_is_spoken() -> None:
    drive = Drive()
    drive.speed_mps = 20.0
    drive.ask.decide = lambda request: replace(
        decide_locally(request), kind="SPEAK", hazard="closing_lead", profile="calibrated"
    )
    shouted = drive.ticks(60)
    assert shouted.fused.first_notice
    assert not any("over" in text.lower() for text in drive.spoken())
    drive.ask.decide = lambda request: None
    assert "50 km/h" in drive.tick().advisory.directive
    assert drive.tick().fused.first_notice is False


def test_without_the_arbiter_there_is_no_act() -> None:
    drive = Drive()
    drive.tracks, drive.lead = (actor(3.0, 12.0),), 5
    ticked = drive.tick()
    assert ticked.decision.profile == "local"
    assert ticked.decision.kind == "SPEAK"


def test_a_decision_on_another_tick_does_not_count() -> None:
    drive = Drive()
    other = drive.tick().decision
    drive.ask.decide = lambda request: msgspec.structs.replace(other, kind="ACT", profile="calibrated")
    assert drive.tick().decision.profile == "local"


def test_the_drive_runs_again_from_its_records_to_the_last_bit() -> None:
    drive = Drive(speed_mps=14.0)
    drive.tick(limit_sign("limit:30"))
    drive.weather = conditions(mu=0.4, factor=0.8, wet=True)
    drive.ticks(5)
    drive.tracks, drive.lead = (actor(20.0, 6.0),), 5
    drive.tick(doubted("limit:50", ("limit:60", 0.4)))
    drive.tick(end_sign("all_end"), query="Why?")
    drive.ask.table = {}
    drive.ticks(10)
    state = State()
    for _, seen, ticked in drive.history:
        record = trace_of(ticked, seen, {}, ticked.advisory, whole=True)
        wire = msgspec.json.decode(msgspec.json.encode(record), type=TraceRecord)
        again = redecide(state, wire)
        assert again.differences == ()
        assert state_of(wire) == again.ticked.state
        state = again.ticked.state
    assert digest(state) == digest(drive.state)


def test_a_changed_record_does_not_run_to_the_same_end() -> None:
    drive = Drive()
    before, seen, ticked = drive.history[-1]
    record = trace_of(ticked, seen, {}, ticked.advisory, whole=False)
    outcome = record.calls[0]
    result = {**(outcome.result or {}), "limit": {"value": 80, "unit": "km/h", "mps": 80 * KMH, "advisory": False}}
    forged = msgspec.structs.replace(record, calls=(msgspec.structs.replace(outcome, result=result),))
    assert "fused" in redecide(before, forged).differences


def test_the_watchdogs_tick_is_degraded_and_no_less_careful() -> None:
    drive = Drive()
    drive.tick(limit_sign("limit:30"))
    before = drive.target_mps
    for _ in range(50):
        ticked = drive.tick(cause="watchdog", tracks=None, ego=None, road=None, unhealthy=("perception/tracks",))
    assert "snapshot" in ticked.advisory.degraded
    assert ticked.world.ego.speed_mps is None
    assert ticked.world.actors is None
    assert drive.target_mps <= before


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
    drive.speed_mps = 0.0
    for _ in range(waited_s):
        drive.now_ns += 9 * TICK
        drive.tick(fact("light", "light:red", track_id=4, distance_m=15.0))
    drive.tick(fact("light", "light:green", track_id=4, distance_m=15.0))
    drive.tick(fact("light", "light:green", track_id=4, distance_m=15.0))
    assert any("Green" in text for text in drive.spoken()[1:]) is told

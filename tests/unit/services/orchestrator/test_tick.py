"""The tick end to end in pure form."""

import itertools

import msgspec
import pytest

from proto.decision import TraceRecord
from proto.rules import VehicleFacts
from proto.sensors import StopLine
from services.orchestrator.state import State, digest
from services.orchestrator.tick import redecide, state_of, trace_of
from tests.unit.services.orchestrator.support import (
    EXPERTS,
    KMH,
    Drive,
    Played,
    actor,
    conditions,
    doubted,
    end_sign,
    fact,
    limit_answer,
    limit_sign,
    preferences,
)


def test_the_law_bounds_the_target_and_is_shown_and_a_lower_one_is_said_once() -> None:
    drive = Drive(speed_mps=9.5)
    drive.ticks(30)
    assert drive.target_mps == pytest.approx(50 * KMH)
    assert drive.spoken() == []
    drive.tick(limit_sign("limit:30"))
    drive.ticks(30)
    assert drive.spoken() == ["Limit 30"]


def test_rain_recommends_less_than_the_law_allows_and_both_are_among_the_reasons() -> None:
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


@pytest.mark.parametrize(
    ("least", "most", "level", "disagree", "told"),
    [
        (0.35, 0.75, "high", False, True), (0.35, 0.93, "high", False, False), (0.35, 0.93, "severe", False, True),
        (0.28, 0.93, "high", False, True), (0.35, 0.93, "high", True, True),
    ],
)  # fmt: skip
def test_rain_under_which_the_road_may_be_as_good_as_dry_is_shown_and_not_spoken_of(
    least: float, most: float, level: str, disagree: bool, told: bool
) -> None:
    drive = Drive(speed_mps=14.0)
    drive.weather = conditions(mu_low=least, mu_high=most, factor=0.7, wet=True, risk_level=level, disagree=disagree)
    drive.ask.table = {**drive.ask.table, "assess_weather": lambda a: drive.weather}
    drive.ticks(80)
    assert any("Water" in said for said in drive.spoken()) is told
    assert drive.target_mps == pytest.approx(35 * KMH)


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
    assert drive.history[-1][2].assistance.limit == advised
    assert not any("130" in text for text in drive.spoken())


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


def test_a_doubted_sign_slows_down_gently_and_carries_its_candidates_into_the_query() -> None:
    drive = Drive(road="rural")
    drive.ticks(5)
    before = drive.target_mps
    drive.tick(doubted("limit:80", ("limit:60", 0.3), distance_m=60.0))
    query = next(call for call in drive.ask.calls if call.tool == "interpret_sign")
    assert [c["reading"] for c in query.arguments["candidates"]] == ["limit:80", "limit:60"]
    assert query.arguments["vehicle_class"] == "car"
    targets = [drive.target_mps]
    for _ in range(30):
        drive.tick(doubted("limit:80", ("limit:60", 0.3), distance_m=40.0))
        targets.append(drive.target_mps)
    steps = [a - b for a, b in zip([before, *targets], targets, strict=False)]
    assert max(steps) <= 0.7 * 0.1 + 1e-9
    assert targets[-1] == pytest.approx(before - 0.7 * 3.1, abs=0.05)


def test_a_sign_is_asked_for_the_drivers_class_of_vehicle() -> None:
    drive = Drive(road="rural", preferences=preferences(vehicle=VehicleFacts(vehicle_class="lorry")))
    drive.tick(doubted("limit:80", ("limit:60", 0.3), distance_m=60.0))
    (query,) = [call for call in drive.ask.calls if call.tool == "interpret_sign"]
    assert query.arguments["vehicle_class"] == "lorry"


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

"""Pictures and speed tell of the kind of road; nothing that is spoken or acts rests on it, and only an assumed limit goes out of sight."""

from unittest.mock import patch

import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.observed import Observed
from proto.perception import Track
from proto.rules import LegalLimit
from proto.scene import Fact
from services.orchestrator.tick import Ticked
from services.orchestrator.world import observe
from services.orchestrator.world.road_kind import (
    CUES,
    FAST_NS,
    KINDS,
    MANY_LANES,
    assumed,
    evidence,
    fast_since,
    shares,
)
from tests.unit.services.orchestrator.judge import arbiter
from tests.unit.services.orchestrator.scenes import leads, next_seen, one
from tests.unit.services.orchestrator.support import (
    EXPERTS,
    FEW,
    SECOND,
    TICK,
    Drive,
    Played,
    actor,
    conditions,
    end_sign,
    fact,
    limit_answer,
    replace,
)

NOW = 1000 * SECOND
FREEWAY = (
    actor(25.0, closing_mps=-3.0, y_m=7.0, track_id=1, age_s=3.0),
    actor(15.0, closing_mps=-2.5, y_m=3.5, track_id=2, age_s=3.0),
)  # fmt: skip


def assumed_50(arguments: object) -> object:
    return replace(limit_answer(50), limit=LegalLimit(value=50, unit="km/h", mps=50 / 3.6, assumed=True))


def lost(speed_mps: float | None = 12.0) -> Drive:
    """A drive on a road that neither a sign nor a map tells of, watched for long enough."""
    ask = Played({**EXPERTS, "applicable_limit": assumed_50}, arbiter=arbiter())
    drive = Drive(ask, road="unknown")
    drive.comes_to(speed_mps)
    drive.ticks(40)
    return drive


def found(*tracks: Track, speed_mps: float | None = None, facts: tuple[Fact, ...] = ()) -> tuple[Observed[str], ...]:
    return evidence((), facts, tracks, speed_mps, None, NOW)


def names(each: tuple[Observed[str], ...]) -> set[str]:
    return {one.value for one in each}


def shown(drive: Drive) -> LegalLimit | None:
    return drive.history[-1][2].advisory.legal_limit


# -- what is told ------------------------------------------------------------------------------------------------------


def test_vehicles_that_pull_away_two_lanes_aside_tell_of_many_lanes_though_the_speed_is_unknown() -> None:
    (lanes,) = found(*FREEWAY)
    assert (lanes.value, lanes.source, lanes.stamp_ns) == ("lanes", "perception", NOW)


@pytest.mark.parametrize(
    "changed", [{"vx_mps": 0.0}, {"x_m": 60.0}, {"confidence": 0.5}, {"age_s": 1.0}, {"vy_mps": 3.0}]
)
def test_what_may_be_parked_far_doubtful_or_crossing_tells_of_no_lane(changed: dict[str, float]) -> None:
    assert not found(*(replace(each, **changed) for each in FREEWAY))


def test_parked_cars_on_both_sides_of_a_street_are_no_lanes() -> None:
    parked = tuple(replace(each, vx_mps=-12.0) for each in FREEWAY)
    assert not found(*parked, speed_mps=12.0)


@given(gap=st.floats(0.0, 30.0))
def test_fewer_lanes_than_many_are_not_told(gap: float) -> None:
    aside = min(gap, (MANY_LANES - 1.6) * 3.5)
    assert not found(replace(FREEWAY[0], y_m=aside))


def test_people_and_oncoming_vehicles_nearby_speak_against_a_motorway() -> None:
    person = actor(20.0, kind="pedestrian", age_s=3.0)
    oncoming = actor(20.0, closing_mps=25.0, y_m=3.5, age_s=3.0, oncoming=True)
    assert names(found(person, oncoming)) == {"person", "oncoming"}
    assert not found(replace(oncoming, y_m=12.0))
    assert shares(found(person))["motorway"] < 0.1


def test_doubted_boards_tell_and_doubted_lights_do_not() -> None:
    doubted = {"believed": False, "confidence": 0.5}
    told = found(facts=(fact("sign", "motorway", **doubted), fact("light", "light:red", **doubted)))
    assert [(each.value, each.confidence, each.source) for each in told] == [("motorway", 0.5, "drivelm")]


def test_text_and_numbers_that_are_no_readings_tell_nothing() -> None:
    nan = fact("sign", "motorway", confidence=float("nan"))
    assert not found(facts=(fact("sign", "MOTORWAY AHEAD"), fact("message", "motorway"), nan))


def test_a_flow_is_fast_once_ego_and_all_others_were_so_for_long_enough() -> None:
    since: int | None = None
    for at in range(0, FAST_NS + TICK, TICK):
        since = fast_since(since, 30.0, (actor(40.0, closing_mps=8.0),), NOW + at)
        told = names(evidence((), (), (), 30.0, since, NOW + at))
        assert told == ({"flow"} if at >= FAST_NS else set())


@pytest.mark.parametrize("speed_mps", [None, 24.0])
def test_a_slow_or_unknown_ego_is_no_fast_flow(speed_mps: float | None) -> None:
    assert fast_since(NOW, speed_mps, (), NOW + 30 * SECOND) is None


def test_a_vehicle_that_is_surely_slow_ends_the_fast_flow_and_a_parked_or_oncoming_one_does_not() -> None:
    assert fast_since(NOW, 30.0, (actor(40.0, closing_mps=15.0),), NOW + 1) is None
    assert fast_since(NOW, 30.0, (actor(40.0, closing_mps=15.0, sigma_vx_mps=4.0),), NOW + 1) == NOW
    for closing_mps in (30.0, 60.0):
        assert fast_since(NOW, 30.0, (actor(40.0, closing_mps=closing_mps),), NOW + 1) == NOW


# -- what follows ------------------------------------------------------------------------------------------------------


def observed(code: str, confidence: float = 1.0) -> Observed[str]:
    return Observed(value=code, confidence=confidence, source="derived", stamp_ns=NOW, valid_for_ns=SECOND)


@pytest.mark.parametrize(
    ("codes", "kind"),
    [
        (("flow", "lanes"), "motorway"), (("motorway",), "motorway"), (("town_entry",), "urban"), (("light",), "urban"),
        (("lanes",), "unknown"), (("flow",), "unknown"), (("motorway", "motorway_end"), "unknown"),
        (("lanes", "light", "motorway"), "unknown"), (("oncoming",), "unknown"),
    ],
)  # fmt: skip
def test_weak_or_contradictory_evidence_gives_unknown(codes: tuple[str, ...], kind: str) -> None:
    told = assumed(tuple(map(observed, codes)))
    assert told is not None
    assert told.value == kind


def test_without_evidence_no_kind_is_assumed() -> None:
    assert assumed(()) is None


@given(st.dictionaries(st.sampled_from(sorted(CUES)), st.floats(0.0, 1.0)))
def test_shares_are_shares(cues: dict[str, float]) -> None:
    by_kind = shares(tuple(observed(*each) for each in cues.items()))
    assert set(by_kind) == set(KINDS)
    assert sum(by_kind.values()) == pytest.approx(1.0)


def test_evidence_is_forgotten_when_it_is_old_or_from_the_future() -> None:
    before = found(*FREEWAY)
    assert evidence(before, (), (), None, None, NOW + 29 * SECOND) == before
    assert not evidence(before, (), (), None, None, NOW + 30 * SECOND)
    assert not evidence(before, (), (), None, None, NOW - 1)


# -- what is shown -----------------------------------------------------------------------------------------------------


def test_an_assumed_limit_goes_out_of_sight_where_many_lanes_go_our_way() -> None:
    drive = lost(None)
    assert shown(drive) is not None
    drive.tracks = FREEWAY
    drive.tick()
    assert shown(drive) is None
    told = drive.state.world.environment.assumed_road
    assert told is not None
    assert (told.value, told.evidence) == ("unknown", "lanes")


def test_a_fast_flow_in_many_lanes_is_assumed_to_be_a_motorway() -> None:
    drive = lost(30.0)
    drive.tracks = FREEWAY
    drive.ticks(220)
    told = drive.state.world.environment.assumed_road
    assert told is not None
    assert told.value == "motorway"
    assert shown(drive) is None
    assert drive.state.road == "", "an assumption is not the road"


def test_no_assumed_limit_is_shown_before_the_road_was_watched() -> None:
    drive = lost()
    limits = [ticked.advisory.legal_limit for _, _, ticked in drive.history]
    assert limits[:29] == [None] * 29
    assert all(limit is not None and limit.assumed for limit in limits[30:])


def test_a_sign_that_was_passed_tells_the_road_and_evidence_no_longer_counts() -> None:
    drive = lost(None)
    drive.tracks = FREEWAY
    drive.ticks(5)
    drive.ask.table = EXPERTS
    drive.tick(end_sign("town_entry:yellow"))
    drive.ticks(5)
    environment = drive.state.world.environment
    assert (environment.road_evidence, environment.assumed_road) == ((), None)
    assert shown(drive) is not None


def test_a_map_tells_the_road_and_evidence_does_not_count() -> None:
    drive = Drive(speed_mps=30.0, road="unknown")
    drive.road, drive.tracks = "urban", FREEWAY
    drive.tick()
    assert drive.state.world.environment.assumed_road is None


def _parts(ticked: Ticked) -> tuple[object, ...]:
    """All that is spoken, acts or is remembered, without the limit that is shown."""
    memory = replace(ticked.state, world=replace(ticked.world, environment=replace(
        ticked.world.environment, road_evidence=(), assumed_road=None
    )))  # fmt: skip
    advisory, fused = replace(ticked.advisory, legal_limit=None), replace(ticked.fused, legal_limit=None)
    request = replace(ticked.request, fused=fused)
    return memory, advisory, fused, request, ticked.decision, ticked.calls, ticked.events


BOARDS = st.builds(
    fact,
    st.just("sign"),
    st.sampled_from(
        ("motorway", "expressway", "info:interstate", "motorway_end", "town_entry:yellow", "stop", "crossing")
    ),
    track_id=st.integers(10, 14),
    believed=st.booleans(),
    confidence=st.floats(0.0, 1.0),
    passed=st.booleans(),
    distance_m=st.none() | st.floats(0.0, 80.0),
)


@FEW
@given(
    speed_mps=st.none() | st.floats(0.0, 50.0),
    mu=st.floats(0.05, 0.9),
    others=st.lists(leads(), max_size=3),
    aside=st.lists(st.floats(-12.0, 12.0), min_size=3, max_size=3),
    boards=st.lists(BOARDS, max_size=3),
    before=st.dictionaries(st.sampled_from(sorted(CUES)), st.floats(0.0, 1.0)),
    fast=st.booleans(),
)
def test_with_evidence_nothing_is_spoken_or_done_that_is_not_without_it_and_at_most_an_assumed_limit_is_hidden(
    speed_mps: float | None,
    mu: float,
    others: list[Track],
    aside: list[float],
    boards: list[Fact],
    before: dict[str, float],
    fast: bool,
) -> None:
    drive = lost(speed_mps)
    drive.weather = conditions(mu=mu, factor=0.4 + 0.6 * mu, wet=True)
    drive.tracks = tuple(
        replace(t, track_id=20 + n, y_m=y, age_s=3.0) for n, (t, y) in enumerate(zip(others, aside, strict=False))
    )
    evident = tuple(
        replace(observed(*each), stamp_ns=drive.now_ns, valid_for_ns=60 * SECOND) for each in before.items()
    )
    environment = replace(drive.state.world.environment, road_evidence=evident)
    since = drive.now_ns - 2 * FAST_NS if fast else None
    drive.state = replace(drive.state, world=replace(drive.state.world, environment=environment), fast_since_ns=since)
    seen = next_seen(drive, *boards)
    ask = Played(drive.ask.table, arbiter=arbiter())
    with patch.object(observe, "evidence", lambda *each: ()):
        without = one(drive, seen, Played(drive.ask.table, arbiter=arbiter()))
    with_it = one(drive, seen, ask)
    assert _parts(with_it) == _parts(without)
    limit, today = with_it.advisory.legal_limit, without.advisory.legal_limit
    assert limit == today or (limit is None and today is not None and today.assumed)

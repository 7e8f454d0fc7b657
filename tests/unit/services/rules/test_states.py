"""The United States: a base that no state has alone, and each state's law on it."""

from typing import Any, get_args

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from domain.units import to_mps
from drivemcp.paths import data
from proto.rules import PostedLimit, RightOfWayQuestion, RulesAnswer, Situation, VehicleClass
from services.rules.book import load_book
from services.rules.limits.limit_answer import applicable_limit
from services.rules.lookup.rule_lookup import lookup_rule
from services.rules.right_of_way import right_of_way
from services.rules.signs.meaning import SignQuestion, careful_rank, interpret_sign
from services.rules.words import part

BOOK, REFUSED = load_book([*sorted(data("rulepacks").glob("USA-*v1")), data("rulepacks/VIENNA-v1")])
STATES = sorted({p.manifest.jurisdiction for p in BOOK.packs.values() if p.manifest.jurisdiction.startswith("USA-")})
ROADS = ("urban", "rural", "dual_carriageway", "expressway", "motorway", "living_street")
LIMITS = {  # by road as in ROADS: without a sign, the number of the road unknown
    "USA": (25, 50, 50, 50, 55, 15),
    "USA-CA": (25, 55, 65, 55, 65, 15),
    "USA-NY": (25, 55, 55, 55, 55, 15),
    "USA-TX": (30, 60, 60, 60, 60, 15),
    "USA-FL": (30, 55, 55, 55, 55, 15),
    "USA-WA": (25, 50, 50, 50, 60, 15),
}
LOWER = {  # what a class is held to whatever a sign shows
    "USA": {"car_trailer": 55, "van_trailer": 55, "lorry": 55, "lorry_trailer": 55, "lorry_light": 60},
    "USA-CA": {"car_trailer": 55, "van_trailer": 55, "lorry": 55, "lorry_trailer": 55},
    "USA-WA": {"car_trailer": 60, "van_trailer": 60, "lorry_light": 60, "lorry": 60, "lorry_trailer": 60},
}
HIGHEST = {"USA": 65, "USA-CA": 70, "USA-NY": 65, "USA-TX": 85, "USA-FL": 70, "USA-WA": 75}
CLASSES = tuple(each for each in get_args(VehicleClass) if each != "car_snow_chains")
FAIR = Situation(wet=False, snow=False, visibility_m=300.0, home_unit="mph")
SITUATIONS = st.builds(
    Situation,
    road_type=st.sampled_from([*ROADS, None]),
    vehicle_class=st.sampled_from([*CLASSES, None]),
    road_name=st.sampled_from([None, "I 10", "US 290", "SR 20", "FM 1960", "Main Street"]),
    snow_chains=st.sampled_from([True, False, None]),
    novice=st.booleans(),
    time_of_day_h=st.sampled_from([None, 3.0, 12.0]),
    posted=st.lists(
        st.builds(
            PostedLimit,
            value=st.sampled_from([15.0, 25.0, 45.0, 65.0, 70.0, 75.0, 85.0]),
            unit=st.just("mph"),
            scope=st.sampled_from(["permanent", "gantry", "temporary", "when_wet"]),
            confidence=st.floats(0.0, 1.0),
        ),
        max_size=2,
    ).map(tuple),
    wet=st.sampled_from([True, False, None]),
)


def ask(place: str, **facts: Any) -> RulesAnswer:
    return applicable_limit(BOOK, msgspec.structs.replace(FAIR, jurisdiction=place, **facts))


def mps(answer: RulesAnswer) -> float:
    return answer.limit.mps if answer.limit else float("inf")


def test_every_state_stands_on_the_base() -> None:
    assert REFUSED == ()
    assert {"USA", *STATES} == set(LIMITS)
    for place in STATES:
        (pack,) = BOOK.for_jurisdiction(place)
        assert pack.family == (f"{place}-v1", "USA-v1")


@pytest.mark.parametrize("place", LIMITS)
@pytest.mark.parametrize("vehicle", CLASSES)
def test_the_limit_by_road_and_class_where_no_sign_stands(place: str, vehicle: Any) -> None:
    most = LOWER.get(place, {}).get(vehicle, 99)
    found = [ask(place, road_type=road, vehicle_class=vehicle).limit for road in ROADS]
    assert [(limit.value, limit.unit) for limit in found if limit] == [(min(v, most), "mph") for v in LIMITS[place]]


@pytest.mark.parametrize("place", LIMITS)
@pytest.mark.parametrize("shown", [55, 65, 70, 75, 80, 85])
def test_no_sign_lifts_a_limit_above_the_highest_that_the_law_lets_post(place: str, shown: int) -> None:
    sign = PostedLimit(value=shown, unit="mph")
    limit = ask(place, road_type="motorway", posted=(sign,)).limit
    assert limit is not None
    assert limit.value == min(shown, HIGHEST[place])


@settings(max_examples=200, deadline=None)
@given(SITUATIONS)
def test_with_the_state_unknown_no_more_is_allowed_than_in_any_state(situation: Situation) -> None:
    unknown = applicable_limit(BOOK, msgspec.structs.replace(situation, jurisdiction="USA"))
    base = BOOK.packs["USA-v1"]
    alone = msgspec.structs.replace(BOOK, packs={"USA-v1": base})
    by_base = applicable_limit(alone, msgspec.structs.replace(situation, jurisdiction="USA"))
    for place in STATES:
        there = mps(applicable_limit(BOOK, msgspec.structs.replace(situation, jurisdiction=place)))
        assert mps(unknown) <= there
        assert mps(by_base) <= there


def test_with_the_state_unknown_the_base_answers_in_doubt_and_says_where_it_would_be_higher() -> None:
    answer = ask("USA", road_type="motorway")
    assert answer.rulepack_version.startswith("USA-v1@")
    assert answer.confidence <= 0.6
    assert "jurisdiction" in answer.degraded
    assert "higher in" in answer.note
    for place in STATES:
        assert (part(BOOK, place, "en") in answer.note) is (mps(ask(place, road_type="motorway")) > mps(answer))
        assert place not in answer.note.rpartition("higher in")[2]
    assert "higher" not in ask("USA", road_type="motorway", posted=(PostedLimit(value=30, unit="mph"),)).note


def test_the_base_is_no_law_by_itself() -> None:
    assert not BOOK.covers("USA")
    assert BOOK.for_jurisdiction("USA-NV") == BOOK.for_jurisdiction("USA")
    assert next(pack.manifest.id for pack in BOOK.for_jurisdiction("USA")) == "USA-v1"
    junction = right_of_way(BOOK, RightOfWayQuestion(jurisdiction="USA", light="red", pedestrians_on_crossing=False))
    assert (junction.legal_action, junction.degraded) == ("stop", ("jurisdiction",))
    assert interpret_sign(BOOK, SignQuestion(reading="stop", jurisdiction="USA")).rulepack_version.startswith("USA-v1@")


@pytest.mark.parametrize("place", STATES)
def test_a_state_inherits_no_limit_but_of_alleys_and_chains(place: str) -> None:
    (pack,) = BOOK.for_jurisdiction(place)
    inherited = {provision.id for provision, _ in pack.limits if pack.origin[provision.id].startswith("USA-v1@")}
    assert inherited <= {"usa-speed-alley", "usa-guide-chains"}


@pytest.mark.parametrize("place", STATES)
def test_a_sign_of_the_base_cites_the_states_own_law(place: str) -> None:
    meaning = interpret_sign(BOOK, SignQuestion(reading="stop", jurisdiction=place))
    cited = [citation.provision for citation in meaning.citations]
    assert f"{place.lower()}-stop-then-yield" in cited
    assert "usa-stop-then-yield" not in cited
    assert meaning.national_code == "R1-1"


@pytest.mark.parametrize("place", STATES)
@pytest.mark.parametrize("code", sorted(BOOK.packs["USA-v1"].signs))
def test_every_sign_of_the_base_means_in_a_state_no_less(place: str, code: str) -> None:
    reading = f"{code}:30" if code in ("limit", "school_limit", "led", "minimum") else code
    base = interpret_sign(BOOK, SignQuestion(reading=reading, jurisdiction="USA"))
    there = interpret_sign(BOOK, SignQuestion(reading=reading, jurisdiction=place))
    assert careful_rank(there.legal_action) <= careful_rank(base.legal_action)
    assert there.confidence > base.confidence


def test_a_question_in_a_state_is_answered_from_its_own_law() -> None:
    for place in STATES:
        found = lookup_rule(BOOK, "school bus stop flashing red lights", place, "en", None, 3)
        assert f"{place}-v1" in {citation.document.partition("/")[0] for citation in found.citations}
        assert not {c.document.partition("/")[0] for c in found.citations} - {f"{place}-v1", "USA-v1"}


def test_every_limit_is_in_miles() -> None:
    for pack in (pack for pack in BOOK.packs.values() if pack.manifest.jurisdiction.startswith("USA")):
        assert pack.manifest.units == "mph"
        assert all(effect.unit == "mph" and to_mps(effect.value, "mph") < 40 for _, effect in pack.limits)

"""Where the country is unknown, or no pack is loaded for it: the most careful of all, and the Conventions cited."""

import time
from collections.abc import Sequence
from typing import Any

import msgspec
import pytest

from drivemcp.files.packfiles import folder_of
from drivemcp.testing import TestBus, bus
from proto.rules import PostedLimit, RightOfWayQuestion, RulesAnswer, Situation
from services.rules.book import RuleBook, is_fallback, load_book
from services.rules.limits.limit_answer import applicable_limit
from services.rules.lookup.rule_lookup import lookup_rule
from services.rules.right_of_way import right_of_way
from services.rules.service import SERVICE, RulesConfig
from services.rules.signs.meaning import SignQuestion, careful_rank, interpret_sign

BOOK, REFUSED = load_book([folder_of(name) for name in RulesConfig().packs])
NOWHERE = [None, "PRT"]
ROADS = ("urban", "rural", "motorway", "dual_carriageway", "expressway", "living_street", None)


def packs_of(citations: Any) -> list[str]:
    return [citation.document.partition("/")[0] for citation in citations]


def known() -> list[str]:
    return sorted({pack.manifest.jurisdiction for pack in BOOK.packs.values()} - {"XXX"})


def test_all_national_packs_are_loaded_by_default() -> None:
    assert REFUSED == ()
    assert {
        "DEU",
        "GBR",
        "FRA",
        "AUT",
        "NLD",
        "POL",
        "CHE",
        "BEL",
        "IRL",
        "ITA",
        "ESP",
        "USA",
        "USA-CA",
        "USA-WA",
        "USA-FL",
        "USA-TX",
        "USA-NY",
    } == set(known())
    assert [name for name, pack in BOOK.packs.items() if is_fallback(pack)] == ["VIENNA-v1"]
    assert "TEST-v1" not in BOOK.packs


@pytest.mark.parametrize("here", NOWHERE)
@pytest.mark.parametrize("road", ROADS)
def test_no_limit_is_above_any_countrys_and_the_fallback_is_cited(here: str | None, road: Any) -> None:
    situation = Situation(jurisdiction=here, road_type=road, wet=False, snow=False, visibility_m=300.0)
    answer = applicable_limit(BOOK, situation)
    assert answer.limit is not None
    for country in known():
        theirs = applicable_limit(BOOK, msgspec.structs.replace(situation, jurisdiction=country)).limit
        assert theirs is None or answer.limit.mps <= theirs.mps
    assert "VIENNA-v1" in packs_of(answer.citations)[:3]
    assert answer.confidence <= 0.3
    assert "jurisdiction" in answer.degraded


@pytest.mark.parametrize("here", NOWHERE)
@pytest.mark.parametrize("reading", ["stop", "limit:50", "motorway", "town_entry", "right_before_left", "national"])
def test_a_sign_means_the_most_careful_of_what_it_means_anywhere(here: str | None, reading: str) -> None:
    meaning = interpret_sign(BOOK, SignQuestion(reading=reading, jurisdiction=here))
    for country in known():
        theirs = interpret_sign(BOOK, SignQuestion(reading=reading, jurisdiction=country))
        assert careful_rank(meaning.legal_action) <= careful_rank(theirs.legal_action)
    assert meaning.confidence <= 0.3
    assert "most careful of" in meaning.note
    if reading != "national":  # no sign of the Conventions
        assert "VIENNA-v1" in packs_of(meaning.citations)


def test_a_number_without_a_country_is_taken_in_the_lower_unit() -> None:
    limit = interpret_sign(BOOK, SignQuestion(reading="limit:50")).limit
    assert limit is not None
    assert (limit.value, limit.unit) == (50, "km/h")


@pytest.mark.parametrize("here", NOWHERE)
def test_at_a_junction_the_most_careful_counts_and_the_fallback_is_cited(here: str | None) -> None:
    answer = right_of_way(BOOK, RightOfWayQuestion(jurisdiction=here, pedestrians_on_crossing=False))
    assert answer.legal_action == "yield"
    assert "VIENNA-v1" in packs_of(answer.citations)[:2]
    assert answer.confidence <= 0.3


@pytest.mark.parametrize(
    ("language", "word"), [("en", "most careful"), ("de", "Vorsichtigste"), ("fr", "plus prudent")]
)
def test_it_is_said_in_the_drivers_language(language: str, word: str) -> None:
    for here in NOWHERE:
        assert word in applicable_limit(BOOK, Situation(jurisdiction=here, language=language)).note
        assert word in right_of_way(BOOK, RightOfWayQuestion(jurisdiction=here, language=language)).note
        assert word in interpret_sign(BOOK, SignQuestion(reading="stop", jurisdiction=here, language=language)).note


def test_a_lookup_without_a_country_is_little_trusted() -> None:
    sure = lookup_rule(BOOK, "speed limit on motorways", "AUT", "en", None, 3)
    doubted = lookup_rule(BOOK, "speed limit on motorways", None, "en", None, 3)
    part = lookup_rule(BOOK, "maximum speed limit on highways", "USA", "en", None, 3)
    assert doubted.confidence < sure.confidence
    assert "jurisdiction" in doubted.degraded
    assert "jurisdiction" in part.degraded


def test_a_state_without_a_pack_is_not_answered_with_anothers_law_alone() -> None:
    town = Situation(road_type="urban", wet=False, snow=False, visibility_m=300.0)
    answers = {
        place: applicable_limit(BOOK, msgspec.structs.replace(town, jurisdiction=place))
        for place in ("USA-CA", "USA", "USA-NV")
    }
    assert answers["USA"].limit == answers["USA-CA"].limit
    assert answers["USA-CA"].confidence > answers["USA"].confidence >= answers["USA-NV"].confidence
    there, here = answers["USA"].limit, answers["USA-NV"].limit
    assert there is not None
    assert here == msgspec.structs.replace(there, assumed=True)
    assert "No rulepack for this part" in answers["USA-NV"].note
    sign = PostedLimit(reading="limit:35", value=35, unit="mph", scope="permanent", confidence=0.99)
    signed = applicable_limit(BOOK, msgspec.structs.replace(town, jurisdiction="USA-NV", posted=(sign,))).limit
    assert signed is not None
    assert (signed.value, signed.unit) == (35, "mph")
    junction = RightOfWayQuestion(jurisdiction="USA", light="red", pedestrians_on_crossing=False)
    assert right_of_way(BOOK, junction).degraded == ("jurisdiction",)


def test_an_answer_from_all_packs_costs_hardly_more_than_their_own_answers() -> None:
    assert spent_s([None]) < 2.0 * spent_s(known())


def spent_s(countries: Sequence[str | None]) -> float:
    """Processor time of one question to each country; the least of twenty, since other work disturbs."""
    posted = tuple(PostedLimit(value=value, unit="km/h") for value in (50, 70, 90))
    spent = []
    for at in range(20):
        begin = time.process_time()
        for country in countries:
            applicable_limit(
                BOOK, Situation(jurisdiction=country, road_type="rural", posted=posted, visibility_m=100.0 + at)
            )
        spent.append(time.process_time() - begin)
    return min(spent)


def test_over_the_bus_it_is_answered_in_time() -> None:
    with bus() as b:
        b.start(SERVICE)
        answer = limit(b, {"road_type": "rural"})
        assert "VIENNA-v1" in packs_of(answer.citations)


def limit(b: TestBus, situation: dict[str, Any]) -> RulesAnswer:
    outcome = b.call("applicable_limit", {"situation": situation})
    assert outcome.ok, outcome.error
    return msgspec.convert(outcome.result, RulesAnswer)


def test_without_a_fallback_pack_all_others_still_count() -> None:
    book = RuleBook(packs={name: pack for name, pack in BOOK.packs.items() if name != "VIENNA-v1"})
    assert not any(map(is_fallback, book.packs.values()))
    assert applicable_limit(book, Situation(road_type="urban")).limit is not None
    assert interpret_sign(book, SignQuestion(reading="stop")).legal_action == "stop"


@pytest.mark.parametrize("here", ["DEU", "GBR", "USA-NV", *NOWHERE])
@pytest.mark.parametrize("road", ROADS)
@pytest.mark.parametrize("posted", [False, True])
def test_a_roads_own_limit_is_assumed_where_road_or_country_is_unknown_and_a_posted_one_never(
    here: str | None, road: Any, posted: bool
) -> None:
    sign = PostedLimit(reading="limit:30", value=30, unit="km/h", scope="permanent", confidence=0.99)
    situation = Situation(jurisdiction=here, road_type=road, posted=(sign,) if posted else ())
    limit = applicable_limit(BOOK, situation).limit
    by_a_sign = posted and limit is not None and limit.value == 30 and limit.unit == "km/h"
    if limit is not None and by_a_sign is posted:
        assert limit.assumed is (not posted and (road is None or here not in ("DEU", "GBR")))

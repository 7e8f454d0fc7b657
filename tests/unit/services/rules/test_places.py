"""Which packs answer where: regions, nations, and what is unknown."""

from pathlib import Path

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from proto.rules import RightOfWayQuestion, Situation
from services.rules.book import RuleBook, load_book
from services.rules.limits.limit_answer import applicable_limit
from services.rules.right_of_way import right_of_way
from services.rules.signs.meaning import careful_rank
from tests.unit.services.rules.editing import adopted, edit, rehash, set_limit

TOWN = Situation(road_type="urban", wet=False, snow=False, visibility_m=300.0, time_of_day_h=12.0)


@pytest.fixture(scope="module")
def nation(tmp_path_factory: pytest.TempPathFactory) -> RuleBook:
    """Italy with 50 in town, one region of it with 60, and another country that extends Italy."""
    home = tmp_path_factory.mktemp("packs")
    adopted(home / "ITA-v1", "ITA")
    adopted(home / "ITA-88-v1", "ITA-88")
    set_limit(home / "ITA-88-v1", "ita-speed-town", 60)
    edit(home / "ITA-88-v1" / "manifest.json", lambda m: m.update(extends={"id": "ITA-v1", "version": "1.0.0"}))
    rehash(home / "ITA-88-v1")
    adopted(home / "SMR-v1", "SMR", extends="ITA-v1")
    book, refused = load_book([home / "ITA-v1", home / "ITA-88-v1", home / "SMR-v1"])
    assert refused == ()
    return book


def ids(book: RuleBook, place: str | None) -> set[str]:
    return {pack.manifest.id for pack in book.for_jurisdiction(place)}


def test_a_regions_pack_answers_in_its_region_and_its_nations_elsewhere(nation: RuleBook) -> None:
    assert ids(nation, "ITA-88") == {"ITA-88-v1"}
    assert ids(nation, "ITA-21") == {"ITA-v1"}
    assert ids(nation, "SMR") == {"SMR-v1"}


def test_where_the_region_is_unknown_both_are_asked_and_the_lower_limit_counts(nation: RuleBook) -> None:
    assert ids(nation, "ITA") == {"ITA-v1", "ITA-88-v1"}
    answer = applicable_limit(nation, at("ITA"))
    assert answer.limit is not None
    assert answer.limit.value == 50


def test_where_only_a_part_of_the_country_is_known_the_answer_is_doubted(nation: RuleBook) -> None:
    book = RuleBook(packs={"ITA-88-v1": nation.packs["ITA-88-v1"]})
    sure = applicable_limit(book, at("ITA-88"))
    doubted = applicable_limit(book, at("ITA"))
    assert doubted.confidence < sure.confidence
    assert "jurisdiction" in doubted.degraded
    assert "Part of the country unknown" in doubted.note


def at(place: str | None) -> Situation:
    return msgspec.structs.replace(TOWN, jurisdiction=place)


PLACES = st.sampled_from([None, "ITA", "ITA-88", "ITA-21", "SMR", "FRA", "nonsense"])
ROADS = st.sampled_from([None, "urban", "rural", "motorway", "living_street"])


@settings(max_examples=60, deadline=None)
@given(place=PLACES, road=ROADS)
def test_knowing_less_of_the_place_never_raises_the_limit(
    nation: RuleBook, place: str | None, road: str | None
) -> None:
    situation = msgspec.structs.replace(at(place), road_type=road)
    known = applicable_limit(nation, situation).limit
    for less in {None, place[:3] if place else None}:
        found = applicable_limit(nation, msgspec.structs.replace(situation, jurisdiction=less)).limit
        assert known is None or (found is not None and found.mps <= known.mps)


@given(
    signs=st.lists(st.sampled_from(["stop", "yield", "priority_road", "roundabout", "crossing"]), max_size=2),
    country=st.sampled_from(["DEU", "GBR", "ZZZ", None]),
    side=st.sampled_from([True, False, None]),
)
def test_a_light_that_is_off_never_makes_a_junction_less_careful(
    signs: list[str], country: str | None, side: bool | None
) -> None:
    ask = RightOfWayQuestion(jurisdiction=country, signs=tuple(signs), traffic_from_priority_side=side)
    without = right_of_way(BOOK, ask)
    off = right_of_way(BOOK, msgspec.structs.replace(ask, light="off"))
    assert careful_rank(off.legal_action) <= careful_rank(without.legal_action)


BOOK, _ = load_book([Path(data(f"rulepacks/{name}")) for name in ("DEU-v1", "GBR-v1", "TEST-v1")])

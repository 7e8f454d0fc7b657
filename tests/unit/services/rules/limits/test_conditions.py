"""Whether a condition of the law holds: yes, no, or it may."""

import pytest

from proto.rules import Situation
from services.rules.limits.conditions import holds, unknown_facts
from services.rules.packs.format import When

UNNUMBERED = When(not_roads=("I", "US", "SR"))


@pytest.mark.parametrize("road", ["I-5", "I 5", "us 290", "SR 99N", "SR20", "I-5; US 2"])
def test_a_road_with_a_number_of_the_named_kind_is_excepted(road: str) -> None:
    assert holds(UNNUMBERED, Situation(road_name=road)) == "no"


@pytest.mark.parametrize("road", ["CR 123", "FM 1960"])
def test_a_road_with_a_number_of_another_kind_is_not(road: str) -> None:
    assert holds(UNNUMBERED, Situation(road_name=road)) == "yes"


@pytest.mark.parametrize("road", [None, "", "Main Street", "US", "290", "Interstate 35", "SR 99999"])
def test_a_road_of_unknown_number_may_be_meant(road: str | None) -> None:
    assert holds(UNNUMBERED, Situation(road_name=road)) == "maybe"
    assert unknown_facts(UNNUMBERED, Situation(road_name=road)) == ("road_name",)


@pytest.mark.parametrize(
    ("road", "held"),
    [
        ("A 10", "yes"), ("a10", "yes"), ("A-10", "yes"), ("A 10;E 55", "yes"), ("A 10 Tauern Autobahn", "yes"),
        ("A 4", "no"), ("A 4;E 60", "no"), ("E 55", "maybe"), ("Tauernautobahn", "maybe"), (None, "maybe"),
    ],
)  # fmt: skip
def test_a_road_is_of_a_list_by_its_number_alone_and_may_be_where_it_has_none_of_that_kind(
    road: str | None, held: str
) -> None:
    assert holds(When(roads=("A 10", "A 12")), Situation(road_name=road)) == held

"""Whether a condition of the law holds: yes, no, or it may."""

import pytest

from proto.rules import Situation
from services.rules.limits.conditions import holds, unknown_facts
from services.rules.packs.format import When

UNNUMBERED = When(not_roads=("I", "US", "SR"))


@pytest.mark.parametrize("road", ["I-5", "I 5", "us 290", "SR 99N", "SR20"])
def test_a_road_with_a_number_of_the_named_kind_is_excepted(road: str) -> None:
    assert holds(UNNUMBERED, Situation(road_name=road)) == "no"


@pytest.mark.parametrize("road", ["CR 123", "FM 1960"])
def test_a_road_with_a_number_of_another_kind_is_not(road: str) -> None:
    assert holds(UNNUMBERED, Situation(road_name=road)) == "yes"


@pytest.mark.parametrize("road", [None, "", "Main Street", "US", "290", "I-5; US 2", "SR 99999"])
def test_a_road_of_unknown_number_may_be_meant(road: str | None) -> None:
    assert holds(UNNUMBERED, Situation(road_name=road)) == "maybe"
    assert unknown_facts(UNNUMBERED, Situation(road_name=road)) == ("road_name",)

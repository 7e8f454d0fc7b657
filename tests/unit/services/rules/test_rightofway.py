"""Stop, yield or proceed: who is unknown is taken to be there."""

from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from proto.rules import RightOfWayQuestion
from services.rules.book import RuleBook, load_book
from services.rules.rightofway import right_of_way
from services.rules.signs import careful_rank

BOOK = load_book([data(f"rulepacks/{name}") for name in ("DEU-v1", "DEU-v1-VSL", "GBR-v1")])[0]
QUESTIONS = st.builds(
    RightOfWayQuestion,
    jurisdiction=st.sampled_from(["DEU", "GBR", "FRA", None]),
    signs=st.lists(
        st.sampled_from(["stop", "yield", "priority_road", "crossing", "roundabout", "limit:50", "zzz"]), max_size=3
    ).map(tuple),
    light=st.sampled_from(["red", "red_amber", "amber", "green", "off", None]),
    pedestrians_on_crossing=st.sampled_from([True, False, None]),
    traffic_from_priority_side=st.sampled_from([True, False, None]),
)


def rank(question: RightOfWayQuestion, **changes: Any) -> int:
    return careful_rank(right_of_way(BOOK, msgspec.structs.replace(question, **changes)).legal_action)


@settings(max_examples=200, deadline=None)
@given(QUESTIONS)
def test_unknown_road_users_never_make_the_answer_less_careful(question: RightOfWayQuestion) -> None:
    for fact in ("traffic_from_priority_side", "pedestrians_on_crossing"):
        assert rank(question, **{fact: None}) <= rank(question, **{fact: False})
    assert rank(question, traffic_from_priority_side=None) == rank(question, traffic_from_priority_side=True)


@settings(max_examples=100, deadline=None)
@given(QUESTIONS, st.sampled_from(["stop", "yield"]))
def test_a_stop_or_yield_sign_never_makes_the_answer_less_careful(question: RightOfWayQuestion, sign: str) -> None:
    assert rank(question, signs=(*question.signs, sign)) <= max(rank(question), careful_rank("yield"))
    assert rank(question, jurisdiction=None) <= rank(question, jurisdiction="DEU")


@pytest.mark.parametrize("light", ["red", "red_amber", "amber"])
@pytest.mark.parametrize("country", ["DEU", "GBR", None])
def test_nobody_drives_at_red_or_amber(light: Any, country: str | None) -> None:
    question = RightOfWayQuestion(jurisdiction=country, light=light, signs=("priority_road",))
    assert right_of_way(BOOK, question).legal_action == "stop"


def test_right_before_left_holds_in_germany_only() -> None:
    germany = right_of_way(BOOK, RightOfWayQuestion(jurisdiction="DEU"))
    britain = right_of_way(BOOK, RightOfWayQuestion(jurisdiction="GBR"))
    assert "deu-right-before-left" in [c.provision for c in germany.citations]
    assert [c.provision for c in britain.citations] == ["gbr-unmarked"]
    assert britain.confidence < germany.confidence  # guidance, no statute


def test_no_pack_no_answer() -> None:
    assert right_of_way(RuleBook(packs={}), RightOfWayQuestion()).confidence == 0.0


def test_where_nobody_comes_the_rule_that_would_hold_is_cited() -> None:
    free = right_of_way(
        BOOK,
        RightOfWayQuestion(jurisdiction="DEU", traffic_from_priority_side=False, pedestrians_on_crossing=False),
    )
    assert free.legal_action == "proceed_with_care"
    assert [citation.provision for citation in free.citations] == ["deu-right-before-left"]

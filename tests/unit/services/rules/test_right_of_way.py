"""Stop, yield or proceed: who is unknown is taken to be there."""

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from proto.rules import RightOfWayQuestion, RulesAnswer
from services.rules.authoring.scaffold import scaffold
from services.rules.book import RuleBook, load_book
from services.rules.right_of_way import right_of_way
from services.rules.signs.meaning import careful_rank
from tests.unit.services.rules.editing import edit, rehash

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


Demands = Sequence[tuple[str, str]]
DEMANDS = st.tuples(st.sampled_from(["statute", "sign_table", "guidance"]), st.sampled_from(["yield", "proceed"]))


def asked(trigger: str, demands: Demands, question: RightOfWayQuestion) -> RulesAnswer:
    """What a pack answers with further provisions on a trigger, each of a kind and with an action."""
    with TemporaryDirectory() as name:
        folder = Path(name) / "A-v1"
        scaffold(folder)

        def add(provisions: list[dict[str, Any]]) -> None:
            for at, (kind, action) in enumerate(demands):
                effects = [{"type": "right_of_way", "trigger": trigger, "action": action}]
                provisions.append(provisions[0] | {"id": f"zzz-{kind}-{at}", "kind": kind, "effects": effects})

        edit(folder / "provisions.json", add)
        rehash(folder)
        book, refused = load_book([folder])
        assert refused == ()
        return right_of_way(book, question)


@settings(max_examples=30, deadline=None)
@given(st.lists(DEMANDS, max_size=3))
def test_no_further_provision_undoes_the_stop_that_a_statute_demands(demands: Demands) -> None:
    question = RightOfWayQuestion(jurisdiction="ZZZ", light="red", pedestrians_on_crossing=False)
    assert asked("light:red", demands, question).legal_action == "stop"


@pytest.mark.parametrize(
    ("demands", "action", "cited"),
    [
        ([("statute", "yield"), ("guidance", "proceed")], "yield", "zzz-statute-0"),
        ([("guidance", "stop"), ("statute", "yield")], "yield", "zzz-statute-1"),
        ([("sign_table", "stop"), ("sign_table", "proceed")], "stop", "zzz-sign_table-0"),
        ([("sign_table", "proceed"), ("sign_table", "stop")], "stop", "zzz-sign_table-1"),
    ],
)
def test_of_several_demands_on_one_sign_the_highest_kind_governs_then_the_most_careful(
    demands: Demands, action: str, cited: str
) -> None:
    question = RightOfWayQuestion(jurisdiction="ZZZ", signs=("made_up",), pedestrians_on_crossing=False)
    answer = asked("sign:made_up", demands, question)
    assert (answer.legal_action, answer.citations[0].provision) == (action, cited)

"""Stop, yield or proceed: who is unknown is taken to be there."""

from collections.abc import Sequence
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, get_args

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from proto.rules import Circumstance, RightOfWayQuestion, RulesAnswer
from services.rules.book import RuleBook, load_book
from services.rules.packs.format import RightOfWay
from services.rules.packs.loading import Pack
from services.rules.right_of_way import CROSSINGS, right_of_way
from services.rules.service import RulesConfig
from services.rules.signs.meaning import careful_rank
from tests.unit.services.rules.editing import adopted, edit, rehash

BOOK = load_book([data(f"rulepacks/{name}") for name in ("DEU-v1", "DEU-v1-VSL", "GBR-v1")])[0]
SHIPPED = load_book([data(f"rulepacks/{name}") for name in RulesConfig().packs])[0]
QUESTIONS = st.builds(
    RightOfWayQuestion,
    jurisdiction=st.sampled_from(["DEU", "GBR", "FRA", None]),
    signs=st.lists(
        st.sampled_from(
            ["stop", "yield", "priority_road", "crossing", "roundabout", "limit:50", "no_entry", "marking:zebra", "zzz"]
        ),
        max_size=3,
    ).map(tuple),
    light=st.sampled_from(
        ["red", "red_amber", "amber", "green", "off", "amber_flashing", "flashing_red", "green_arrow", None]
    ),
    circumstances=st.lists(st.sampled_from(get_args(Circumstance)), max_size=2).map(tuple),
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


@settings(max_examples=200, deadline=None)
@given(QUESTIONS, st.sampled_from(get_args(Circumstance)))
def test_no_circumstance_makes_the_answer_less_careful(question: RightOfWayQuestion, met: Circumstance) -> None:
    assert rank(question, circumstances=(*question.circumstances, met)) <= max(
        rank(question), careful_rank("proceed_with_care")
    )


def on_a_clear_road(pack: Pack, **seen: Any) -> RulesAnswer:
    here = pack.manifest.jurisdiction
    question = RightOfWayQuestion(jurisdiction=here, traffic_from_priority_side=False, pedestrians_on_crossing=False)
    return right_of_way(SHIPPED, msgspec.structs.replace(question, **seen))


@pytest.mark.parametrize("pack", SHIPPED.packs.values(), ids=SHIPPED.packs)
@pytest.mark.parametrize("light", [None, "off", "green"])
def test_no_sign_is_answered_less_carefully_than_its_own_entry_says(pack: Pack, light: Any) -> None:
    for sign in pack.signs.values():
        if light != "green" or sign.action == "no_entry":
            crosses = sign.code in CROSSINGS  # these demand something only before a crossing person
            found = on_a_clear_road(pack, signs=(sign.code,), light=light, pedestrians_on_crossing=crosses)
            least = (
                careful_rank("proceed_with_care") if sign.action in ("none", "unknown") else careful_rank(sign.action)
            )
            assert careful_rank(found.legal_action) <= least, sign.code


@pytest.mark.parametrize("pack", SHIPPED.packs.values(), ids=SHIPPED.packs)
def test_every_trigger_of_every_pack_can_be_reached(pack: Pack) -> None:
    for provision in pack.provisions.values():
        for effect in provision.effects:
            if isinstance(effect, RightOfWay):
                kind, _, name = effect.trigger.partition(":")
                ways: dict[str, dict[str, Any]] = {
                    "sign": {"signs": (name,)},
                    "light": {"light": name},
                    "crossing": {"pedestrians_on_crossing": True},
                    "unsigned": {"traffic_from_priority_side": True},
                }
                asked = ways.get(kind, {"circumstances": (effect.trigger,)})
                msgspec.convert(msgspec.to_builtins(asked), RightOfWayQuestion)
                found = on_a_clear_road(pack, **asked)
                assert provision.id in [citation.provision for citation in found.citations], effect.trigger


@pytest.mark.parametrize(
    ("country", "signs", "action", "cited"),
    [
        ("DEU", ("no_entry",), "no_entry", "sign:no_entry"),
        ("DEU", ("priority_road", "no_entry"), "no_entry", "sign:no_entry"),
        ("DEU", ("marking:shark_teeth",), "yield", "sign:marking:shark_teeth"),
        ("GBR", ("marking:give_way",), "yield", "sign:marking:give_way"),
        ("CHE", ("customs",), "stop", "sign:customs"),
        ("USA-CA", ("wrong_way",), "no_entry", "sign:wrong_way"),
    ],
)
def test_a_sign_without_a_trigger_demands_what_its_entry_says(
    country: str, signs: tuple[str, ...], action: str, cited: str
) -> None:
    found = right_of_way(SHIPPED, RightOfWayQuestion(jurisdiction=country, signs=signs))
    assert (found.legal_action, found.citations[0].provision) == (action, cited)


@pytest.mark.parametrize("pack", SHIPPED.packs.values(), ids=SHIPPED.packs)
@pytest.mark.parametrize("light", ["red", "red_amber", "amber", "flashing_red"])
def test_no_law_lets_a_driver_go_at_red_or_amber(light: Any, pack: Pack) -> None:
    found = on_a_clear_road(pack, light=light, signs=("priority_road",))
    warns = pack.manifest.jurisdiction.startswith("USA") and light == "amber"  # that red comes: CVC 21452, VTL 1111(b)
    assert found.legal_action == ("proceed_with_care" if warns else "stop")


@pytest.mark.parametrize("pack", SHIPPED.packs.values(), ids=SHIPPED.packs)
def test_every_law_asks_for_care_in_whatever_is_met(pack: Pack) -> None:
    """Drivers that turn, merge or pull out give way in all our countries; they pass a school bus with care at the least."""
    for met, light in product(get_args(Circumstance), (None, "green")):
        found = on_a_clear_road(pack, circumstances=(met,), light=light)
        least = careful_rank("proceed_with_care" if met == "school_bus:red" else "yield")
        assert careful_rank(found.legal_action) <= least, met


@pytest.mark.parametrize("pack", SHIPPED.packs.values(), ids=SHIPPED.packs)
def test_what_a_law_does_not_state_is_told_and_answered_by_the_most_careful_of_all(pack: Pack) -> None:
    for sign, least in (("police_stop", careful_rank("stop")), ("zzz", careful_rank("proceed_with_care"))):
        found = on_a_clear_road(pack, signs=(sign,), light="green")
        assert careful_rank(found.legal_action) <= least
        assert found.confidence < 0.5 or sign in pack.signs
        assert "most careful of all laws" in found.note or sign in pack.signs


@pytest.mark.parametrize("pack", SHIPPED.packs.values(), ids=SHIPPED.packs)
def test_trains_go_first_where_gates_are_announced(pack: Pack) -> None:
    assert careful_rank(on_a_clear_road(pack, signs=("level_crossing_gates",)).legal_action) <= careful_rank("yield")


@pytest.mark.parametrize("pack", SHIPPED.packs.values(), ids=SHIPPED.packs)
def test_flashing_amber_on_a_priority_road_asks_for_no_stop(pack: Pack) -> None:
    found = on_a_clear_road(pack, light="amber_flashing", signs=("priority_road",))
    assert found.legal_action in ("proceed", "proceed_with_care", "yield")


def test_a_flashing_amber_light_leaves_the_signs_in_force() -> None:
    for sign, action in (("stop", "stop"), ("yield", "yield")):
        for country in ("DEU", "GBR", "FRA"):
            question = RightOfWayQuestion(jurisdiction=country, light="amber_flashing", signs=(sign,))
            assert right_of_way(SHIPPED, question).legal_action == action


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
        adopted(folder)

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

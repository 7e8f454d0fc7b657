"""The Rules service on a real bus: tools, evidence from retrieval, and what it does without."""

from pathlib import Path
from typing import Any

import msgspec
import pytest

from drivemcp.bus.session import wait_settled
from drivemcp.node import Node
from drivemcp.testing import TestBus, bus
from proto.rules import RulesAnswer
from proto.topics import HEALTH
from services.retrieval.service import SERVICE as RETRIEVAL
from services.retrieval.service import RetrievalConfig
from services.rules import service
from services.rules.service import SERVICE, RulesConfig
from tests.unit.services.rules.editing import adopted, edit, rehash

URBAN = {"jurisdiction": "DEU", "road_type": "urban", "visibility_m": 200.0, "wet": False, "segment_id": "s1"}
TOOLS = {
    "lookup_rule",
    "interpret_sign",
    "applicable_limit",
    "right_of_way",
    "list_rulepacks",
    "cited_paragraph",
    "citable_places",
}


def limit(on: TestBus, **changes: Any) -> RulesAnswer:
    outcome = on.call("applicable_limit", {"situation": {**URBAN, **changes}})
    assert outcome.ok, outcome.error
    return msgspec.convert(outcome.result, RulesAnswer)


def backed(on: TestBus, **changes: Any) -> RulesAnswer:
    """The answer that retrieval was in time for: on a busy machine not every one is, and those are not kept."""
    answers = (limit(on, **changes) for _ in range(50))
    return next(answer for answer in answers if "retrieval" not in answer.degraded)


def with_retrieval(on: TestBus) -> None:
    on.start(RETRIEVAL, RetrievalConfig(encoder="none"))
    rules = on.start(SERVICE)
    rules.client.discover()
    assert wait_settled(lambda: "retrieve" in rules.catalogue() and "retrieval" in rules.alive_services(), 5.0)


def looked_up(on: TestBus, **asked: Any) -> RulesAnswer:
    """As `backed`, of a question in words."""
    answers = (msgspec.convert(on.call("lookup_rule", asked).result, RulesAnswer) for _ in range(50))
    return next(answer for answer in answers if "retrieval" not in answer.degraded)


def test_the_tools_of_the_design_are_offered() -> None:
    with bus() as b:
        b.start(SERVICE)
        b.call("list_rulepacks")
        assert set(b.probe.catalogue()) >= TOOLS


def test_without_retrieval_it_answers_at_lower_confidence_and_says_so() -> None:
    with bus() as b:
        b.start(SERVICE)
        answer = limit(b)
        assert answer.limit is not None
        assert answer.limit.value == 50
        assert answer.degraded == ("retrieval",)
        assert answer.citations


def test_with_retrieval_the_same_answer_is_surer() -> None:
    with bus() as b:
        b.start(SERVICE)
        alone = limit(b)
    with bus() as b:
        with_retrieval(b)
        supported = backed(b)
        assert supported.limit == alone.limit
        assert supported.confidence > alone.confidence
        assert supported.degraded == ("encoder",)  # BM25 alone, and said so


def test_a_repeat_on_the_same_segment_does_not_ask_retrieval_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service, "RETRIEVAL_DEADLINE_MS", 4000.0)  # a late call would count when nobody waits for it
    with bus() as b:
        retrieval = b.start(RETRIEVAL, RetrievalConfig(encoder="none"))
        rules = b.start(SERVICE, RulesConfig(languages=()))
        rules.client.discover()
        first = backed(b, visibility_m=200.0)
        served = retrieval.tools.served
        assert limit(b, visibility_m=200.4) == first
        assert retrieval.tools.served == served


def test_when_retrieval_goes_known_answers_stay_and_are_marked_degraded() -> None:
    with bus() as b:
        with_retrieval(b)
        before = backed(b)
    with bus() as b:
        retrieval = b.start(RETRIEVAL, RetrievalConfig(encoder="none"))
        rules = b.start(SERVICE)
        rules.client.discover()
        assert backed(b) == before
        rules.client._alive.discard("retrieval")  # as the liveliness token's end does
        after = limit(b)
        assert after.limit == before.limit
        assert after.degraded == ("encoder", "retrieval")
        assert retrieval.name == "retrieval"


def test_in_lockstep_retrieval_is_found_before_the_first_answer() -> None:
    with bus() as b:
        b.start(RETRIEVAL, RetrievalConfig(encoder="none", lockstep=True))
        b.start(SERVICE, RulesConfig(lockstep=True))
        assert "retrieval" not in limit(b).degraded


@pytest.mark.parametrize(
    ("took_ms", "language", "late"), [(30.0, "en", False), (30.0, "fr", True), (600.0, "en", True)]
)
def test_in_lockstep_the_usual_questions_have_the_time_that_they_have_at_the_start_of_a_live_service(
    took_ms: float, language: str, late: bool
) -> None:
    with bus() as b:
        b.start(RETRIEVAL, RetrievalConfig(encoder="none", lockstep=True))
        b.start(SERVICE, RulesConfig(lockstep=True, modelled_ms={"retrieve": took_ms}))
        assert ("retrieval" in limit(b, language=language).degraded) == late


def test_a_lookup_cites_what_retrieval_found() -> None:
    with bus() as b:
        with_retrieval(b)
        answer = looked_up(b, query="priority at a roundabout from the right", jurisdiction="GBR")
        assert answer.degraded == ()
        assert "gbr-roundabout" in [citation.provision for citation in answer.citations]


def test_arguments_that_break_the_schema_are_a_tool_error() -> None:
    with bus() as b:
        b.start(SERVICE)
        bad: list[dict[str, Any]] = [
            {},
            {"situation": 7},
            {"situation": {"road_type": "river"}},
            {"situation": {"posted": [{}]}},
        ]
        for arguments in bad:
            assert b.call("applicable_limit", arguments).status == "tool_error"
        assert b.call("lookup_rule", {"query": "x" * 10_000}).status == "tool_error"
        assert limit(b).limit is not None


def test_a_pack_that_cannot_be_used_is_refused_and_the_others_answer(tmp_path: Path) -> None:
    (tmp_path / "bad").mkdir()
    with bus() as b:
        node = b.start(SERVICE, RulesConfig(packs=("DEU-v1", str(tmp_path / "bad"), "NO-v9")))
        assert limit(b).limit is not None
        assert "manifest.json" in node.detail["refused"]
        assert node.detail["rulepacks"].startswith("DEU-v1@")


def test_with_no_pack_at_all_tools_fail_and_say_why() -> None:
    with bus() as b:
        b.start(SERVICE, RulesConfig(packs=("NO-v9",)))
        outcome = b.call("applicable_limit", {"situation": URBAN})
        assert outcome.status == "tool_error"
        assert "no rulepack" in outcome.error


def test_a_stale_pack_is_told(tmp_path: Path) -> None:
    with bus() as b:
        b.start(SERVICE, RulesConfig(expected_packs={"DEU-v1": "1.4.0"}))
        assert "stale_rulepack" in limit(b).degraded


def test_an_old_pack_is_told_to_the_driver_in_its_language_and_lowers_confidence() -> None:
    with bus() as b:
        b.start(SERVICE)
        fresh = limit(b)
    for language, word in (("en", "older than"), ("de", "älter als"), ("fr", "plus anciennes")):
        with bus() as b:
            b.start(SERVICE, RulesConfig(expected_packs={"DEU-v1": "1.4.0"}))
            stale = limit(b, language=language)
            assert word in stale.note
            assert stale.confidence == pytest.approx(0.5 * fresh.confidence)


def test_a_pack_that_has_run_out_is_noticed_by_the_clock(tmp_path: Path) -> None:
    pack = tmp_path / "ITA-v1"
    adopted(pack, "ITA")
    edit(pack / "manifest.json", lambda m: m.update(effective_until="2025-06-30"))
    rehash(pack)
    for settings, degraded in (({}, True), ({"today": "2025-06-30"}, False), ({"lockstep": True}, False)):
        with bus() as b:
            b.start(SERVICE, RulesConfig(packs=(str(pack),), **settings))
            assert ("stale_rulepack" in limit(b, jurisdiction="ITA").degraded) is degraded


def test_the_share_of_answers_from_memory_stands_in_the_health() -> None:
    with bus() as b:
        b.start(SERVICE, RulesConfig(cache_size=2))
        for segment in ("s1", "s1", "s1", "s2", "s3", "s1"):
            limit(b, segment_id=segment)
        said = "hits 33% of 6, kept 2 of 2"  # the third segment pushed the first one out
        health = b.wait_for(HEALTH, lambda h: h.detail.get("answers") == said, id="rules")
        assert health.service == "rules"


def test_answers_made_without_retrieval_are_made_anew_once_it_is_there() -> None:
    with bus() as b:
        rules = b.start(SERVICE, RulesConfig(languages=()))
        assert limit(b).degraded == limit(b).degraded == ("retrieval",)
        b.start(RETRIEVAL, RetrievalConfig(encoder="none"))
        b.wait_for(HEALTH, id="retrieval")  # by then its liveliness is known
        rules.client.discover()
        assert backed(b).degraded == ("encoder",)


def test_a_country_without_a_pack_is_looked_up_in_all() -> None:
    with bus() as b:
        with_retrieval(b)
        outcome = b.call("lookup_rule", {"query": "priority at a roundabout", "jurisdiction": "PRT"})
        answer = msgspec.convert(outcome.result, RulesAnswer)
        assert answer.citations
        assert "jurisdiction" in answer.degraded


def test_the_law_that_a_pack_inherits_from_another_nation_is_found_beside_retrieval(tmp_path: Path) -> None:
    adopted(tmp_path / "ITA-v1", "ITA")
    adopted(tmp_path / "SMR-v1", "SMR", extends="ITA-v1")
    packs = (str(tmp_path / "ITA-v1"), str(tmp_path / "SMR-v1"))
    with bus() as b:
        b.start(RETRIEVAL, RetrievalConfig(packs=packs, encoder="none"))
        b.start(SERVICE, RulesConfig(packs=packs)).client.discover()
        outcome = b.call("lookup_rule", {"query": "speed limit in built-up areas", "jurisdiction": "SMR"})
        answer = msgspec.convert(outcome.result, RulesAnswer)
        assert answer.limit is not None
        assert answer.citations[0].document.startswith("ITA-v1/")


@pytest.mark.parametrize("language", ["en", "de", "fr", "nl", "pl", "it", "es"])
def test_a_sign_is_explained_over_the_bus(language: str) -> None:
    with bus() as b:
        b.start(SERVICE)
        outcome = b.call("interpret_sign", {"reading": "stop", "jurisdiction": "DEU", "language": language})
        assert outcome.result is not None
        assert outcome.result["legal_action"] == "stop"
        assert outcome.result["meaning"]


def test_an_unsigned_junction_is_answered_over_the_bus() -> None:
    with bus() as b:
        b.start(SERVICE)
        outcome = b.call("right_of_way", {"question": {"jurisdiction": "DEU"}})
        assert outcome.result is not None
        assert outcome.result["legal_action"] == "yield"


def test_every_citation_leads_the_gateway_to_its_own_text_and_no_other_caller(tmp_path: Path) -> None:
    with bus() as b:
        b.start(SERVICE)
        gateway = b.node("gateway")
        cited = limit(b).citations
        assert cited
        for citation in cited:
            asked = {"document": citation.document, "offset": citation.start}
            found = b.call("cited_paragraph", asked, caller=gateway)
            assert found.result is not None
            assert found.result["citation"]["excerpt"] == citation.excerpt
            small = {**asked, "document": citation.document.replace("DEU", "deu")}
            assert b.call("cited_paragraph", small, caller=gateway).result == found.result
            assert str(citation.start) in _places(b, gateway, citation.document)
            assert citation.document in {f"DEU-v1/{name}" for name in _places(b, gateway, "DEU-v1")}
        assert "DEU-v1" in _places(b, gateway, "")
        none = b.call("cited_paragraph", {"document": "DEU-v1/../../secret", "offset": 0}, caller=gateway)
        assert (none.status, none.result) == ("tool_error", None)
        assert b.call("cited_paragraph", asked).status == "protocol_error"


def _places(b: TestBus, gateway: Node, document: str) -> tuple[str, ...]:
    found = b.call("citable_places", {"document": document}, caller=gateway)
    assert found.result is not None
    return tuple(found.result["places"])

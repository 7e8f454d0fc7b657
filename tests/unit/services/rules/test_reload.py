"""A running Rules service follows its packs, says so on the bus, and keeps what is sound."""

from collections.abc import Callable
from pathlib import Path

import msgspec
import pytest

from drivemcp.bus.session import wait_settled
from drivemcp.node import Node
from drivemcp.runtime.grants import make_key
from drivemcp.testing import TestBus, bus
from proto.health import ServiceLog
from proto.rules import RulesAnswer
from proto.topics import HEALTH, LOG
from services.retrieval.service import SERVICE as RETRIEVAL
from services.retrieval.service import RetrievalConfig
from services.rules import service
from services.rules.authoring.seal import seal
from services.rules.packs.loading import load
from services.rules.packs.signature import sign
from services.rules.service import SERVICE, RulesConfig
from tests.unit.services.rules.editing import adopted, rehash, set_limit

TOWN = {"jurisdiction": "ZZZ", "road_type": "urban", "visibility_m": 200.0, "wet": False, "snow": False}
SOON_S = 0.02


@pytest.fixture
def pack(tmp_path: Path) -> Path:
    adopted(tmp_path / "A-v1")
    return tmp_path / "A-v1"


def config(pack: Path, **changes: object) -> RulesConfig:
    made = RulesConfig(packs=(str(pack),), reload_s=SOON_S, languages=())
    return msgspec.structs.replace(made, **changes)


def limit(on: TestBus) -> RulesAnswer:
    outcome = on.call("applicable_limit", {"situation": TOWN})
    assert outcome.ok, outcome.error
    return msgspec.convert(outcome.result, RulesAnswer)


def told(on: TestBus, message: str, after: Callable[[], None]) -> ServiceLog:
    return on.wait_for(LOG, lambda line: line.message == message, id="rules", after=after)


def signed_by(pack: Path, private: str) -> None:
    sign(pack, private)


def value(answer: RulesAnswer) -> float | None:
    return answer.limit.value if answer.limit else None


def test_a_changed_pack_is_answered_from_and_its_version_announced(pack: Path) -> None:
    with bus() as b:
        node = b.start(SERVICE, config(pack))
        before = limit(b)
        line = told(b, "rulepack changed", lambda: set_limit(pack, "zzz-speed-town", 40))
        after = limit(b)
        assert (value(before), value(after)) == (50, 40)
        assert line.fields == {"rulepack_version": after.rulepack_version, "before": before.rulepack_version}
        assert after.rulepack_version == load(pack).version
        health = b.wait_for(HEALTH, lambda h: after.rulepack_version in h.detail.get("rulepacks", ""), id="rules")
        assert "refused" not in health.detail
        assert node.detail["rulepacks"] == after.rulepack_version


def test_a_broken_version_is_refused_and_the_old_one_answers(pack: Path) -> None:
    with bus() as b:
        node = b.start(SERVICE, config(pack))
        b.wait_for(
            LOG,
            lambda line: (
                "content_sha256" in line.fields.get("why", "")
            ),  # half written it is refused for another reason
            id="rules",
            after=lambda: set_limit(pack, "zzz-speed-town", 60, sealed=False),
        )
        assert value(limit(b)) == 50
        assert "content_sha256" in node.detail["refused"]
        told(b, "rulepack changed", lambda: rehash(pack))
        assert value(limit(b)) == 60
        assert "refused" not in node.detail


def test_answers_kept_from_the_old_version_are_forgotten(pack: Path) -> None:
    with bus() as b:
        b.start(RETRIEVAL, RetrievalConfig(packs=(str(pack),), encoder="none", reload_s=SOON_S))
        rules = b.start(SERVICE, config(pack))
        rules.client.discover()
        assert value(limit(b)) == value(limit(b)) == 50
        told(b, "rulepack changed", lambda: set_limit(pack, "zzz-speed-town", 40))
        assert value(limit(b)) == 40


def test_evidence_of_another_version_is_not_kept(pack: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service, "RETRIEVAL_DEADLINE_MS", 4000.0)  # a late call would count when nobody waits for it
    with bus() as b:
        retrieval = b.start(RETRIEVAL, RetrievalConfig(packs=(str(pack),), encoder="none", reload_s=0))
        rules = b.start(SERVICE, config(pack))
        rules.client.discover()
        assert wait_settled(lambda: "retrieval" in rules.alive_services(), 5.0)
        told(b, "rulepack changed", lambda: set_limit(pack, "zzz-speed-town", 40))
        limit(b)
        served = retrieval.tools.served
        limit(b)
        assert retrieval.tools.served == served + 1


def test_retrieval_follows_too(pack: Path) -> None:
    with bus() as b:
        b.start(RETRIEVAL, RetrievalConfig(packs=(str(pack),), encoder="none", reload_s=SOON_S))
        path = pack / "sources" / "law.en.md"

        def reword() -> None:
            text = path.read_text(encoding="utf-8").replace("With snow chains", "With iron links on the tyres")
            path.write_text(text, encoding="utf-8")
            seal(pack)

        before = load(pack).version
        b.wait_for(HEALTH, lambda h: before not in h.detail.get("rulepacks", before), id="retrieval", after=reword)
        outcome = b.call("retrieve", {"query": "iron links on the tyres", "jurisdiction": "ZZZ", "language": "en"})
        assert outcome.result is not None
        best = outcome.result["passages"][0]
        assert best["rulepack_version"] == load(pack).version
        assert "iron links" in best["excerpt"]


def test_in_lockstep_nothing_is_looked_at(pack: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    periods: list[float] = []
    every = Node.every

    def noted(node: Node, period_s: float, function: Callable[[], None]) -> None:
        periods.append(period_s)
        every(node, period_s, function)

    monkeypatch.setattr(Node, "every", noted)
    with bus() as b:
        b.start(RETRIEVAL, RetrievalConfig(packs=(str(pack),), encoder="none", lockstep=True, reload_s=SOON_S))
        b.start(SERVICE, config(pack, lockstep=True))
        assert SOON_S not in periods


def test_a_service_that_demands_signatures_takes_only_signed_versions(pack: Path) -> None:
    pair = make_key()
    sign(pack, pair.private)
    with bus() as b:
        b.start(SERVICE, config(pack, require_signature=True, pack_keys=(pair.public,)))
        assert value(limit(b)) == 50
        refused = b.wait_for(
            LOG,
            lambda line: (
                "signature.json" in line.fields.get("why", "")
            ),  # while it is written it may be refused for its hash
            id="rules",
            after=lambda: set_limit(pack, "zzz-speed-town", 40),
        )
        assert refused.level == "error"
        assert value(limit(b)) == 50
        told(b, "rulepack changed", lambda: signed_by(pack, pair.private))
        assert value(limit(b)) == 40


def test_an_unsigned_pack_is_refused_where_a_signature_is_required(pack: Path) -> None:
    with bus() as b:
        node = b.start(SERVICE, config(pack, require_signature=True, pack_keys=(make_key().public,)))
        assert "a signature is required" in node.detail["refused"]
        assert b.call("applicable_limit", {"situation": TOWN}).status == "tool_error"


def test_naming_keys_demands_signatures(pack: Path) -> None:
    """Who takes the signature away must not get past the keys."""
    pair = make_key()
    sign(pack, pair.private)
    with bus() as b:
        node = b.start(SERVICE, config(pack, pack_keys=(pair.public,)))
        assert "refused" not in node.detail
        (pack / "signature.json").unlink()
        assert wait_settled(lambda: "a signature is required" in node.detail.get("refused", ""), 10.0)


@pytest.mark.parametrize("keys", [(), ("no key",)])
def test_a_demand_that_no_key_can_meet_is_a_mistake_in_the_configuration(keys: tuple[str, ...], pack: Path) -> None:
    with bus() as b, pytest.raises(ValueError, match="key"):
        b.start(SERVICE, config(pack, require_signature=True, pack_keys=keys))

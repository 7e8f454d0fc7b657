"""The settings of the ablations, on a real in-process bus."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from drivemcp.bus.session import wait_settled
from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from drivemcp.testing import bus
from drivemcp.tools.client import DEFAULT_MODELLED_MS
from evaluation.baselines.direct import advise
from proto import topics
from services.orchestrator.experts import ask
from services.orchestrator.experts.routing import Call
from services.orchestrator.service import SERVICE, LiveAsk, OrchestratorConfig
from tests.unit.services.orchestrator.test_service import Road, start_car

PATIENT_MS = 4000.0
"""A deadline that a busy machine meets as well, where a test is not about being late."""
CALLS = tuple(Call(tool=tool, arguments={}, deadline_ms=40.0) for tool in ("vehicle_health", "read_dtcs"))


@pytest.mark.parametrize(("parallel", "waits"), [(True, 1), (False, 2)])
def test_tools_are_asked_at_once_or_one_after_another(parallel: bool, waits: int) -> None:
    with bus() as b:
        start_car(b)
        node = b.node("asker", ServiceConfig(lockstep=True))
        node.client.discover()
        ask = LiveAsk(node, parallel=parallel)
        outcomes = ask.experts(CALLS)
        assert [outcome.tool for outcome in outcomes if outcome.ok] == [call.tool for call in CALLS]
        assert ask.spent_ms() == waits * DEFAULT_MODELLED_MS


def test_in_lockstep_a_tool_takes_as_long_as_is_modelled_and_is_late_past_its_deadline() -> None:
    with bus() as b:
        start_car(b)
        modelled = {"vehicle_health": 12.5, "read_dtcs": 60.0}
        node = b.node("asker", ServiceConfig(lockstep=True, modelled_ms=modelled))
        node.client.discover()
        ask = LiveAsk(node)
        assert [outcome.status for outcome in ask.experts(CALLS)] == ["ok", "timeout"]
        assert ask.spent_ms() == 60.0
        assert [late.tool for late in node.late()] == ["read_dtcs"]


@pytest.mark.parametrize(("learns", "labels"), [(True, ["annoying"]), (False, [])])
def test_labels_move_the_arbiter_only_where_it_learns_and_are_kept_all_the_same(
    learns: bool, labels: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kept: list[object] = []

    def build(config: ServiceConfig, node: Node) -> None:
        @node.tool(deadline_ms=40)
        def remember(kind: str, key: str, value: dict[str, Any]) -> dict[str, int]:
            """Keeps it."""
            kept.append((kind, key))
            return {}

    with bus() as b:
        b.start(Service("logger", ServiceConfig, build))
        config = OrchestratorConfig(silence_s=60.0, expected=(), learns=learns, out_dir=str(tmp_path))
        orchestrator = b.start(SERVICE, config)
        call = orchestrator.call
        monkeypatch.setattr(orchestrator, "call", lambda tool, told, **_: call(tool, told, deadline_ms=PATIENT_MS))
        road = Road(b)
        _until(lambda: "remember" in orchestrator.catalogue() and road.step() is not None)
        assert b.call("feedback", {"label": "annoying"}).ok
        road.step()
        traces = road.traces.wait_count(len(road.advisories.messages))
        given = [each.label for trace in traces if trace.request is not None for each in trace.request.feedback]
        assert given == labels
        assert kept == [("feedback", "annoying")]


def test_a_question_is_answered_by_the_prompt_alone_under_the_direct_method(monkeypatch: pytest.MonkeyPatch) -> None:
    from services.drivelm.service import SERVICE as DRIVELM
    from services.drivelm.service import DrivelmConfig

    monkeypatch.setattr(advise, "DEADLINE_MS", PATIENT_MS)
    monkeypatch.setattr(ask, "BUDGET_MS", PATIENT_MS)
    with bus() as b:
        b.start(DRIVELM, DrivelmConfig(whole_prompts=True))
        config = OrchestratorConfig(silence_s=60.0, expected=(), method="direct")
        orchestrator = b.start(SERVICE, config)
        road = Road(b)
        _until(lambda: "answer_prompt" in orchestrator.catalogue() and _heard_the_speed(road))
        decisions = b.collect(topics.DECISION)
        outcome = b.call("ask", {"question": "At how many km/h does the vehicle drive?"})
        assert outcome.ok, outcome.error
        assert outcome.result is not None
        assert [use["tool"] for use in outcome.result["tools"]] == ["answer_prompt"]
        assert outcome.result["text"] == "The ego vehicle drives at 43 km/h."
        assert decisions.messages == []


def _heard_the_speed(road: Road) -> bool:
    """After one more step: what a publisher says first may come before its subscriber is known."""
    road.step()
    world = road.traces.wait_count(len(road.advisories.messages))[-1].world
    return world["ego"]["speed_mps"] is not None


def _until(ready: Callable[[], bool]) -> None:
    assert wait_settled(ready, 20.0), "never ready"

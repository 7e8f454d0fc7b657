"""The orchestrator on a real in-process bus, with the real arbiter, rules and weather beside it."""

import itertools
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest

from drivemcp import node as node_module
from drivemcp.bus.session import wait_settled
from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from drivemcp.testing import TestBus, bus
from proto import topics
from proto.decision import Advisory, TraceRecord
from proto.perception import Tracks
from proto.scene import Facts
from proto.vehicle import Degradation, DtcText, Ego, VehicleHealth
from proto.weather import Conditions
from services.arbiter.service import SERVICE as ARBITER
from services.arbiter.service import ArbiterConfig
from services.orchestrator import service
from services.orchestrator.driver import question as question_module
from services.orchestrator.service import SERVICE, OrchestratorConfig
from services.orchestrator.state import State
from services.orchestrator.tick import redecide
from services.rules.service import SERVICE as RULES
from tests.unit.services.orchestrator.support import actor, conditions, fact, limit_sign

CONFIG = OrchestratorConfig(silence_s=60.0, expected=("rules", "arbiter", "can"))
"""Ticks come from snapshots alone, unless a test is about the watchdog; the test itself is perception and weather."""


class Road:
    """Plays perception, CAN and weather; `step` publishes one snapshot and waits for its advisory."""

    def __init__(self, b: TestBus) -> None:
        self.b = b
        self.node: Node = b.node("road")
        self.advisories = b.collect(topics.ADVISORY)
        self.traces = b.collect(topics.TRACE)
        self.frame = 0
        self.speed_mps = 12.0
        self.weather: Conditions = conditions(mu=0.4, factor=0.75, wet=True, risk_level="high")
        self.car = Degradation(h=0.0, brake_envelope=1.0)
        self.lidar = False

    def step(self, *facts: object, tracks: tuple[object, ...] = (), lead: int | None = None) -> Advisory:
        """The advisory of this very snapshot."""
        self.frame += 1
        self.node.publish(topics.EGO, Ego(speed_mps=self.speed_mps, acceleration_mps2=0.0, brake_pedal=0.0))
        self.node.publish(topics.CONDITIONS, self.weather)
        self.node.publish(topics.DEGRADATION, self.car)
        if facts:
            self.node.publish(topics.FACTS, Facts(facts=facts))  # type: ignore[arg-type]
        count = len(self.advisories.messages)
        shown = Tracks(
            camera="front", frame=self.frame, tracks=tracks, lead_track_id=lead, lidar_used=self.lidar,  # type: ignore[arg-type]
        )  # fmt: skip
        self.node.publish(topics.TRACKS, shown)
        return self.advisories.wait_count(count + 1)[count]

    def until(self, *facts: object, want: str, seconds: float = 20.0) -> Advisory:
        """Step until a directive begins with `want`; subscriptions and catalogues settle meanwhile."""
        end_s = time.monotonic() + seconds
        while time.monotonic() < end_s:
            advisory = self.step(*facts)
            if advisory.directive.startswith(want) and advisory.kind != "SILENT":
                return advisory
        raise AssertionError(f"{want!r} never came; last: {advisory.directive!r}")


def start_car(b: TestBus) -> None:
    """A stand-in for the CAN service's two tools, with a fault."""
    from drivemcp.config import ServiceConfig
    from drivemcp.service import Service

    def build(config: ServiceConfig, node: Node) -> None:
        code = DtcText(code="C0035", system="brakes", severity="careful", summary="Wheel speed sensor fault",
                       next_step="Leave more room.")  # fmt: skip

        @node.tool(deadline_ms=40)
        def vehicle_health(language: str = "en") -> VehicleHealth:
            """The car's health."""
            return VehicleHealth(
                h=0.4, brake_envelope=0.75, indicators=(), dtcs=(code,), warning_lamps=("abs",),
                safe_to_drive="with_care", advice="Leave more room.", speed_factor=0.9, headway_factor=1.3, confidence=0.9,
            )  # fmt: skip

        @node.tool(deadline_ms=40)
        def read_dtcs(language: str = "en") -> dict[str, list[str]]:
            """The codes."""
            return {"stored": ["C0035"]}

    b.start(Service("can", ServiceConfig, build))


def start_weather(b: TestBus, road: "Road") -> None:
    """A stand-in for the weather's tool: it tells what the topic does."""
    from drivemcp.config import ServiceConfig
    from drivemcp.service import Service

    def build(config: ServiceConfig, node: Node) -> None:
        @node.tool(deadline_ms=40)
        def assess_weather() -> Conditions:
            """The weather."""
            return road.weather

    b.start(Service("weather", ServiceConfig, build))


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Road]:
    """A drive in Germany, in the rain."""
    out: Path = tmp_path_factory.mktemp("drive")
    with bus() as b:
        b.start(RULES)
        b.start(ARBITER, ArbiterConfig(out_dir=str(out)))
        start_car(b)
        b.start(SERVICE, CONFIG)
        road = Road(b)
        start_weather(b, road)
        here = (fact("jurisdiction", "DEU"), fact("units", "km/h"), fact("road_type", "urban"))
        road.until(*here, want="Water on the road")
        yield road


def test_a_snapshot_leads_to_one_advisory_and_one_trace(drive: Road) -> None:
    before = len(drive.traces.wait_count(len(drive.advisories.messages)))
    began = time.monotonic()
    advisory = drive.step()
    took_ms = 1e3 * (time.monotonic() - began)
    traces = drive.traces.wait_count(before + 1)
    assert len(traces) == before + 1
    assert traces[-1].advisory == advisory
    assert advisory.snapshot_to_advice_ms is not None
    assert 0.0 < advisory.snapshot_to_advice_ms < took_ms


def test_the_law_comes_from_the_rules_with_its_section(drive: Road) -> None:
    advisory = drive.step()
    assert advisory.legal_limit is not None
    assert advisory.legal_limit.mps == pytest.approx(50 / 3.6)
    assert advisory.target_mps is not None
    assert advisory.target_mps < 0.8 * 50 / 3.6, "it rains"
    assert advisory.citations[0].document


def test_the_drive_is_run_again_from_its_own_traces(drive: Road) -> None:
    drive.step(limit_sign("limit:30"))
    drive.step()
    traces = drive.traces.wait_count(len(drive.advisories.messages))
    state = State()
    for trace in traces:
        wire = msgspec.json.decode(msgspec.json.encode(trace), type=TraceRecord)
        again = redecide(state, wire)
        assert again.differences == (), f"tick {trace.tick}"
        state = again.ticked.state


def test_a_hazard_is_decided_by_the_arbiter_and_its_act_withheld(drive: Road) -> None:
    drive.speed_mps = 20.0
    began = time.monotonic()
    kinds = set()
    gap, withheld = 30.0, ""
    while gap >= 3.0 and not withheld:  # as many steps as the machine makes in 2.25 s
        gap = 30.0 - 12.0 * (time.monotonic() - began)  # really closing in, at 12 m/s
        advisory = drive.step(tracks=(actor(gap, 12.0, track_id=77),), lead=77)
        kinds.add(advisory.kind)
        withheld = advisory.act_withheld
    assert withheld == "no grant"
    assert "SPEAK" in kinds, "the driver was told, if not at this very tick"
    assert "ACT" not in kinds
    drive.speed_mps = 12.0


@pytest.mark.parametrize(
    ("question", "expected"),
    [
        ("What does this sign mean?", "This sign means"),
        ("Are we in mph now?", "No: we are in Germany, limits are in km/h."),
        ("Why did the limit drop?", "The limit is"),
        ("A warning light came on; is it safe?", "Lit: anti-lock brakes."),
    ],
)
def test_the_four_questions_are_answered_from_the_running_drive_with_citations(
    drive: Road, question: str, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(question_module, "DEADLINE_MS", 4000.0)
    drive.step(fact("sign", "stop", track_id=50, distance_m=30.0))
    outcome = drive.b.call("ask", {"question": question})
    assert outcome.ok, outcome.error
    assert outcome.result is not None
    assert expected in outcome.result["text"]
    assert outcome.result["citations"]


def test_preferences_change_while_driving(drive: Road) -> None:
    outcome = drive.b.call("set_preferences", {"language": "de", "unit": "mph"})
    assert outcome.ok
    advisory = drive.step()
    assert (advisory.language, advisory.unit) == ("de", "mph")
    drive.b.call("set_preferences", {"language": "en", "unit": "km/h"})
    assert drive.step().language == "en"
    assert drive.b.call("set_preferences", {"language": "xx"}).status == "tool_error"


def test_who_asks_for_the_preferences_changes_and_keeps_nothing() -> None:
    kept: list[Any] = []

    def build(config: ServiceConfig, node: Node) -> None:
        @node.tool(deadline_ms=1000, read_only=False)
        def remember(kind: str, key: str, value: dict[str, Any]) -> dict[str, bool]:
            """Keep it."""
            kept.append(value)
            return {}

    with bus() as b:
        b.start(SERVICE, CONFIG)
        b.start(Service("logger", ServiceConfig, build))
        units = itertools.cycle(["mph", "km/h"])
        assert wait_settled(lambda: b.call("set_preferences", {"unit": next(units)}).ok and bool(kept), 10.0)
        told = kept[-1]
        assert b.call("set_preferences").result == told
        assert b.call("set_preferences", {"unit": told["unit"]}).result == told
        assert kept[-1] is told


def test_feedback_reaches_the_arbiter_once_and_is_traced(drive: Road, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(service, "LEAST_MS", 4000.0)  # an arbiter that misses the tick never hears of the label
    answer = drive.b.call("feedback", {"label": "late_warning"})
    assert answer.result is not None
    assert "steps in a little sooner" in answer.result["changes"]
    assert "one label every" in drive.b.call("feedback", {"label": "late_warning"}).error
    drive.step()
    trace = drive.traces.wait_count(len(drive.advisories.messages))[-1]
    assert trace.request is not None
    assert [each.label for each in trace.request.feedback] == ["late_warning"]
    assert trace.decision.metrics.delta == pytest.approx(0.18, abs=1e-3)


def test_alone_it_still_advises_and_says_what_is_missing() -> None:
    with bus() as b:
        b.start(SERVICE, CONFIG)
        road = Road(b)
        advisory = road.step()
        assert "arbiter" in advisory.degraded
        assert "rules" in advisory.degraded
        trace = road.traces.wait_count(1)[0]
        assert trace.decision.profile == "local"


def test_silent_sensors_are_ticked_over() -> None:
    with bus() as b:
        b.start(SERVICE, OrchestratorConfig(silence_s=0.2, start_s=0.3))
        traces = b.collect(topics.TRACE)
        watched = traces.wait(lambda trace: trace.cause == "watchdog" and trace.tick >= 2)
        assert "perception/tracks" in watched.advisory.degraded


class Stepped:
    """The wall's clock, until it is stepped."""

    by_ns = 0

    def now_ns(self) -> int:
        """With the step."""
        return time.time_ns() + self.by_ns


def test_a_clock_that_is_stepped_back_does_not_stop_the_watchdog(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = Stepped()
    monkeypatch.setattr(node_module, "WallClock", lambda: clock)
    with bus() as b:
        traces = b.collect(topics.TRACE)
        b.start(SERVICE, msgspec.structs.replace(CONFIG, silence_s=0.2, start_s=0.2))
        traces.wait(lambda trace: trace.cause == "watchdog")
        before_ns = clock.now_ns()
        clock.by_ns = -3600 * 10**9
        traces.wait(lambda trace: trace.stamp_ns < before_ns - 1800 * 10**9)


def test_malformed_payloads_do_not_stop_the_ticks() -> None:
    with bus() as b:
        node = b.start(SERVICE, CONFIG)
        road = Road(b)
        road.step()
        nan = float("nan")
        road.node.publish(topics.EGO, Ego(speed_mps=nan))
        road.node.publish(topics.CONDITIONS, conditions(mu=nan, factor=float("inf")))
        road.node.publish(topics.FACTS, Facts(facts=(limit_sign("limit:30", confidence=nan),)))
        stood = road.step().target_mps
        assert stood is not None
        advisory = road.step(tracks=(actor(10.0, 1.0, x_m=nan),))
        assert advisory.target_mps is not None
        assert advisory.target_mps <= stood + 1e-9
        assert node is not None
        assert threading.active_count() > 0


def in_time(drive: Road) -> Advisory:
    """Of a picture that did not wait: one that did is itself missed, and then nothing is said of the LiDAR."""
    steps = (drive.step() for _ in range(50))
    return next(advisory for advisory in steps if "perception/tracks" not in advisory.degraded)


def test_a_lidar_that_falls_silent_is_told_by_name(drive: Road) -> None:
    told = []
    for drive.lidar in (False, True, False, False, True):
        told.append("lidar" in in_time(drive).degraded)
    assert told == [False, False, True, True, False], "it is missed once it was there"

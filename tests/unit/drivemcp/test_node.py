"""Nodes on a real in-process Zenoh session."""

import threading
import time
from collections.abc import Callable
from queue import SimpleQueue

import msgspec
import pytest

from drivemcp.bus.session import Bus, Querier, Query, Reply, wait_settled
from drivemcp.config import ServiceConfig
from drivemcp.errors import ContractError, ToolFailed
from drivemcp.node import Node
from drivemcp.service import Service
from drivemcp.testing import TestBus, bus
from drivemcp.tools.client import LATE_GRACE_S, LOCKSTEP_BOUND_MS, ToolClient
from drivemcp.tools.definition import define
from proto import topics
from proto.keys import alive_key, catalogue_key, tool_key
from proto.sensors import GnssFix
from proto.tools import CallHead, CallRecord, Catalogue
from proto.vehicle import Ego
from proto.weather import Conditions


class Wetness(msgspec.Struct, frozen=True, kw_only=True):
    """An answer."""

    wet: bool
    mu: float


def build(config: ServiceConfig, node: Node) -> None:
    """A small service for these tests."""
    release = threading.Event()
    node.on_close(release.set)

    @node.tool(deadline_ms=40)
    def how_wet(rain_mm_h: float, strict: bool = False) -> Wetness:
        """How wet the road is."""
        if rain_mm_h < 0:
            raise ToolFailed("rain_mm_h is negative; give millimetres an hour")
        return Wetness(wet=rain_mm_h > 0.1, mu=0.8 if strict else 0.5)

    @node.tool(deadline_ms=40)
    def hang() -> Wetness:
        """Does not answer until the service closes."""
        release.wait(20)
        return Wetness(wet=True, mu=0.1)

    @node.tool(deadline_ms=40)
    def burst() -> Wetness:
        """Raises what it should not."""
        raise ZeroDivisionError

    @node.tool(deadline_ms=40, capability="actuation")
    def brake(value: float) -> Wetness:
        """Must never run here."""
        raise AssertionError


WET = Service("wet", ServiceConfig, build)


@pytest.fixture
def wet_bus():  # type: ignore[no-untyped-def]
    with bus() as test_bus:
        test_bus.start(WET)
        yield test_bus


def test_a_published_message_arrives_with_its_number_and_stamp() -> None:
    with bus() as b:
        seen = b.collect(topics.EGO)
        sender = b.node("can")
        sender.publish(topics.EGO, Ego(speed_mps=12.5), stamp_ns=123)
        sender.publish(topics.EGO, Ego(speed_mps=13.0))
        seen.wait_count(2)
        assert [m.speed_mps for m in seen.messages] == [12.5, 13.0]
        assert seen.infos[0].stamp_ns == 123
        assert [i.seq for i in seen.infos] == [1, 2]


def test_a_wrong_type_on_a_topic_is_refused_at_its_sender() -> None:
    with bus() as b, pytest.raises(ContractError, match="can/ego"):
        b.node("can").publish(topics.EGO, GnssFix(x_m=0, y_m=0, heading_rad=0, sigma_m=1))  # type: ignore[misc]


def test_a_malformed_payload_is_counted_and_dropped_and_the_next_message_arrives() -> None:
    with bus() as b:
        seen = b.collect(topics.EGO)
        b.session.publisher("drivemcp/ego/can/ego").put(b"\xc1garbage", b"no head")
        b.node("can").publish(topics.EGO, Ego(speed_mps=1.0))
        assert seen.wait().speed_mps == 1.0
        heard = b.probe._monitors["drivemcp/ego/can/ego"]
        assert (heard.received, heard.malformed) == (1, 1)


def test_a_tool_answers_with_structured_content_and_hashes(wet_bus: TestBus) -> None:
    outcome = wet_bus.call("how_wet", {"rain_mm_h": 3})
    assert outcome.ok
    assert outcome.result == {"wet": True, "mu": 0.5}
    assert len(outcome.arguments_sha256) == len(outcome.result_sha256) == 64


@pytest.mark.parametrize(
    ("tool", "arguments", "status", "word"),
    [
        ("how_wet", {"rain_mm_h": "much"}, "tool_error", "rain_mm_h"),
        ("how_wet", {}, "tool_error", "rain_mm_h"),
        ("how_wet", {"rain_mm_h": 1, "extra": 1}, "tool_error", "extra"),
        ("how_wet", {"rain_mm_h": -1}, "tool_error", "negative"),
        ("how_wet", {"rain_mm_h": "\ud800"}, "protocol_error", "no Unicode"),
        ("burst", {}, "tool_error", "ZeroDivisionError"),
        ("brake", {"value": 3}, "protocol_error", "actuation is off"),
        ("nowhere", {}, "unavailable", "nowhere"),
        ("*", {}, "unavailable", "*"),
        ("../how_wet", {}, "unavailable", "how_wet"),
    ],
)
def test_a_bad_call_is_an_outcome_that_says_why(
    wet_bus: TestBus, tool: str, arguments: dict[str, object], status: str, word: str
) -> None:
    outcome = wet_bus.call(tool, arguments)
    assert outcome.status == status
    assert word in outcome.error


def test_a_tool_that_hangs_costs_its_deadline_and_no_more_and_the_others_answer(wet_bus: TestBus) -> None:
    wet_bus.call("how_wet", {"rain_mm_h": 1})
    hung, answered = wet_bus.probe.call_all([("hang", {}, 60.0), ("how_wet", {"rain_mm_h": 1}, 5000.0)])
    assert hung.status == "timeout"
    assert hung.elapsed_ms < 3000
    assert answered.ok


def test_a_clock_that_is_stepped_back_prolongs_no_call(wet_bus: TestBus) -> None:
    wet_bus.call("how_wet", {"rain_mm_h": 1})
    hour_ns = 3600 * 10**9
    ahead = iter([hour_ns])  # as the call is sent; afterwards the clock is right

    def stepped_ns() -> int:
        return time.time_ns() + next(ahead, 0)

    probe = wet_bus.probe
    client = ToolClient(
        wet_bus.session,
        vehicle=probe.config.vehicle,
        caller="late",
        log_call=lambda _: None,
        logger=probe.log,
        now_ns=stepped_ns,
    )
    client.discover()
    began_s = time.monotonic()
    (hung,) = client.call_all([("hang", {}, 200.0)])
    assert hung.status == "timeout"
    assert time.monotonic() - began_s < 5.0


def test_the_bus_waits_for_an_answer_as_long_as_the_longest_deadline(
    wet_bus: TestBus, monkeypatch: pytest.MonkeyPatch
) -> None:
    querier, waits = Bus.querier, list[float]()

    def watched(self: Bus, key: str, timeout_s: float) -> Querier:
        waits.append(timeout_s)
        return querier(self, key, timeout_s)

    monkeypatch.setattr(Bus, "querier", watched)
    assert wet_bus.call("how_wet", {"rain_mm_h": 1}).ok
    assert waits
    assert min(waits) >= LOCKSTEP_BOUND_MS / 1e3 + LATE_GRACE_S


def test_a_server_whose_catalogue_was_lost_as_it_appeared_is_found_all_the_same(wet_bus: TestBus) -> None:
    def slow_start() -> Wetness:
        """A tool of a server that is too busy for the first that ask it."""
        raise AssertionError

    vehicle = wet_bus.probe.config.vehicle
    catalogue, tool = catalogue_key(vehicle, "busy"), tool_key(vehicle, "busy", "slow_start")
    offered = Catalogue(server="busy", tools=(define(slow_start, server="busy", deadline_ms=40).entry,))
    asked: list[int] = []

    def list_tools(query: Query) -> None:
        asked.append(len(asked))
        query.drop() if len(asked) <= 2 else query.answer(catalogue, msgspec.json.encode(offered))

    caller = wet_bus.node("caller")
    caller.watch_services()
    assert wait_settled(lambda: "how_wet" in caller.client.discover(), 10.0)
    wet_bus.session.serve(catalogue, list_tools)
    wet_bus.session.serve(tool, lambda query: query.answer(tool, b'{"structuredContent":{"wet":true,"mu":0.5}}'))
    wet_bus.session.announce(alive_key(vehicle, "busy"))
    assert wait_settled(lambda: bool(asked), 10.0)
    assert wait_settled(lambda: caller.call("slow_start", {}, deadline_ms=1000).ok, 20.0)
    assert len(asked) > 2


NO_UTF_8 = (b"\xff", b"\xed\xa0\x80", b"\xc3")


@pytest.mark.parametrize("text", NO_UTF_8)
def test_a_caller_whose_text_is_no_utf_8_is_answered_in_words(wet_bus: TestBus, text: bytes) -> None:
    head = CallHead(call_id="c", caller="probe", deadline_ns=time.time_ns() + 60 * 10**9)
    key = tool_key(wet_bus.probe.config.vehicle, WET.name, "how_wet")
    replies: SimpleQueue[Reply | None] = SimpleQueue()
    for payload, attachment in (
        (b'{"%b":1}' % text, msgspec.msgpack.encode(head)),
        (b"{}", msgspec.msgpack.encode(head).replace(b"probe", text.ljust(5, b"!"))),
    ):
        wet_bus.session.get(key, replies.put, timeout_s=10.0, payload=payload, attachment=attachment)
        reply = replies.get(timeout=11.0)
        assert reply is not None
        assert b"utf-8" in (reply.payload or reply.error or b"")
        assert replies.get(timeout=11.0) is None
    assert wet_bus.call("how_wet", {"rain_mm_h": 3}).ok


def _limits(kmh: int) -> Callable[[ServiceConfig, Node], None]:
    def build(config: ServiceConfig, node: Node) -> None:
        @node.tool(deadline_ms=40)
        def applicable_limit() -> dict[str, int]:
            """A limit."""
            return {"kmh": kmh}

    return build


def test_a_tool_of_the_table_is_its_services_alone_whoever_offers_one_first() -> None:
    with bus() as b:
        caller = b.node("caller")
        caller.watch_services()
        b.start(WET)
        b.start(Service("expert", ServiceConfig, _limits(300)))
        assert wait_settled(lambda: "how_wet" in caller.client.discover(), 10.0)
        assert "applicable_limit" not in caller.client.discover()
        b.start(Service("rules", ServiceConfig, _limits(50)))
        assert wait_settled(lambda: "applicable_limit" in caller.client.discover(), 10.0)
        assert b.call("applicable_limit", caller=caller).result == {"kmh": 50}


def test_the_catalogue_has_schemas_and_the_capability_of_each_tool(wet_bus: TestBus) -> None:
    entry = wet_bus.probe.client.discover()["how_wet"]
    assert entry.inputSchema["type"] == "object"
    assert entry.inputSchema["required"] == ["rain_mm_h"]
    assert set(entry.outputSchema["properties"]) == {"wet", "mu"}
    assert entry.meta.capability == "context"
    assert entry.meta.server == "wet"


def test_every_call_is_logged_by_both_sides_with_the_same_hash(wet_bus: TestBus) -> None:
    calls = wet_bus.collect(topics.CALLS)
    outcome = wet_bus.call("how_wet", {"rain_mm_h": 1})

    def find(side: str) -> CallRecord:
        def fits(record: CallRecord) -> bool:
            return record.side == side and record.tool == "how_wet"

        message = calls.wait(lambda message: any(map(fits, message.records)))
        return next(filter(fits, message.records))

    caller = find("caller")
    server = find("server")
    assert caller.arguments_sha256 == server.arguments_sha256 == outcome.arguments_sha256
    assert caller.result_sha256 == server.result_sha256
    assert caller.call_id == server.call_id


def test_a_tool_without_docstring_or_types_is_refused_when_it_is_defined() -> None:
    with bus() as b:
        node = b.node("x")
        with pytest.raises(ContractError, match="docstring"):
            node.tools.add(lambda: None, deadline_ms=1, name="nameless")


def test_latest_and_health_follow_a_subscribed_topic() -> None:
    with bus() as b:
        seen = b.collect(topics.CONDITIONS)
        assert not b.probe.health(topics.CONDITIONS).alive
        conditions = Conditions(
            precipitation="rain", rain_mm_h=5.0, visibility_m=300.0, mu_low=0.4, mu_high=0.6, risk_level="moderate",
            speed_factor=0.8, following_factor=1.4, confidence=0.9,
        )  # fmt: skip
        b.node("weather").publish(topics.CONDITIONS, conditions)
        seen.wait()
        latest = b.probe.latest(topics.CONDITIONS)
        assert latest is not None
        assert latest.message == conditions
        assert b.probe.health(topics.CONDITIONS).ok


def test_a_node_that_ends_handles_what_it_had_received() -> None:
    heard: list[float | None] = []
    busy, never = threading.Event(), threading.Event()

    def behind(ego: Ego, _: object) -> None:
        if not heard:
            busy.set()
            never.wait(0.3)  # long enough for the rest to be sent, and the end to begin
        heard.append(ego.speed_mps)

    with bus() as b:
        node = b.node("slow")
        node.subscribe(topics.EGO, behind)
        sender = b.node("can")
        for n in range(50):
            sender.publish(topics.EGO, Ego(speed_mps=float(n)))
        assert busy.wait(10.0)
        node.close()
        assert heard == [float(n) for n in range(50)]
        assert node.unhandled == 0

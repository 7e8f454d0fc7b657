"""Whatever comes on a topic or a tool: a clear error or a counted drop, never a crash, never a raised target."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivemcp.bus.session import Publisher
from drivemcp.node import Node
from drivemcp.registry import load_service
from drivemcp.testing import TestBus, bus
from proto.keys import topic_key
from proto.tools import Outcome
from proto.topics import TOPICS, Topic
from proto.wire import PubHead
from tests.golden.make import sample

SERVICES = ("can", "weather", "rules", "retrieval", "arbiter", "orchestrator", "logger")
QUICK = {"retrieval": {"encoder": "none"}}
BURST = settings(
    max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow]
)
JSON = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**70), 2**70) | st.floats(allow_nan=False) | st.text(max_size=30),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=12), inner, max_size=3),
    max_leaves=8,
)


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[TestBus, list[Node]]]:
    """Most of the stack on one in-process bus."""
    folder = tmp_path_factory.mktemp("out")
    with bus() as b:
        nodes = [
            b.start(service, configured(service, name, folder)) for name in SERVICES for service in [load_service(name)]
        ]
        b.probe.client.discover()
        yield b, nodes


def configured(service: Any, name: str, folder: Path) -> Any:
    """The default configuration, with its files in a folder of the test."""
    return msgspec.convert({"out_dir": str(folder), **QUICK.get(name, {})}, service.config)


def key_of(topic: Topic[Any]) -> str:
    """A key of the topic."""
    return topic_key("ego", topic, "front" if topic.has_id else None)


class Vandal:
    """Puts anything on any key, numbered as a well-behaved publisher would."""

    def __init__(self, b: TestBus) -> None:
        self._session = b.session
        self._publishers: dict[str, Publisher] = {}
        self._seq = 0

    def put(self, topic: Topic[Any], payload: bytes, head: bytes | None = None) -> None:
        """Put."""
        self._seq += 1
        good = PubHead(seq=self._seq, stamp_ns=1, sent_ns=1, publisher="vandal", epoch=1)
        key = key_of(topic)
        publisher = self._publishers.setdefault(key, self._session.publisher(key))
        publisher.put(payload, msgspec.msgpack.encode(good) if head is None else head)


@pytest.fixture(scope="module")
def vandal(running: tuple[TestBus, list[Node]]) -> Vandal:
    """One for the module."""
    return Vandal(running[0])


def all_answer(b: TestBus) -> None:
    """Every worker and every tool server is still there."""
    for tool, arguments in (
        ("get_vehicle_snapshot", {}), ("assess_weather", {}), ("list_rulepacks", {}), ("recall", {"kind": "preferences"}),
        ("retrieve", {"query": "speed limit"}),
    ):  # fmt: skip
        outcome = b.call(tool, arguments)
        assert outcome.status in ("ok", "tool_error"), (tool, outcome)


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
@BURST
@given(payload=st.binary(max_size=60), head=st.none() | st.binary(max_size=20))
def test_bytes_that_are_no_message_are_dropped(
    running: tuple[TestBus, list[Node]], vandal: Vandal, topic: Topic[Any], payload: bytes, head: bytes | None
) -> None:
    vandal.put(topic, payload, head)
    assert all(node._worker.is_alive() for node in running[1])


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
def test_a_cut_message_and_one_of_another_type_are_dropped_and_the_services_go_on(
    running: tuple[TestBus, list[Node]], vandal: Vandal, topic: Topic[Any]
) -> None:
    codec = msgspec.msgpack if topic.encoding == "msgpack" else msgspec.json
    whole = codec.encode(sample(topic.message))
    for end in (1, len(whole) // 2, len(whole) - 1):
        vandal.put(topic, whole[:end])
    vandal.put(topic, codec.encode({"nonsense": True}))
    vandal.put(topic, codec.encode({"nonsense": "@"}).replace(b"@", b"\xff"))
    vandal.put(
        topic,
        whole,
        msgspec.msgpack.encode(PubHead(seq=1, stamp_ns=1, sent_ns=1, publisher="@", epoch=1)).replace(b"@", b"\xff"),
    )
    vandal.put(
        topic, whole
    )  # well-formed, and senseless: enormous, negative or contradictory values are a service's own matter
    all_answer(running[0])


@BURST
@given(arguments=JSON)
def test_every_tool_answers_any_json_with_a_result_or_a_clear_error(
    running: tuple[TestBus, list[Node]], arguments: Any
) -> None:
    b, _ = running
    known = [
        entry
        for entry in b.probe.catalogue().values()
        if entry.name not in ("send_diagnostic_request", "send_obd_request")
    ]
    outcomes = b.probe.call_all([(entry.name, arguments, 8000.0) for entry in known])
    for outcome in outcomes:
        check(outcome)


def check(outcome: Outcome) -> None:
    """A result, or an error in words."""
    assert outcome.status in ("ok", "tool_error", "protocol_error", "busy"), outcome
    assert outcome.ok or len(outcome.error) > 3

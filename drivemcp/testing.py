"""Helpers for tests: a real Zenoh session inside the process, services on it, and waits that end."""

import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from socketserver import BaseServer
from typing import Any, Generic, TypeVar

import msgspec

from drivemcp.bus.received import Received
from drivemcp.bus.session import Bus, open_bus
from drivemcp.config import BusConfig, ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from proto.tools import Outcome
from proto.topics import Topic

M = TypeVar("M", bound=msgspec.Struct)
S = TypeVar("S", bound=BaseServer)
WAIT_S = 10.0


class TestBus:
    """An in-process bus. Everything started on it is closed with it."""

    __test__ = False

    def __init__(self, session: Bus) -> None:
        self.session = session
        self._nodes: list[Node] = []
        self._probe: Node | None = None

    def start(self, service: Service[Any], config: ServiceConfig | None = None) -> Node:
        """Start a service, with its default configuration unless told otherwise."""
        node = service.start(self.session, service.config() if config is None else config)
        self._nodes.append(node)
        return node

    def node(self, name: str, config: ServiceConfig | None = None, *, announce: bool = False) -> Node:
        """A bare node, opened: publish, subscribe and call as a service would."""
        node = Node(self.session, name, config or ServiceConfig())
        node.open(announce=announce)
        self._nodes.append(node)
        return node

    @property
    def probe(self) -> Node:
        """A bare node of the test itself."""
        if self._probe is None:
            self._probe = self.node("probe")
        return self._probe

    def call(
        self,
        tool: str,
        arguments: Mapping[str, Any] | None = None,
        *,
        deadline_ms: float = 5000.0,
        caller: Node | None = None,
    ) -> Outcome:
        """Call a tool from the probe, or another node, discovering it first."""
        node = caller or self.probe
        if tool not in node.catalogue():
            node.client.discover()
        return node.call(tool, arguments or {}, deadline_ms=deadline_ms)

    def collect(self, topic: Topic[M], *, id: str | None = None) -> "Collected[M]":
        """Follow a topic from now on."""
        return Collected(self.probe, topic, id)

    def wait_for(
        self,
        topic: Topic[M],
        predicate: Callable[[M], bool] = lambda _: True,
        timeout_s: float = WAIT_S,
        *,
        id: str | None = None,
        after: Callable[[], None] = lambda: None,
    ) -> M:
        """The first message that satisfies the predicate. `after` runs once the subscription stands. Raises TimeoutError."""
        collected = self.collect(topic, id=id)
        after()
        return collected.wait(predicate, timeout_s)

    def close(self) -> None:
        """Close all nodes."""
        for node in reversed(self._nodes):
            node.close()


class Collected(Generic[M]):
    """Messages of one topic as they come."""

    def __init__(self, probe: Node, topic: Topic[M], id: str | None) -> None:
        self._changed = threading.Condition()
        self.messages: list[M] = []
        self.infos: list[Received[M]] = []
        probe.subscribe(topic, self._add, id=id)

    def _add(self, message: M, info: Received[M]) -> None:
        with self._changed:
            self.messages.append(message)
            self.infos.append(info)
            self._changed.notify_all()

    def wait(self, predicate: Callable[[M], bool] = lambda _: True, timeout_s: float = WAIT_S) -> M:
        """The first message, already there or to come, that satisfies the predicate. Raises TimeoutError."""
        found: list[M] = []

        def look() -> bool:
            found.extend(message for message in self.messages if predicate(message))
            return bool(found)

        with self._changed:
            if not self._changed.wait_for(look, timeout_s):
                raise TimeoutError(f"no such message within {timeout_s} s; {len(self.messages)} others came")
            return found[0]

    def wait_count(self, count: int, timeout_s: float = WAIT_S) -> list[M]:
        """At least `count` messages. Raises TimeoutError."""
        with self._changed:
            if not self._changed.wait_for(lambda: len(self.messages) >= count, timeout_s):
                raise TimeoutError(f"{len(self.messages)} of {count} messages within {timeout_s} s")
            return list(self.messages)


@contextmanager
def bus() -> Iterator[TestBus]:
    """An in-process session with no endpoints at all."""
    with open_bus(BusConfig(mode="peer")) as session:
        test_bus = TestBus(session)
        try:
            yield test_bus
        finally:
            test_bus.close()


@contextmanager
def serving(server: S) -> Iterator[S]:
    """A local server that answers on a thread of its own until the end of the test."""
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}, daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        server.server_close()
        thread.join(5.0)

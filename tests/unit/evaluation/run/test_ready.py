"""A run begins once every service that asks knows the tools of all others."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from drivemcp.testing import TestBus, bus
from evaluation.run.ready import RunError, wait_for_tools

WAIT_S = 20.0


def asks(config: ServiceConfig, node: Node) -> None:
    node.watch_services()


def answers(config: ServiceConfig, node: Node) -> None:
    @node.tool(deadline_ms=1000)
    def retrieve() -> dict[str, int]:
        """Passages."""
        return {}


@contextmanager
def held_up(on: TestBus) -> Iterator[tuple[Node, threading.Event]]:
    """A retrieval whose only worker is busy, so that it does not answer for its catalogue, until the event."""
    free, taken = threading.Event(), threading.Event()

    def build(config: ServiceConfig, node: Node) -> None:
        answers(config, node)

        @node.tool(deadline_ms=1000)
        def busy() -> dict[str, int]:
            """Keeps its worker."""
            taken.set()
            free.wait(WAIT_S)
            return {}

    node = on.start(Service("retrieval", ServiceConfig, build), ServiceConfig(tool_workers=1))
    on.probe.client.discover()
    caller = threading.Thread(target=on.call, args=("busy",), kwargs={"deadline_ms": 1e3 * WAIT_S}, daemon=True)
    caller.start()
    assert taken.wait(WAIT_S)
    try:
        yield node, free
    finally:
        free.set()
        caller.join(WAIT_S)


def test_the_tools_are_there_when_the_wait_is_over() -> None:
    with bus() as b:
        server = b.start(Service("retrieval", ServiceConfig, answers))
        askers = [b.start(Service(name, ServiceConfig, asks)) for name in ("rules", "orchestrator")]
        wait_for_tools([server, *askers])
        assert all("retrieve" in asker.catalogue() for asker in askers)


def test_a_catalogue_that_comes_late_is_waited_for() -> None:
    with bus() as b, held_up(b) as (server, free):
        asker = b.start(Service("rules", ServiceConfig, asks))
        assert "retrieve" not in asker.catalogue()
        timer = threading.Timer(1.5, free.set)  # later than the asker's own patience: it has to be asked anew
        timer.start()
        wait_for_tools([server, asker], WAIT_S)
        assert "retrieve" in asker.catalogue()
        timer.join(WAIT_S)


def test_what_never_comes_is_named_with_its_service() -> None:
    with bus() as b, held_up(b) as (server, _):
        asker = b.start(Service("orchestrator", ServiceConfig, asks))
        with pytest.raises(RunError, match=r"orchestrator does not know .* busy of retrieval, retrieve of retrieval"):
            wait_for_tools([server, asker], 0.3)


def test_only_what_a_service_may_call_is_waited_for() -> None:
    with bus() as b, held_up(b) as (server, _):
        alone = b.start(Service("weather", ServiceConfig, asks))
        wait_for_tools([server, alone], 0.3)
        assert "retrieve" not in alone.catalogue()

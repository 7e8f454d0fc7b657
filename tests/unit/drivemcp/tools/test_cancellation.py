"""A call that its caller gives up ends at once, its server is told, and both write it down with its trace."""

import threading
import time
from collections.abc import Callable

import msgspec

from drivemcp.bus.session import wait_settled
from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from drivemcp.testing import Collected, bus
from drivemcp.tools.pending import Pending
from proto import topics
from proto.tools import CallHead, CallRecord, CallRecords

TRACE = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01"


class Slow:
    """One worker, so that a second call waits for the first."""

    def __init__(self) -> None:
        self.begun, self.go = threading.Semaphore(0), threading.Event()
        self.runs = 0

    def build(self, config: ServiceConfig, node: Node) -> None:
        @node.tool(deadline_ms=5000)
        def slow() -> dict[str, int]:
            """Runs until it is let go."""
            self.runs += 1
            self.begun.release()
            self.go.wait(10.0)
            return {"runs": self.runs}

    @property
    def service(self) -> Service[ServiceConfig]:
        """As a service."""
        return Service("slow", ServiceConfig, self.build)


def _records(calls: Collected[CallRecords], side: str, count: int) -> list[CallRecord]:
    def found() -> list[CallRecord]:
        return [each for message in calls.messages for each in message.records if each.side == side]

    assert wait_settled(lambda: len(found()) >= count, 10.0)
    return found()


def _begun(caller: Node, wake: Callable[[], None] = lambda: None) -> Pending:
    begun = caller.client.begin("slow", {}, 60_000, wake, traceparent=TRACE)
    assert isinstance(begun, Pending)
    return begun


def test_a_cancelled_call_ends_at_once_and_what_still_waits_is_never_run() -> None:
    slow, woken = Slow(), threading.Semaphore(0)
    with bus() as b:
        b.start(slow.service, ServiceConfig(tool_workers=1))
        calls = b.collect(topics.CALLS)
        caller = b.node("orchestrator")
        caller.client.discover()
        running = _begun(caller, woken.release)
        assert slow.begun.acquire(timeout=10.0)
        waiting = _begun(caller, woken.release)
        for pending in (running, waiting):
            caller.client.cancel(pending)
            assert woken.acquire(timeout=10.0)
            outcome = caller.client.finish(pending)
            assert (outcome.status, outcome.error) == ("unavailable", "cancelled by the caller")
        slow.go.set()
        ran, dropped = sorted(_records(calls, "server", 2), key=lambda each: each.status)
        assert (ran.status, ran.error) == ("ok", "cancelled by the caller; the work was done")
        assert (dropped.status, slow.runs) == ("unavailable", 1)
        assert {each.traceparent for side in ("server", "caller") for each in _records(calls, side, 2)} == {TRACE}
        assert caller.call("slow", {}, deadline_ms=5000).result == {"runs": 2}


def test_what_is_over_stays_as_it_is() -> None:
    slow, woken = Slow(), threading.Event()
    slow.go.set()
    with bus() as b:
        b.start(slow.service)
        b.probe.client.discover()
        begun = _begun(b.probe, woken.set)
        assert woken.wait(10.0)
        b.probe.client.cancel(begun)
        assert b.probe.client.finish(begun).result == {"runs": 1}
        assert b.probe.call("slow", {}, deadline_ms=5000).ok


def test_a_server_that_knows_no_cancelling_runs_nothing_for_it() -> None:
    head = CallHead(call_id="1", caller="a", deadline_ns=0, cancels=True)
    assert msgspec.msgpack.decode(msgspec.msgpack.encode(head))["deadline_ns"] < time.time_ns()

"""A call that its caller gives up ends at once, its server is told, and both write it down with its trace."""

import threading
import time

import msgspec

from drivemcp.bus.session import wait_settled
from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from drivemcp.testing import Collected, bus
from drivemcp.tools.pending import Cancellation
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


def test_a_cancelled_call_ends_at_once_and_what_still_waits_is_never_run() -> None:
    slow = Slow()
    with bus() as b:
        b.start(slow.service, ServiceConfig(tool_workers=1))
        calls = b.collect(topics.CALLS)
        caller = b.node("orchestrator")
        caller.client.discover()
        running, waiting = Cancellation(), Cancellation()
        outcomes = {}

        def call(name: str, cancellation: Cancellation) -> None:
            outcomes[name] = caller.call("slow", {}, deadline_ms=60_000, traceparent=TRACE, cancellation=cancellation)

        threads = [threading.Thread(target=call, args=each) for each in (("running", running), ("waiting", waiting))]
        threads[0].start()
        assert slow.begun.acquire(timeout=10.0)
        threads[1].start()
        assert wait_settled(lambda: len(caller.client._waiting) == 2, 10.0)
        begun_s = time.monotonic()
        running.cancel()
        waiting.cancel()
        for thread in threads:
            thread.join(10.0)
        assert time.monotonic() - begun_s < 10.0, "neither waited for its deadline"
        for outcome in outcomes.values():
            assert (outcome.status, outcome.error) == ("unavailable", "cancelled by the caller")
        slow.go.set()
        ran, dropped = sorted(_records(calls, "server", 2), key=lambda each: each.status)
        assert (ran.status, ran.error) == ("ok", "cancelled by the caller; the work was done")
        assert (dropped.status, slow.runs) == ("unavailable", 1)
        assert {each.traceparent for side in ("server", "caller") for each in _records(calls, side, 2)} == {TRACE}
        assert caller.call("slow", {}, deadline_ms=5000).result == {"runs": 2}


def test_what_is_cancelled_beforehand_is_not_waited_for_and_what_is_over_stays_as_it_is() -> None:
    slow = Slow()
    slow.go.set()
    with bus() as b:
        b.start(slow.service)
        before, after = Cancellation(), Cancellation()
        before.cancel()
        b.probe.client.discover()
        assert b.probe.call("slow", {}, deadline_ms=60_000, cancellation=before).status == "unavailable"
        assert b.probe.call("slow", {}, deadline_ms=5000, cancellation=after).ok
        after.cancel()
        assert b.probe.call("slow", {}, deadline_ms=5000).ok


def test_a_server_that_knows_no_cancelling_runs_nothing_for_it() -> None:
    head = CallHead(call_id="1", caller="a", deadline_ns=0, cancels=True)
    assert msgspec.msgpack.decode(msgspec.msgpack.encode(head))["deadline_ns"] < time.time_ns()

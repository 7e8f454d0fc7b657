"""Progress, cancellation and traces of a call through the gateway."""

import threading
from collections.abc import Callable
from typing import Any

import anyio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcp.client.client import Client

from drivemcp.bus.session import wait_settled
from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from proto import topics
from proto.tools import CallRecord
from services.gateway.calls import traceparent_of
from tests.unit.services.gateway.conftest import Running

TRACE = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01"
ERAS = pytest.mark.parametrize("era", ["legacy", "auto"])


class Long:
    """A tool that runs until it is let go."""

    def __init__(self) -> None:
        self.begun, self.go = threading.Event(), threading.Event()

    def build(self, config: ServiceConfig, node: Node) -> None:
        @node.tool(deadline_ms=20_000)
        def long() -> dict[str, Any]:
            """Waits."""
            self.begun.set()
            self.go.wait(20.0)
            return {"done": True}


def _start(running: Running, long: Long) -> Callable[[str], list[CallRecord]]:
    calls = running.bus.collect(topics.CALLS)
    running.bus.start(Service("long", ServiceConfig, long.build))
    assert wait_settled(lambda: "long" in running.gateway.catalogue(), 5.0)
    return lambda side: [
        each for message in calls.messages for each in message.records if (each.tool, each.side) == ("long", side)
    ]


@ERAS
def test_a_long_call_tells_its_progress_and_its_trace_is_in_the_servers_log(running: Running, era: str) -> None:
    long, told = Long(), list[tuple[float, float | None]]()
    records = _start(running, long)

    async def on_progress(progress: float, total: float | None, message: str | None) -> None:
        told.append((progress, total))
        if len(told) == 2:
            long.go.set()

    async def talk() -> None:
        async with Client(running.url, mode=era) as client:
            trace: Any = {"traceparent": TRACE}
            found = await client.call_tool("long", {}, progress_callback=on_progress, meta=trace)
            assert found.structured_content == {"done": True}

    anyio.run(talk)
    assert len(told) >= 2
    assert told[0][0] < told[1][0] < told[1][1] == 22.0  # type: ignore[operator]
    assert wait_settled(lambda: bool(records("server") and records("caller")), 5.0)
    assert {each.traceparent for side in ("server", "caller") for each in records(side)} == {TRACE}


@ERAS
def test_a_call_that_the_client_gives_up_is_given_up_on_the_bus(running: Running, era: str) -> None:
    long = Long()
    records = _start(running, long)

    async def talk() -> None:
        async with Client(running.url, mode=era) as client, anyio.create_task_group() as group:
            group.start_soon(client.call_tool, "long", {})
            await anyio.to_thread.run_sync(long.begun.wait, 10.0)
            group.cancel_scope.cancel()

    anyio.run(talk)
    assert wait_settled(lambda: bool(records("caller")), 10.0)
    assert "cancelled by the caller" in records("caller")[0].error
    long.go.set()
    assert wait_settled(lambda: bool(records("server")), 10.0)
    assert "cancelled by the caller" in records("server")[0].error


@given(st.one_of(st.text(max_size=70), st.integers(), st.just(TRACE + "\n"), st.just(TRACE.upper())))
def test_what_is_no_traceparent_is_not_passed_on(given: Any) -> None:
    assert traceparent_of({"traceparent": given}) == ""
    assert traceparent_of({"traceparent": TRACE}) == TRACE

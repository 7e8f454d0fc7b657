"""What subscribers of both kinds are told: each change once, spaced, bounded."""

from collections.abc import Awaitable, Callable
from typing import Any

import anyio
import pytest
from mcp import types
from mcp.client.client import Client
from mcp.server.subscriptions import ResourcesListChanged, ResourceUpdated, ToolsListChanged
from mcp.shared.exceptions import MCPError

from drivemcp.config import ServiceConfig
from drivemcp.node import Node
from drivemcp.service import Service
from services.gateway import older_sessions
from services.gateway.changes import EVERY_S, MOST_ADDRESSES, MOST_STREAMS, Changes
from services.gateway.older_sessions import OlderSessions
from tests.unit.services.gateway.conftest import Running

ADVICE, WORLD = "drivemcp://advice/last", "drivemcp://world"
WAIT_S = 10.0


def build_fog(config: ServiceConfig, node: Node) -> None:
    @node.tool(deadline_ms=50)
    def fog() -> dict[str, Any]:
        """A third-party expert's."""
        return {}


async def in_thread(function: Callable[[], Any]) -> None:
    await anyio.to_thread.run_sync(function)


def test_a_stream_hears_of_advice_and_of_nothing_else(running: Running) -> None:
    async def talk() -> None:
        async with Client(running.url) as client:
            with anyio.fail_after(WAIT_S):
                async with client.listen(resource_subscriptions=[ADVICE]) as stream:
                    await in_thread(lambda: running.believe(1))
                    await in_thread(lambda: running.advise(kind="SILENT"))
                    await in_thread(lambda: running.advise(urgency="warning"))
                    assert await anext(stream) == ResourceUpdated(uri=ADVICE)

    anyio.run(talk)


def test_streams_and_sessions_hear_of_tools_that_come_and_go(running: Running) -> None:
    heard: list[str] = []

    async def on_message(message: Any) -> None:
        heard.append(type(message).__name__)

    async def names(client: Client) -> set[str]:
        return {tool.name for tool in (await client.list_tools(cache_mode="bypass")).tools}

    async def talk() -> None:
        async with (
            Client(running.url) as client,
            Client(running.url, mode="legacy", message_handler=on_message) as older,
        ):
            assert older.server_capabilities.tools is not None
            assert older.server_capabilities.tools.list_changed
            await names(older)
            with anyio.fail_after(WAIT_S):
                async with client.listen(tools_list_changed=True) as stream:
                    while "fog" not in await names(client):
                        if "fog" not in running.gateway.catalogue():
                            await in_thread(lambda: running.bus.start(Service("fog", ServiceConfig, build_fog)))
                        assert await anext(stream) == ToolsListChanged()
                    while "ToolListChangedNotification" not in heard:
                        await anyio.sleep(0.01)

    anyio.run(talk)


@pytest.mark.filterwarnings("ignore::mcp.shared.exceptions.MCPDeprecationWarning")
def test_an_older_session_hears_of_what_it_subscribed_to_until_it_no_longer_is(running: Running) -> None:
    heard: list[str] = []

    async def on_message(message: Any) -> None:
        if isinstance(message, types.ResourceUpdatedNotification):
            heard.append(message.params.uri)

    async def talk() -> None:
        async with Client(running.url, mode="legacy", message_handler=on_message) as client:
            await client.subscribe_resource(ADVICE)
            await client.subscribe_resource(WORLD)
            await client.unsubscribe_resource(WORLD)
            with anyio.fail_after(WAIT_S):
                tick = 0
                while not heard:  # the session's own stream opens some time after its first answer
                    tick += 1
                    await in_thread(lambda tick=tick: running.believe(tick))  # type: ignore[misc]
                    await in_thread(lambda tick=tick: running.advise(tick=tick, urgency="alarm"))  # type: ignore[misc]
                    await anyio.sleep(0.02)
            for number in range(MOST_ADDRESSES - 1):
                await client.subscribe_resource(f"drivemcp://decision/{number}")
            with pytest.raises(MCPError, match="at most"):
                await client.subscribe_resource("drivemcp://decision/1000")

    anyio.run(talk)
    assert set(heard) == {ADVICE}


def test_a_hundred_changes_a_moment_are_one_and_the_next_waits() -> None:
    changes = Changes()
    world, advice = ResourceUpdated(uri=WORLD), ResourceUpdated(uri=ADVICE)
    for _ in range(100):
        changes.tell(world)
        changes.tell(advice)
        changes.tell(ResourcesListChanged())
    ready, _ = changes._ready(100.0)
    assert ready == [advice, ResourcesListChanged(), world]
    changes.tell(world)
    waiting, wait_s = changes._ready(100.1)
    assert not waiting
    assert wait_s == pytest.approx(EVERY_S[world] - 0.1)
    changes.tell(advice)
    assert changes._ready(100.2)[0] == []
    changes.tell(advice, urgent=True)
    assert changes._ready(100.2)[0] == [advice]


def test_streams_are_bounded(running: Running) -> None:
    async def refused(attempt: Callable[[], Awaitable[Any]]) -> None:
        with pytest.raises(MCPError):
            await attempt()

    async def talk() -> None:
        async with Client(running.url) as client:
            many = [f"drivemcp://decision/{number}" for number in range(MOST_ADDRESSES + 1)]
            await refused(client.listen(resource_subscriptions=many).__aenter__)
            async with anyio.create_task_group() as group:
                opened = anyio.Semaphore(0)

                async def hold() -> None:
                    async with client.listen(tools_list_changed=True):
                        opened.release()
                        await anyio.sleep_forever()

                for _ in range(MOST_STREAMS):
                    group.start_soon(hold)
                for _ in range(MOST_STREAMS):
                    await opened.acquire()
                await refused(client.listen(tools_list_changed=True).__aenter__)
                group.cancel_scope.cancel()

    anyio.run(talk)


class Stuck:
    """A session whose client takes nothing."""

    async def send_tool_list_changed(self) -> None:
        """Never ends."""
        await anyio.sleep_forever()


class Taking:
    """A session whose client takes everything."""

    def __init__(self) -> None:
        self.taken = 0

    async def send_tool_list_changed(self) -> None:
        """Counts."""
        self.taken += 1


def test_a_session_that_takes_nothing_holds_up_no_other_and_is_sent_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(older_sessions, "SEND_S", 0.05)
    sessions, taking = OlderSessions(), Taking()
    known: Any = sessions._known
    known["stuck"], known["taking"] = (Stuck(), set()), (taking, set())

    async def talk() -> None:
        with anyio.fail_after(WAIT_S):
            await sessions.send(ToolsListChanged())
            await sessions.send(ToolsListChanged())

    anyio.run(talk)
    assert (set(known), taking.taken) == ({"taking"}, 2)

"""What changed, on its way from the node's thread to subscribers of both kinds: each event once, spaced, advice first."""

import asyncio
import threading
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import anyio
from mcp import types
from mcp.server import ServerRequestContext
from mcp.server.subscriptions import (
    InMemorySubscriptionBus,
    ListenHandler,
    PromptsListChanged,
    ResourcesListChanged,
    ResourceUpdated,
    ServerEvent,
    ToolsListChanged,
)
from mcp.shared.exceptions import MCPError

from proto.tools import INVALID_PARAMS
from services.gateway.addresses import ADVICE, HEALTH, MOST_URI, WORLD
from services.gateway.older_sessions import OlderSessions

MOST_STREAMS = 32
MOST_ADDRESSES = 64
"""Resources that one stream may follow."""
MOST_WAITING = 16
"""Events that wait for a slow stream; one more ends it, and its client reads anew."""
TOOLS, RESOURCES = ToolsListChanged(), ResourcesListChanged()
EVERY_S: dict[ServerEvent, float] = {
    ResourceUpdated(uri=ADVICE): 0.5,
    TOOLS: 1.0,
    RESOURCES: 1.0,
    PromptsListChanged(): 1.0,
    ResourceUpdated(uri=HEALTH): 2.0,
    ResourceUpdated(uri=WORLD): 2.0,
}
"""The events there are, those of one moment in this order, and the least time from one to the next of a kind."""


class Changes:
    """Told on any thread; delivered on the server's loop."""

    def __init__(self) -> None:
        bus = InMemorySubscriptionBus()
        self._streams = ListenHandler(bus, max_subscriptions=MOST_STREAMS, max_buffered_events=MOST_WAITING)
        self._bus = bus
        self.older = OlderSessions()
        self._lock = threading.Lock()
        self._due: set[ServerEvent] = set()
        self._sent_s: dict[ServerEvent, float] = {}
        self._loop: asyncio.AbstractEventLoop | None = None
        self._wake = anyio.Event()

    def tell(self, event: ServerEvent, *, urgent: bool = False) -> None:
        """Something changed; told again before it was delivered, it is delivered once. An urgent one waits for no spacing."""
        with self._lock:
            self._due.add(event)
            if urgent:
                self._sent_s.pop(event, None)
        self._on_loop(lambda: self._wake.set())

    async def listen(
        self, ctx: ServerRequestContext[Any, Any], params: types.SubscriptionsListenRequestParams
    ) -> types.SubscriptionsListenResult:
        """Serves `subscriptions/listen`. Raises MCPError where it asks for too much."""
        asked = params.notifications.resource_subscriptions or []
        if len(asked) > MOST_ADDRESSES or any(len(uri) > MOST_URI for uri in asked):
            raise MCPError(INVALID_PARAMS, f"a stream follows at most {MOST_ADDRESSES} resources")
        return await self._streams(ctx, params)

    @asynccontextmanager
    async def running(self, _: object) -> AsyncIterator[None]:
        """The server's lifespan: delivers as long as it lasts."""
        self._loop, self._wake = asyncio.get_running_loop(), anyio.Event()
        async with anyio.create_task_group() as group:
            group.start_soon(self._deliver)
            yield
            self._loop = None
            group.cancel_scope.cancel()

    def close(self) -> None:
        """End all streams, so that a server need not wait for their clients."""
        self._on_loop(self._streams.close)

    def _on_loop(self, job: Any) -> None:
        loop = self._loop
        if loop is not None and not loop.is_closed():
            loop.call_soon_threadsafe(job)

    async def _deliver(self) -> None:
        while True:
            ready, wait_s = self._ready(time.monotonic())
            for event in ready:
                await self._bus.publish(event)
                await self.older.send(event)
            if not ready:
                with anyio.move_on_after(wait_s):
                    await self._wake.wait()
                self._wake = anyio.Event()

    def _ready(self, now_s: float) -> tuple[list[ServerEvent], float]:
        """The events whose time has come, and how long until the next one's."""
        with self._lock:
            waits = {event: self._sent_s.get(event, -1e9) + EVERY_S[event] - now_s for event in self._due}
            ready = [event for event in EVERY_S if waits.get(event, 1.0) <= 0.0]
            for event in ready:
                self._due.discard(event)
                self._sent_s[event] = now_s
            return ready, min((wait for wait in waits.values() if wait > 0.0), default=3600.0)

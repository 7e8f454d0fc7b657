"""Sessions of revisions before 2026-07-28: what each has subscribed to, and the notifications that they get unasked."""

from collections import OrderedDict
from typing import Any

import anyio
from mcp import types
from mcp.server import ServerRequestContext
from mcp.server.session import ServerSession
from mcp.server.subscriptions import ResourceUpdated, ServerEvent, ToolsListChanged
from mcp.shared.exceptions import MCPError
from mcp_types.version import HANDSHAKE_PROTOCOL_VERSIONS

from proto.tools import INVALID_PARAMS
from services.gateway.addresses import MOST_URI

MOST_SESSIONS = 64
MOST_ADDRESSES = 64
SEND_S = 1.0
"""A session that does not take a notification within this time is sent no more of them."""


class OlderSessions:
    """Used on the server's loop alone. The session used longest ago is forgotten first."""

    def __init__(self) -> None:
        self._known: OrderedDict[str, tuple[ServerSession, set[str]]] = OrderedDict()

    async def notice(self, ctx: ServerRequestContext[Any, Any], call_next: Any) -> Any:
        """The SDK's middleware: remembers the sessions that are used."""
        if ctx.protocol_version in HANDSHAKE_PROTOCOL_VERSIONS and ctx.method != "initialize":
            self._remember(ctx)
        return await call_next(ctx)

    async def subscribe(
        self, ctx: ServerRequestContext[Any, Any], params: types.SubscribeRequestParams
    ) -> types.EmptyResult:
        """Serves `resources/subscribe`. Raises MCPError where a session follows too much."""
        addresses = self._remember(ctx)
        if len(params.uri) > MOST_URI or (len(addresses) >= MOST_ADDRESSES and params.uri not in addresses):
            raise MCPError(INVALID_PARAMS, f"a session follows at most {MOST_ADDRESSES} resources")
        addresses.add(params.uri)
        return types.EmptyResult()

    async def unsubscribe(
        self, ctx: ServerRequestContext[Any, Any], params: types.UnsubscribeRequestParams
    ) -> types.EmptyResult:
        """Serves `resources/unsubscribe`."""
        self._remember(ctx).discard(params.uri)
        return types.EmptyResult()

    async def send(self, event: ServerEvent) -> None:
        """To every session that it concerns, side by side: a slow one holds up no other for longer than SEND_S."""
        async with anyio.create_task_group() as group:
            for key, (session, addresses) in list(self._known.items()):
                if not isinstance(event, ResourceUpdated) or event.uri in addresses:
                    group.start_soon(self._send_one, key, session, event)

    async def _send_one(self, key: str, session: ServerSession, event: ServerEvent) -> None:
        with anyio.move_on_after(SEND_S):
            try:
                if isinstance(event, ResourceUpdated):
                    await session.send_resource_updated(event.uri)
                elif isinstance(event, ToolsListChanged):
                    await session.send_tool_list_changed()
                else:
                    await session.send_resource_list_changed()
            except (anyio.ClosedResourceError, anyio.BrokenResourceError):
                pass
            else:
                return
        self._known.pop(key, None)

    def _remember(self, ctx: ServerRequestContext[Any, Any]) -> set[str]:
        key = ctx.request.headers.get("mcp-session-id", "") if ctx.request is not None else "stdio"
        _, addresses = self._known.pop(key, (None, set[str]()))
        self._known[key] = ctx.session, addresses
        while len(self._known) > MOST_SESSIONS:
            self._known.popitem(last=False)
        return addresses

"""The official SDK's low-level server over the bus: tools from the catalogue, resources, prompts, and what changes."""

from importlib.metadata import version
from typing import Any

import anyio.to_thread
import msgspec
from mcp import types
from mcp.server import ServerRequestContext
from mcp.server.lowlevel import NotificationOptions, Server
from mcp.server.models import InitializationOptions
from mcp.server.request_state import RequestStateBoundary, RequestStateSecurity
from mcp.server.subscriptions import ResourceUpdated
from mcp.shared.exceptions import MCPError

from drivemcp.node import Node
from drivemcp.tools.refusal import unknown_tool
from proto.tools import INVALID_PARAMS, Outcome
from services.gateway.calls import call
from services.gateway.changes import RESOURCES, TOOLS, Changes
from services.gateway.completion import Completion
from services.gateway.confirming import ANSWER_WITHIN_S
from services.gateway.drives import Drives
from services.gateway.images import PICTURED, picture_of
from services.gateway.offered import Offered, callable_tools
from services.gateway.permitting import Gate
from services.gateway.prompts import Prompts
from services.gateway.resources import Resources
from services.gateway.seen import Seen
from services.gateway.tool_list import as_tool


def as_result(outcome: Outcome) -> types.CallToolResult:
    """An outcome as a result: structured and readable content, or an error in words with its kind in `_meta`."""
    if outcome.ok:
        text = msgspec.json.format(msgspec.json.encode(outcome.result)).decode()
        return types.CallToolResult(content=[types.TextContent(text=text)], structured_content=outcome.result)
    return types.CallToolResult(
        content=[types.TextContent(text=f"{outcome.status}: {outcome.error}")],
        is_error=True,
        _meta={"drivemcp/status": outcome.status},
    )


GRACE_MS = 2000.0
"""Added to a tool's own deadline: a client at the gateway drives no tick, and a slow answer still serves it."""
LOOK_S, REPORTS_S = 0.5, 5.0
"""How often it is looked whether tools, and reports, have come or gone."""
_INSTRUCTIONS = (
    "Tools of a running DriveMCP vehicle: traffic law with citations, weather and traction, CAN and diagnostics, the scene as "
    "seen, decisions and their reasons. What changes something is done only after a person has said yes to it in the client; tools "
    "whose capability is `actuation` take a grant as well. A refusal says what was wrong, which field, and what to do."
)


class GatewayServer(Server[Any]):
    """Says in every revision that its lists change."""

    def create_initialization_options(
        self, notification_options: NotificationOptions | None = None, *args: Any, **others: Any
    ) -> InitializationOptions:
        """What a session begins with."""
        changes = notification_options or NotificationOptions(tools_changed=True, resources_changed=True)
        return super().create_initialization_options(changes, *args, **others)


def make_server(
    node: Node,
    changes: Changes,
    drives: Drives,
    *,
    images: bool = True,
    groups: frozenset[str] = frozenset(),
    gate: Gate | None = None,
) -> GatewayServer:
    """A server bound to a node that watches the bus; `changes` tells its clients what happens there. `groups`: the part of the
    tools that it offers; none: all.
    """
    gate = gate or Gate()
    offered = Offered(node, groups)
    seen = Seen(node, lambda uri, urgent: changes.tell(ResourceUpdated(uri=uri), urgent=urgent))
    resources = Resources(node, seen, drives)
    prompts = Prompts(resources)
    _follow(node, offered, drives, changes)

    async def list_tools(
        _: ServerRequestContext[Any], __: types.PaginatedRequestParams | None
    ) -> types.ListToolsResult:
        tools = [as_tool(entry) for entry in offered.tools()]
        return types.ListToolsResult(tools=tools, ttl_ms=1000, cache_scope="private")

    async def call_tool(
        ctx: ServerRequestContext[Any], params: types.CallToolRequestParams
    ) -> types.CallToolResult | types.InputRequiredResult:
        known = callable_tools(node, groups)
        entry = known.get(params.name)
        if entry is None:
            raise MCPError(INVALID_PARAMS, unknown_tool(params.name, tuple(known)))
        limit_ms = entry.meta.deadline_ms + GRACE_MS
        permit = await gate.judge(ctx, params, entry)
        if isinstance(permit, types.InputRequiredResult):
            return permit
        if isinstance(permit, Outcome):
            return as_result(permit)
        if permit.grant:
            return as_result(await anyio.to_thread.run_sync(permit.make, node, limit_ms))
        outcome = await call(node, ctx, params.name, permit.arguments, limit_ms)
        result = as_result(outcome)
        if images and params.name in PICTURED:
            result.content += await anyio.to_thread.run_sync(picture_of, node, outcome)
        return result

    server = GatewayServer(
        "drivemcp",
        version=version("drivemcp"),
        instructions=_INSTRUCTIONS,
        lifespan=changes.running,
        get_tool_input_schema=lambda _: (
            None
        ),  # no tool asks for an argument in a header; looking for one took a tenth of a call
        on_list_tools=list_tools,
        on_call_tool=call_tool,
        on_list_resources=resources.listed,
        on_list_resource_templates=resources.templates,
        on_read_resource=resources.read,
        on_subscribe_resource=changes.older.subscribe,
        on_unsubscribe_resource=changes.older.unsubscribe,
        on_subscriptions_listen=changes.listen,
        on_list_prompts=prompts.listed,
        on_get_prompt=prompts.get,
        on_completion=Completion(seen, resources, drives).complete,
    )
    server.middleware.append(changes.older.notice)
    security = RequestStateSecurity.ephemeral(ttl=ANSWER_WITHIN_S, audience="drivemcp")
    server.middleware.append(RequestStateBoundary(security, default_audience="drivemcp"))
    return server


def _follow(node: Node, offered: Offered, drives: Drives, changes: Changes) -> None:
    """Tell clients when tools come and go, and when a report has been written."""
    names: list[tuple[str, ...]] = [()]

    def look_at_reports() -> None:
        found = drives.names()
        if found != names[0]:
            names[0] = found
            changes.tell(RESOURCES)

    node.every(LOOK_S, lambda: changes.tell(TOOLS) if offered.look() else None)
    node.every(REPORTS_S, look_at_reports)

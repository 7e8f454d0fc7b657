"""The official SDK's low-level server over the bus: lists what the catalogue holds, calls what is in it."""

from typing import Any

import anyio.to_thread
import msgspec
from mcp import types
from mcp.server import ServerRequestContext
from mcp.server.lowlevel import Server
from mcp.shared.exceptions import MCPError

from drivemcp.node import Node
from proto.tools import INVALID_PARAMS, Outcome, ToolEntry

_META = "drivemcp/tool"


def as_tool(entry: ToolEntry) -> types.Tool:
    """A catalogue entry under its bare name; capability, deadline and server in `_meta`."""
    return types.Tool(
        name=entry.name,
        title=entry.title,
        description=entry.description,
        input_schema=entry.inputSchema,
        output_schema=entry.outputSchema,
        annotations=types.ToolAnnotations.model_validate(entry.annotations),
        _meta={_META: msgspec.to_builtins(entry.meta)},
    )


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
_INSTRUCTIONS = (
    "Tools of a running DriveMCP vehicle: traffic law with citations, weather and traction, CAN and diagnostics, the scene as "
    "seen, decisions and their reasons. Tools whose capability is `actuation` are refused without a grant."
)


def _offered(node: Node) -> dict[str, ToolEntry]:
    """The catalogue without what only services may call."""
    return {name: entry for name, entry in node.catalogue().items() if not entry.meta.callers}


def make_server(node: Node) -> Server[Any]:
    """A server bound to a node that watches the bus."""

    async def list_tools(
        _: ServerRequestContext[Any], __: types.PaginatedRequestParams | None
    ) -> types.ListToolsResult:
        entries = sorted(_offered(node).values(), key=lambda entry: entry.name)
        return types.ListToolsResult(tools=[as_tool(entry) for entry in entries], ttl_ms=1000, cache_scope="private")

    async def call_tool(_: ServerRequestContext[Any], params: types.CallToolRequestParams) -> types.CallToolResult:
        entry = _offered(node).get(params.name)
        if entry is None:
            raise MCPError(INVALID_PARAMS, f"no tool {params.name[:80]!r}")
        limit_ms = entry.meta.deadline_ms + GRACE_MS
        outcome = await anyio.to_thread.run_sync(
            lambda: node.call(params.name, params.arguments or {}, deadline_ms=limit_ms)
        )
        return as_result(outcome)

    return Server(
        "drivemcp", version="0.1.0", instructions=_INSTRUCTIONS, on_list_tools=list_tools, on_call_tool=call_tool
    )

"""Our catalogue and outcomes as MCP's types. Pure."""

import msgspec
from mcp import types

from proto.tools import Outcome, ToolEntry

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

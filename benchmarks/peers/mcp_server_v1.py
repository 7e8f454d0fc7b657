"""The workload's tool by the 1.x MCP SDK, which is what langchain-mcp-adapters takes, over stdio."""

from typing import Any

from mcp.server.fastmcp import FastMCP  # type: ignore[attr-defined]

from benchmarks.workload import RESULT

server = FastMCP("peer", log_level="ERROR")


@server.tool()  # type: ignore[untyped-decorator]
def applicable_limit(situation: dict[str, Any]) -> dict[str, Any]:
    """The workload's answer."""
    return RESULT


if __name__ == "__main__":
    server.run("stdio")

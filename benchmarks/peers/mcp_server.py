"""The official SDK's server with the workload's tools, over stdio or streamable HTTP."""

import sys
import time
from typing import Any

from mcp.server.mcpserver import MCPServer

from benchmarks.workload import RESULT, SLOW_MS

server = MCPServer("peer")


@server.tool()
def applicable_limit(situation: dict[str, Any]) -> dict[str, Any]:
    """The workload's answer."""
    return RESULT


@server.tool()
def slow(situation: dict[str, Any]) -> dict[str, Any]:
    """A tool of 20 ms."""
    time.sleep(SLOW_MS / 1000)
    return RESULT


if __name__ == "__main__":
    if sys.argv[1] == "stdio":
        server.run("stdio")
    else:
        server.run("streamable-http", host="127.0.0.1", port=int(sys.argv[1]))

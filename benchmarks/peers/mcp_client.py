"""Subject: one call through the official SDK, its session held open. `python -m benchmarks.peers.mcp_client stdio|PORT COUNT`"""

import json
import subprocess
import sys
import time
from typing import Any

import anyio
from mcp import StdioServerParameters
from mcp.client.client import Client
from mcp.client.stdio import stdio_client

from benchmarks.workload import ARGUMENTS, TOOL


async def measure(target: Any, count: int) -> list[float]:
    """Time each call."""
    times: list[float] = []
    async with Client(target) as client:
        for number in range(count + 50):
            started = time.perf_counter()
            result = await client.call_tool(TOOL, ARGUMENTS)
            elapsed = (time.perf_counter() - started) * 1000
            assert not result.is_error
            if number >= 50:
                times.append(elapsed)
    return times


def main() -> None:
    """Start the server, measure, end it."""
    where, count = sys.argv[1], int(sys.argv[2])
    if where == "stdio":
        target = stdio_client(
            StdioServerParameters(command=sys.executable, args=["-m", "benchmarks.peers.mcp_server", "stdio"])
        )
        print(json.dumps({"ms": anyio.run(measure, target, count)}))  # noqa: T201
        return
    server = subprocess.Popen([sys.executable, "-m", "benchmarks.peers.mcp_server", where])
    try:
        wait_for_port(int(where))
        print(json.dumps({"ms": anyio.run(measure, f"http://127.0.0.1:{where}/mcp", count)}))  # noqa: T201
    finally:
        server.terminate()
        server.wait(5)


def wait_for_port(port: int) -> None:
    """Until something listens."""
    import socket

    deadline = time.monotonic() + 20
    while time.monotonic() < deadline:
        try:
            socket.create_connection(("127.0.0.1", port), 1).close()
        except OSError:
            time.sleep(0.05)
        else:
            return
    raise RuntimeError("the server did not come up")


if __name__ == "__main__":
    main()

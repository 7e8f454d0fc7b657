"""Subject: three 20 ms tools as parallel LangGraph nodes over MCP, one held-open stdio session each. `... COUNT`"""

import json
import operator
import sys
import time
from contextlib import AsyncExitStack
from typing import Annotated, Any, TypedDict

import anyio
from langgraph.graph import END, START, StateGraph
from mcp import StdioServerParameters
from mcp.client.client import Client
from mcp.client.stdio import stdio_client

from benchmarks.workload import ARGUMENTS


class State(TypedDict):
    """What the nodes write."""

    outs: Annotated[list[Any], operator.add]


def build(clients: list[Client]) -> Any:
    """Start, three nodes side by side, end."""
    graph = StateGraph(State)
    for number, client in enumerate(clients):

        async def node(_: State, client: Client = client) -> dict[str, Any]:
            result = await client.call_tool("slow", ARGUMENTS)
            return {"outs": [result.structured_content]}

        graph.add_node(f"tool{number}", node)
        graph.add_edge(START, f"tool{number}")
        graph.add_edge(f"tool{number}", END)
    return graph.compile()


async def measure(count: int) -> list[float]:
    """Time each run of the graph."""
    times: list[float] = []
    async with AsyncExitStack() as stack:
        parameters = StdioServerParameters(command=sys.executable, args=["-m", "benchmarks.peers.mcp_server", "stdio"])
        clients = [await stack.enter_async_context(Client(stdio_client(parameters))) for _ in range(3)]
        graph = build(clients)
        for number in range(count + 5):
            started = time.perf_counter()
            state = await graph.ainvoke({"outs": []})
            elapsed = (time.perf_counter() - started) * 1000
            assert len(state["outs"]) == 3
            if number >= 5:
                times.append(elapsed)
    return times


if __name__ == "__main__":
    print(json.dumps({"ms": anyio.run(measure, int(sys.argv[1]))}))  # noqa: T201

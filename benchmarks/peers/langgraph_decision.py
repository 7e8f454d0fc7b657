"""Subject: a decision by a LangGraph graph (route, ask, decide; no language model) whose tool is an MCP server's over stdio.

`... held|fresh COUNT`: the tool by langchain-mcp-adapters, of one session held open, or of a new session a call, its default.
"""

import json
import sys
import time
from typing import Any, TypedDict

import anyio
from langchain_mcp_adapters.client import MultiServerMCPClient
from langchain_mcp_adapters.tools import load_mcp_tools
from langgraph.graph import END, START, StateGraph

from benchmarks.decision import SNAPSHOT, WANTED, decide, route
from benchmarks.workload import ARGUMENTS, TOOL

SERVER = {
    "rules": {
        "transport": "stdio",
        "command": sys.executable,
        "args": ["-m", "benchmarks.peers.mcp_server_v1"],
        "env": {"PYTHONPATH": "."},
    }
}


class State(TypedDict, total=False):
    """What goes along the graph."""

    snapshot: dict[str, Any]
    tool: str
    answer: dict[str, Any]
    advice: dict[str, Any]


def build(tools: dict[str, Any]) -> Any:
    """route -> ask -> decide, or to the end where nothing is to be asked."""

    async def ask(state: State) -> State:
        found = await tools[state["tool"]].ainvoke({"situation": state["snapshot"]["situation"]})
        return {"answer": json.loads(found if isinstance(found, str) else found[0]["text"])}

    graph = StateGraph(State)
    graph.add_node("route", lambda state: {"tool": route(state["snapshot"])})
    graph.add_node("ask", ask)
    graph.add_node("decide", lambda state: {"advice": decide(state["snapshot"], state["answer"])})
    graph.add_edge(START, "route")
    graph.add_conditional_edges("route", lambda state: "ask" if state["tool"] else END, ["ask", END])
    graph.add_edge("ask", "decide")
    graph.add_edge("decide", END)
    return graph.compile()


async def timed(tools: list[Any], count: int, warm_up: int) -> list[float]:
    """Time each decision."""
    assert ARGUMENTS["situation"] is SNAPSHOT["situation"]
    graph, times = build({tool.name: tool for tool in tools if tool.name == TOOL}), []
    for number in range(count + warm_up):
        started = time.perf_counter()
        state = await graph.ainvoke({"snapshot": SNAPSHOT})
        elapsed = (time.perf_counter() - started) * 1000
        assert state["advice"] == WANTED
        if number >= warm_up:
            times.append(elapsed)
    return times


async def measure(how: str, count: int) -> list[float]:
    """With the session as told."""
    client = MultiServerMCPClient(SERVER)
    if how == "fresh":
        return await timed(await client.get_tools(), count, 1)
    async with client.session("rules") as session:
        return await timed(await load_mcp_tools(session), count, 50)


if __name__ == "__main__":
    print(json.dumps({"ms": anyio.run(measure, sys.argv[1], int(sys.argv[2]))}))  # noqa: T201

"""What answers: the script, which calls as the file says, or a model behind an OpenAI-compatible address."""

import json
from collections.abc import Awaitable, Callable
from typing import Any

import httpx2 as httpx
from mcp import types
from mcp.client import ClientRequestContext
from mcp.client.client import Client

from benchmarks.agent.questions import Question, Scored, scored, value_at

MOST_ROUNDS = 8
MOST_RESULT = 12_000
"""Characters of a tool's result that a model is shown."""
_SYSTEM = (
    "You answer for a car. Use the tools; say only what their results hold, with numbers, units and section numbers. "
    "Where a tool refuses or nothing is known, say so."
)
Talker = Callable[[Client, Question], Awaitable[Scored]]


async def scripted(client: Client, question: Question) -> Scored:
    """The file's call, and as the answer the values that its facts name."""
    result = await client.call_tool(question.call.tool, question.call.arguments)
    data: Any = {"error": text_of(result)} if result.is_error else result.structured_content
    values = [value_at(data, fact.path) for fact in question.fact]
    return scored(question, [question.call.tool], "\n".join(_said(value) for value in values))


def text_of(result: types.CallToolResult) -> str:
    """A result's text."""
    return "\n".join(block.text for block in result.content if isinstance(block, types.TextContent))


def _said(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


async def no(context: ClientRequestContext, params: types.ElicitRequestParams) -> types.ElicitResult | types.ErrorData:
    """The person at the desk of a benchmark changes nothing."""
    return types.ElicitResult(action="decline")


def model(http: httpx.AsyncClient, name: str) -> Talker:
    """A model that is given all tools, and asks until it answers. `http` holds address and key."""

    async def talk(client: Client, question: Question) -> Scored:
        tools = [_function(tool) for tool in (await client.list_tools()).tools]
        messages: list[dict[str, Any]] = [
            {"role": "system", "content": _SYSTEM},
            {"role": "user", "content": question.ask},
        ]
        called: list[str] = []
        for _ in range(MOST_ROUNDS):
            body = {"model": name, "messages": messages, "tools": tools, "temperature": 0}
            answer = await http.post("chat/completions", json=body)
            answer.raise_for_status()
            message = answer.json()["choices"][0]["message"]
            messages.append(message)
            wanted = message.get("tool_calls") or []
            if not wanted:
                return scored(question, called, message.get("content") or "")
            for each in wanted:
                called.append(each["function"]["name"])
                told = await _called(client, each["function"])
                messages.append({"role": "tool", "tool_call_id": each["id"], "content": told[:MOST_RESULT]})
        return scored(question, called, "")

    return talk


def _function(tool: types.Tool) -> dict[str, Any]:
    return {
        "type": "function",
        "function": {"name": tool.name, "description": tool.description, "parameters": tool.input_schema},
    }


async def _called(client: Client, function: dict[str, Any]) -> str:
    """A tool's text; what a model got wrong it is told, as any client would be."""
    try:
        arguments = json.loads(function.get("arguments") or "{}")
    except ValueError as error:
        return f"the arguments are no JSON object: {error}"
    try:
        return text_of(await client.call_tool(function["name"], arguments))
    except Exception as error:  # noqa: BLE001  # whatever the client refuses is the model's to mend
        return str(error)

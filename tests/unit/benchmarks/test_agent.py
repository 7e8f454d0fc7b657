"""The agent's test: every fact of the file holds in the fixed world, wrong answers score less, and any model can be asked."""

import json
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import anyio
import msgspec
import pytest
from mcp.client.client import Client

from benchmarks.agent import __main__ as command
from benchmarks.agent.questions import Question, Scored, questions, scored, value_at
from benchmarks.agent.talking import no, scripted
from benchmarks.agent.world import world
from drivemcp.testing import serving

VERSION, ASKED = questions()


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The gateway of the fixed world."""
    with world(tmp_path_factory.mktemp("world")) as running:
        yield running


@pytest.fixture(scope="module")
def results(address: str) -> dict[str, tuple[Any, Scored]]:
    """Of each question the real result, and how the script scores."""

    async def talk() -> dict[str, tuple[Any, Scored]]:
        found = {}
        async with Client(address, elicitation_callback=no) as client:
            for each in ASKED:
                result = await client.call_tool(each.call.tool, each.call.arguments)
                data = result.structured_content if not result.is_error else {"error": str(result.content)}
                found[each.id] = (data, await scripted(client, each))
        return found

    return anyio.run(talk)


def test_there_are_thirty_questions_of_drivers_and_fleet_engineers() -> None:
    assert len(ASKED) == len({each.id for each in ASKED}) == 30
    assert {each.by for each in ASKED} == {"driver", "fleet"}
    assert all(each.fact and each.call.tool in each.tools[0].split("|") for each in ASKED)


@pytest.mark.parametrize("question", ASKED, ids=lambda each: each.id)
def test_every_fact_is_what_the_tool_really_says(question: Question, results: dict[str, tuple[Any, Scored]]) -> None:
    data, outcome = results[question.id]
    for fact in question.fact:
        value = value_at(data, fact.path)
        assert fact.is_ is None or value == fact.is_, f"{fact.path} is {value!r}"
    assert (outcome.tools, outcome.facts) == (1.0, 1.0), outcome


def test_wrong_tools_and_wrong_facts_score_nothing(results: dict[str, tuple[Any, Scored]]) -> None:
    for each in ASKED:
        assert scored(each, ["no_tool"], "I do not want to say.").tools == 0.0
        assert scored(each, [], "I do not want to say.").facts == 0.0
    first = ASKED[0]
    assert scored(first, [first.call.tool], "It is 150 or 50.5 by § 30").facts == 0.0
    assert scored(first, [first.call.tool], "50 km/h").facts == 0.5


class Model(BaseHTTPRequestHandler):
    """An OpenAI-compatible server that calls what the script calls, once with broken arguments, and repeats the result."""

    def do_POST(self) -> None:
        asked = json.loads(self.rfile.read(int(self.headers["content-length"])))
        messages, offered = asked["messages"], {tool["function"]["name"] for tool in asked["tools"]}
        question = next(each for each in ASKED if each.ask == messages[1]["content"])
        told = [each for each in messages if each["role"] == "tool"]
        assert question.call.tool in offered
        if len(told) < 2:
            arguments = json.dumps(question.call.arguments) if told else "{"
            function = {"name": question.call.tool, "arguments": arguments}
            message = {"role": "assistant", "tool_calls": [{"id": "1", "type": "function", "function": function}]}
        else:
            message = {"role": "assistant", "content": told[-1]["content"]}
        body = json.dumps({"choices": [{"message": message}]}).encode()
        self.send_response(200)
        self.send_header("content-type", "application/json")
        self.send_header("content-length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: Any) -> None:
        """Say nothing."""


def test_one_command_asks_any_openai_compatible_model(
    address: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "report.json"
    with serving(HTTPServer(("127.0.0.1", 0), Model)) as server:
        url = f"http://127.0.0.1:{server.server_port}/v1/"
        assert command.main(["--base-url", url, "--model", "parrot", "--mcp", address, "--out", str(out)]) == 0
    made = msgspec.json.decode(out.read_bytes(), type=command.Report)
    assert (made.version, made.model, made.tools) == (VERSION, "parrot", 1.0)
    assert made.facts > 0.9
    assert "**all 30, parrot**" in capsys.readouterr().out


def test_a_model_without_an_address_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        command.main(["--model", "x"])
    assert "go together" in capsys.readouterr().err

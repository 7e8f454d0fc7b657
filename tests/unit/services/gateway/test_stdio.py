"""`drivemcp mcp`: the same server over standard input and output, for the official client, in both eras."""

import json
import sys
from collections.abc import Iterator
from typing import Any

import anyio
import pytest
from mcp import StdioServerParameters, types
from mcp.client.client import Client
from mcp.client.stdio import stdio_client

from drivemcp.bus.session import open_bus
from drivemcp.config import BusConfig, ServiceConfig
from drivemcp.node import Node
from drivemcp.runtime.supervisor import free_port
from proto import topics
from services.gateway.prompts import PROMPTS
from tests.unit.services.gateway.conftest import advisory, build_arbiter


@pytest.fixture
def endpoint() -> Iterator[str]:
    """Of a bus with one service, and one message to the driver every 0.1 s."""
    where = f"tcp/127.0.0.1:{free_port()}"
    config = BusConfig(mode="peer", listen=(where,))
    with open_bus(config) as session:
        arbiter = Node(session, "arbiter", ServiceConfig(bus=config))
        build_arbiter(ServiceConfig(), arbiter)
        arbiter.open()
        orchestrator = Node(session, "orchestrator", ServiceConfig(bus=config))
        orchestrator.open(announce=False)
        orchestrator.every(0.1, lambda: orchestrator.publish(topics.ADVISORY, advisory(directive="Slow to 60")))
        try:
            yield where
        finally:
            orchestrator.close()
            arbiter.close()


@pytest.mark.parametrize("era", ["legacy", "auto"])
def test_tools_resources_and_prompts_come_over_stdio(endpoint: str, era: str) -> None:
    arguments = ["-c", "from drivemcp.cli import main; raise SystemExit(main())", "mcp", "--connect", endpoint]

    async def last(client: Client) -> Any:
        (content,) = (await client.read_resource("drivemcp://advice/last")).contents
        assert isinstance(content, types.TextResourceContents)
        return json.loads(content.text)["last"]

    async def talk() -> None:
        server = stdio_client(StdioServerParameters(command=sys.executable, args=arguments))
        async with Client(server, mode=era) as client:
            assert [tool.name for tool in (await client.list_tools()).tools] == ["explain_decision"]
            found = await client.call_tool("explain_decision", {"tick": 7})
            assert found.structured_content == {"tick": 7, "kind": "SPEAK"}
            assert {each.name for each in (await client.list_prompts()).prompts} == set(PROMPTS)
            with anyio.fail_after(20.0):
                if era == "auto":
                    async with client.listen(resource_subscriptions=["drivemcp://advice/last"]) as stream:
                        await anext(stream)
                while (told := await last(client)) is None:
                    await anyio.sleep(0.05)
            assert told["advice"]["directive"] == "Slow to 60"

    anyio.run(talk)

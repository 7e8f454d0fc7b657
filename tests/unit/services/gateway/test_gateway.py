"""The gateway, asked by the official client."""

from collections.abc import Iterator
from pathlib import Path

import anyio
import httpx2 as httpx
import pytest
from mcp.client.client import Client
from mcp.client.streamable_http import streamable_http_client
from mcp.shared.exceptions import MCPError

from drivemcp.bus.session import wait_settled
from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError, ToolFailed
from drivemcp.node import Node
from drivemcp.service import Service
from drivemcp.testing import TestBus, bus
from services.gateway.service import SERVICE, GatewayConfig


def build(config: ServiceConfig, node: Node) -> None:
    """Two tools."""

    @node.tool(deadline_ms=50)
    def friction(rain_mm_h: float) -> dict[str, float]:
        """Friction in rain."""
        if rain_mm_h < 0:
            raise ToolFailed("rain_mm_h is negative")
        return {"mu": 0.4}

    @node.tool(deadline_ms=50, capability="actuation")
    def brake() -> dict[str, float]:
        """Must never run."""
        raise AssertionError


def build_arbiter(config: ServiceConfig, node: Node) -> None:
    """A service with one tool that is not for all."""

    @node.tool(deadline_ms=50)
    def arbitrate() -> dict[str, float]:
        """For the orchestrator alone."""
        raise AssertionError


@pytest.fixture
def running() -> Iterator[tuple[TestBus, Node]]:
    """A gateway with two tools behind it."""
    with bus() as b:
        b.start(Service("weather", ServiceConfig, build))
        b.start(Service("arbiter", ServiceConfig, build_arbiter))
        node = b.start(SERVICE)
        assert wait_settled(lambda: {"friction", "arbitrate"} <= node.catalogue().keys(), 5.0)
        yield b, node


def test_the_official_client_lists_and_calls_every_tool(running: tuple[TestBus, Node]) -> None:
    url = running[1].detail["mcp"]

    async def talk() -> None:
        async with Client(url) as client:
            tools = {tool.name: tool for tool in (await client.list_tools()).tools}
            assert set(tools) == {"friction", "brake"}
            assert tools["friction"].input_schema["required"] == ["rain_mm_h"]
            good = await client.call_tool("friction", {"rain_mm_h": 2.0})
            assert good.structured_content == {"mu": 0.4}
            bad = await client.call_tool("friction", {"rain_mm_h": "much"})
            assert bad.is_error
            failed = await client.call_tool("friction", {"rain_mm_h": -1.0})
            assert failed.is_error
            refused = await client.call_tool("brake", {})
            assert refused.is_error
            with pytest.raises(MCPError, match="no tool"):
                await client.call_tool("arbitrate", {})
            with pytest.raises(MCPError, match="no tool"):
                await client.call_tool("*", {})

    anyio.run(talk)


def test_an_address_beyond_this_machine_needs_a_token(tmp_path: Path) -> None:
    with bus() as b:
        with pytest.raises(ConfigError, match="token_file"):
            b.start(SERVICE, GatewayConfig(host="0.0.0.0"))
        token = tmp_path / "token"
        token.write_text("a-token-of-enough-length")
        node = b.start(SERVICE, GatewayConfig(token_file=str(token)))
        url = node.detail["mcp"]
        assert wait_settled(lambda: httpx.post(url).status_code == 401, 5.0)

        async def talk() -> None:
            headers = {"Authorization": "Bearer a-token-of-enough-length"}
            async with (
                httpx.AsyncClient(headers=headers) as http,
                Client(streamable_http_client(url, http_client=http)) as client,
            ):
                assert (await client.list_tools()).tools == []

        anyio.run(talk)


def test_a_taken_port_is_told_in_one_line(running: tuple[TestBus, Node]) -> None:
    port = int(running[1].detail["mcp"].rsplit(":", 1)[1].split("/")[0])
    with pytest.raises(ConfigError, match=f"port {port}"):
        running[0].start(SERVICE, GatewayConfig(port=port))

"""A part of the tools for a client that needs no more, and the scheme of the token."""

import argparse
from collections.abc import Iterator

import anyio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcp.client.client import Client
from mcp.shared.exceptions import MCPError

from drivemcp.bus.session import wait_settled
from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError
from drivemcp.node import Node
from drivemcp.service import Service
from drivemcp.testing import TestBus, bus
from proto.services import SERVICES
from services.gateway import stdio
from services.gateway.service import SERVICE, GatewayConfig, bears
from services.gateway.tool_list import GROUPS, checked_groups


def offering(name: str, *tools: str) -> Service[ServiceConfig]:
    def build(config: ServiceConfig, node: Node) -> None:
        for tool in tools:

            @node.tool(deadline_ms=500, name=tool)
            def answer() -> dict[str, bool]:
                """Answers."""
                return {"ok": True}

    return Service(name, ServiceConfig, build)


@pytest.fixture
def served() -> Iterator[TestBus]:
    """Tools of three services and of an expert."""
    with bus() as b:
        for name, tools in (
            ("rules", ("lookup_rule",)), ("retrieval", ("retrieve",)), ("weather", ("assess_weather",)), ("fog_horn", ("hear",)),
        ):  # fmt: skip
            b.start(offering(name, *tools))
        yield b


def names(b: TestBus, *groups: str) -> set[str]:
    node = b.start(SERVICE, GatewayConfig(tools=groups))
    assert wait_settled(lambda: {"hear", "retrieve"} <= node.catalogue().keys(), 5.0)

    async def talk() -> set[str]:
        async with Client(node.detail["mcp"]) as client:
            found = {tool.name for tool in (await client.list_tools()).tools}
            for tool in {"lookup_rule", "retrieve", "assess_weather", "hear"} - found:
                with pytest.raises(MCPError, match="no tool"):
                    await client.call_tool(tool, {})
            return found

    return anyio.run(talk)


def test_a_group_is_offered_and_callable_and_nothing_else_is(served: TestBus) -> None:
    assert names(served, "rules") == {"lookup_rule", "retrieve"}


def test_several_groups_are_offered_together(served: TestBus) -> None:
    assert names(served, "rules", "weather") == {"lookup_rule", "retrieve", "assess_weather"}


def test_without_groups_all_is_offered(served: TestBus) -> None:
    assert names(served) == {"lookup_rule", "retrieve", "assess_weather", "hear"}


def test_an_unknown_group_is_refused_with_the_nearest_and_the_list() -> None:
    with bus() as b, pytest.raises(ConfigError, match=r"'wether': write \"weather\"; there are can, decisions, memory"):
        b.start(SERVICE, GatewayConfig(tools=("wether",)))


def test_an_expert_is_a_group_by_its_name_and_our_services_are_not() -> None:
    assert checked_groups(["fog_horn", "rules"], ["fog_horn", "arbiter"]) == {"fog_horn", "rules"}
    with pytest.raises(ConfigError, match="no group of tools 'arbiter'"):
        checked_groups(["arbiter"], ["fog_horn", "arbiter"])


def test_every_service_with_tools_is_in_one_group() -> None:
    grouped = [server for servers in GROUPS.values() for server in servers]
    assert len(grouped) == len(set(grouped))
    assert {row.name for row in SERVICES if row.tools} <= set(grouped)


def test_the_command_names_every_group(capsys: pytest.CaptureFixture[str]) -> None:
    parser = argparse.ArgumentParser()
    stdio.register(parser.add_subparsers())
    with pytest.raises(SystemExit):
        parser.parse_args(["mcp", "--help"])
    told = capsys.readouterr().out
    assert all(group in told for group in GROUPS)


@given(st.sampled_from(["Bearer", "bearer", "BEARER", "bEaReR"]), st.integers(1, 3))
def test_the_scheme_of_the_token_is_bearer_in_any_case(scheme: str, spaces: int) -> None:
    assert bears(f"{scheme}{' ' * spaces}a-token".encode(), "a-token")


@given(st.binary(max_size=30))
def test_nothing_else_bears_the_token(given_bytes: bytes) -> None:
    assert not bears(given_bytes, "a-token-of-enough-length-for-all")
    assert not bears(b"Basic a-token", "a-token")
    assert not bears(b"Bearer A-TOKEN", "a-token")
    assert not bears(b"Bearer ", "a-token")
    assert not bears(b"a-token", "a-token")

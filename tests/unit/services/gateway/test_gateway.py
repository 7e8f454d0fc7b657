"""The gateway, asked by the official client."""

import socket
from collections.abc import Iterator
from pathlib import Path

import anyio
import httpx2 as httpx
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcp.client.client import Client
from mcp.client.streamable_http import streamable_http_client
from mcp.shared.exceptions import MCPError

from drivemcp.bus.session import wait_settled
from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError, ToolFailed
from drivemcp.http.limits import FREE_TRIES, LONGEST_WAIT_S, MOST_ADDRESSES, BackOff
from drivemcp.http.serving import listen
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


def test_no_answer_waits_for_an_acknowledgement() -> None:
    with listen(GatewayConfig()) as listener, socket.create_connection(listener.getsockname()):
        accepted, _ = listener.accept()
        with accepted:
            assert accepted.proto == socket.IPPROTO_TCP, "asyncio switches Nagle's algorithm off on such sockets alone"


TOKEN = "a-token-of-enough-length"


def _ask(url: str, headers: bytes, body: bytes = b"") -> socket.socket:
    """A connection on which a request, or the beginning of one, was sent."""
    host, port = url.removeprefix("http://").split("/")[0].split(":")
    connection = socket.create_connection((host, int(port)), timeout=10.0)
    connection.sendall(f"POST /mcp HTTP/1.1\r\nhost: {host}:{port}\r\n".encode() + headers + body)
    return connection


def _cut(connection: socket.socket) -> bool:
    """Whether the gateway lets go of a connection within the socket's timeout; what it still says is read."""
    with connection:
        try:
            while connection.recv(65_536):
                pass
        except ConnectionError:
            return True
        except TimeoutError:
            return False
    return True


@pytest.mark.parametrize(
    "begun", [b"", b"content-le", b"content-length: 10\r\n\r\n", b"content-length: 10\r\n\r\nhalf"]
)
def test_a_request_that_is_not_whole_in_time_is_cut_off(begun: bytes) -> None:
    with bus() as b:
        node = b.start(SERVICE, GatewayConfig(request_s=0.2))
        assert _cut(_ask(node.detail["mcp"], begun))


def test_a_connection_that_says_nothing_is_cut_off_and_so_is_an_idle_one() -> None:
    with bus() as b:
        node = b.start(SERVICE, GatewayConfig(request_s=0.2, idle_s=1))
        host, port = node.detail["mcp"].removeprefix("http://").split("/")[0].split(":")
        assert _cut(socket.create_connection((host, int(port)), timeout=10.0))
        idle = _ask(node.detail["mcp"], b"content-length: 2\r\n\r\n", b"{}")
        assert idle.recv(65_536).startswith(b"HTTP/1.1 ")
        assert _cut(idle)


def test_beyond_its_connections_the_gateway_takes_none_and_goes_on_when_one_ends() -> None:
    with bus() as b:
        node = b.start(SERVICE, GatewayConfig(max_connections=2, request_s=60.0))
        url = node.detail["mcp"]
        assert wait_settled(lambda: httpx.post(url).status_code != 503, 5.0)
        held = [_ask(url, b"") for _ in range(2)]

        def turned_away() -> bool:
            try:
                return _cut(_ask(url, b""))
            except ConnectionError:
                return True

        assert turned_away()
        held.pop().close()

        def served() -> bool:
            try:
                return httpx.post(url).status_code in (400, 406)
            except httpx.HTTPError:
                return False

        assert wait_settled(served, 5.0)
        held.pop().close()


@pytest.mark.parametrize("chunked", [False, True])
def test_a_request_of_a_hundred_megabytes_is_refused(chunked: bool) -> None:
    with bus() as b:
        node = b.start(SERVICE, GatewayConfig(max_request_kb=64))
        sized = b"content-type: application/json\r\naccept: application/json, text/event-stream\r\n"
        if chunked:
            part = b"%x\r\n" % 40_000 + b" " * 40_000 + b"\r\n"
            connection = _ask(node.detail["mcp"], sized + b"transfer-encoding: chunked\r\n\r\n", part + part)
        else:
            connection = _ask(node.detail["mcp"], sized + b"content-length: 100000000\r\n\r\n", b"{")
        with connection:
            status = connection.recv(65_536).split(b"\r\n")[0]
    assert b" 413 " in status


def test_an_address_that_tries_tokens_has_to_wait(tmp_path: Path) -> None:
    (tmp_path / "token").write_text(TOKEN)
    with bus() as b:
        url = b.start(SERVICE, GatewayConfig(token_file=str(tmp_path / "token"))).detail["mcp"]
        wrong, right = {"Authorization": "Bearer a-token-that-is-wrong"}, {"Authorization": f"Bearer {TOKEN}"}
        assert wait_settled(lambda: httpx.post(url, headers=right).status_code not in (401, 429), 5.0)
        assert [httpx.post(url, headers=wrong).status_code for _ in range(FREE_TRIES)] == [401] * FREE_TRIES
        held = httpx.post(url, headers=right)
        assert held.status_code == 429, "no answer tells whether a token is right while one waits"
        assert held.headers["retry-after"] == "1"
        assert wait_settled(lambda: httpx.post(url, headers=right).status_code not in (401, 429), 10.0)


@given(st.lists(st.tuples(st.floats(0.0, 20.0), st.booleans()), max_size=60))
def test_each_wrong_token_doubles_the_wait_up_to_its_bound_and_a_right_one_ends_it(
    tries: list[tuple[float, bool]],
) -> None:
    back_off, now_s, in_a_row = BackOff(), 0.0, 0
    for pause_s, right in tries:
        now_s += pause_s
        wait_s = back_off.wait_s("a", now_s)
        assert 0.0 <= wait_s <= LONGEST_WAIT_S
        assert back_off.wait_s("b", now_s) == 0.0
        if wait_s:
            continue
        if right:
            back_off.right("a")
            in_a_row = 0
        else:
            back_off.wrong("a", now_s)
            in_a_row += 1
            due_s = min(LONGEST_WAIT_S, 0.5 * 2.0 ** (in_a_row - FREE_TRIES)) if in_a_row >= FREE_TRIES else 0.0
            assert back_off.wait_s("a", now_s) == pytest.approx(due_s)


def test_many_addresses_take_bounded_memory() -> None:
    back_off = BackOff()
    for number in range(3 * MOST_ADDRESSES):
        for _ in range(FREE_TRIES):
            back_off.wrong(str(number), 0.0)
    assert back_off.wait_s("0", 0.0) == 0.0
    assert back_off.wait_s(str(3 * MOST_ADDRESSES - 1), 0.0) > 0.0

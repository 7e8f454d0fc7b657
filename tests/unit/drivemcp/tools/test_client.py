"""Servers that lie, garble or die cost a caller an error and nothing else, on a real in-process Zenoh session."""

import sys
from concurrent.futures import ThreadPoolExecutor
from subprocess import PIPE, Popen

import msgspec
import pytest

from drivemcp.bus.session import open_bus, wait_settled
from drivemcp.config import BusConfig, ServiceConfig
from drivemcp.node import Node
from drivemcp.runtime.supervisor import free_port
from drivemcp.testing import bus
from drivemcp.tools.definition import define
from proto.keys import catalogue_key, tool_key
from proto.tools import Catalogue

NO_UTF_8 = (b"\xff", b"\xed\xa0\x80", b"\xc3")


def test_bytes_beyond_all_use_are_an_outcome_and_no_exception() -> None:
    payloads = [b"[" * 100_000, b'{"structuredContent":%b}' % (b"[" * 90_000), b'{"structuredContent":{"a":' * 20_000]
    served = iter(payloads)

    def lie() -> dict[str, bool]:
        """Never runs: its server answers with bytes of its own."""
        raise AssertionError

    with bus() as b:
        vehicle = b.probe.config.vehicle
        catalogue, tool = catalogue_key(vehicle, "liar"), tool_key(vehicle, "liar", "lie")
        offered = Catalogue(server="liar", tools=(define(lie, server="liar", deadline_ms=40).entry,))
        b.session.serve(catalogue, lambda query: query.answer(catalogue, msgspec.json.encode(offered)))
        b.session.serve(tool, lambda query: query.answer(tool, next(served)))
        for _ in payloads:
            outcome = b.call("lie")
            assert outcome.status == "protocol_error", outcome


@pytest.mark.parametrize("name", ["../how_wet", "how wet", "*", "", "x" * 65])
def test_a_tool_whose_name_can_be_no_key_is_ignored_and_calling_it_raises_nothing(name: str) -> None:
    def lie() -> dict[str, bool]:
        """Never runs."""
        raise AssertionError

    entry = msgspec.structs.replace(define(lie, server="liar", deadline_ms=40).entry, name=name)
    with bus() as b:
        key = catalogue_key(b.probe.config.vehicle, "liar")
        offered = msgspec.json.encode(Catalogue(server="liar", tools=(entry,)))
        b.session.serve(key, lambda query: query.answer(key, offered))
        assert b.probe.client.discover() == {}
        assert b.call(name).status == "unavailable"


@pytest.mark.parametrize("text", NO_UTF_8)
def test_a_liar_whose_text_is_no_utf_8_gives_an_error_and_raises_nothing(text: bytes) -> None:
    def lie() -> dict[str, bool]:
        """Never runs."""
        raise AssertionError

    offered = msgspec.json.encode(Catalogue(server="liar", tools=(define(lie, server="liar", deadline_ms=40).entry,)))
    replies = [b'{"structuredContent":{"a":"%b"},"isError":false}', b'{"structuredContent":{"%b":1},"isError":false}',
               b'{"isError":true,"content":[{"type":"text","text":"%b"}]}', b"%b"]  # fmt: skip
    with bus() as b:
        catalogue, tool = catalogue_key(b.probe.config.vehicle, "liar"), tool_key(b.probe.config.vehicle, "liar", "lie")
        b.session.serve(catalogue, lambda query: query.answer(catalogue, offered.replace(b"Never", text)))
        assert b.probe.client.discover() == {}
    with bus() as b:
        b.session.serve(catalogue, lambda query: query.answer(catalogue, offered))
        b.session.serve(tool, lambda query: query.answer(tool, replies[0].replace(b"%b", text)))
        assert "lie" in b.probe.client.discover()
        while replies:
            outcome = b.call("lie", {})
            assert (outcome.status, outcome.error != "") == ("protocol_error", True)
            replies.pop(0)


def test_a_catalogue_that_is_another_servers_by_its_own_words_is_ignored() -> None:
    def forged() -> dict[str, bool]:
        """As if it were another's."""
        raise AssertionError

    def own() -> dict[str, bool]:
        """The server's own."""
        raise AssertionError

    with bus() as b:
        key = catalogue_key(b.probe.config.vehicle, "evil")
        offers = iter(
            Catalogue(server=server, tools=(define(tool, server=server, deadline_ms=40).entry,))
            for server, tool in (("wet", forged), ("evil", own))
        )
        b.session.serve(key, lambda query: query.answer(key, msgspec.json.encode(next(offers))))
        assert b.probe.client.discover() == {}
        assert b.probe.client.discover().keys() == {"own"}


SERVER = """
import sys, threading
from drivemcp.bus.session import open_bus
from drivemcp.config import BusConfig, ServiceConfig
from drivemcp.node import Node

with open_bus(BusConfig(mode="peer", connect=(sys.argv[1],))) as bus:
    node = Node(bus, "wet", ServiceConfig())

    @node.tool(deadline_ms=40)
    def hang() -> dict[str, bool]:
        'Does not answer while the test runs.'
        print("called", flush=True)
        threading.Event().wait(60)
        return {}

    node.open()
    sys.stdin.read()
"""


def test_a_server_that_dies_while_it_works_is_unavailable_at_once_and_not_only_at_the_deadline() -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with open_bus(BusConfig(mode="peer", listen=(endpoint,))) as session, ThreadPoolExecutor(1) as pool:
        caller = Node(session, "caller", ServiceConfig())
        caller.watch_services()
        caller.open(announce=False)
        with Popen([sys.executable, "-c", SERVER, endpoint], stdin=PIPE, stdout=PIPE) as server:
            assert server.stdout is not None
            assert wait_settled(lambda: "hang" in caller.client.discover(), 20.0)
            call = pool.submit(caller.call, "hang", {}, deadline_ms=60_000.0)
            call.add_done_callback(lambda _: server.kill())  # who is not called says nothing for ever
            assert server.stdout.readline() == b"called\n"
            server.kill()
            outcome = call.result(10)
        assert outcome.status == "unavailable"
        caller.close()

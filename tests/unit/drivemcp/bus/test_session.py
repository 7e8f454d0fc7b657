"""What a session on the bus keeps in memory, in a process of its own."""

import json
import signal
import sys
import threading
from pathlib import Path
from subprocess import PIPE, Popen

import pytest

from drivemcp.bus.session import (
    MOST_BYTES,
    MOST_HEAD_BYTES,
    MOST_QUERY_BYTES,
    QUEUED,
    SHARED_FROM_BYTES,
    Query,
    Reply,
    open_bus,
    shares_memory,
    wait_settled,
)
from drivemcp.config import BusConfig
from drivemcp.runtime.supervisor import free_port

SENDER = """
import json, sys
from pathlib import Path
from drivemcp.bus.session import SHARED_FROM_BYTES, open_bus, wait_settled
from drivemcp.config import BusConfig

def shares():
    mapped = [line.split()[0].split("-") for line in Path("/proc/self/maps").read_text().splitlines() if line.endswith(".zenoh")]
    return sum(int(end, 16) - int(start, 16) for start, end in mapped) > 1_000_000

with open_bus(BusConfig(connect=(sys.argv[1],))) as bus:
    publisher = bus.publisher("test/size")
    assert wait_settled(publisher.matching, 10.0)
    def sends(size):
        publisher.put(bytes(size), b"")
        return shares()
    print(json.dumps([wait_settled(lambda: sends(SHARED_FROM_BYTES // 2), 0.5), wait_settled(lambda: sends(1 << 20), 10.0)]), flush=True)
    sys.stdin.read()  # what was sent last may still be on its way
"""


def test_only_who_sends_pictures_keeps_shared_memory() -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    sizes: set[int] = set()
    with open_bus(BusConfig(mode="peer", listen=(endpoint,))) as bus:
        bus.subscribe("test/size", lambda key, payload, attachment: sizes.add(len(payload)))
        with Popen([sys.executable, "-c", SENDER, endpoint], stdin=PIPE, stdout=PIPE, text=True) as sender:
            assert wait_settled(lambda: {SHARED_FROM_BYTES // 2, 1 << 20} <= sizes, 60.0)
            told, _ = sender.communicate(timeout=60)
    assert sender.returncode == 0
    assert json.loads(told) == [False, True]


def test_pictures_of_one_instant_wait_for_a_router_that_stands_still_for_a_moment_though_each_may_be_dropped() -> None:
    endpoint, small = f"tcp/127.0.0.1:{free_port()}", "#so_sndbuf=32768;so_rcvbuf=32768"
    command = [sys.executable, "-m", "drivemcp.bus.router", "--listen", endpoint + small]
    arrived, count = threading.Semaphore(0), QUEUED
    with Popen(command) as router:
        try:
            with (
                open_bus(BusConfig(connect=(endpoint,))) as reader,
                open_bus(BusConfig(connect=(endpoint + small,))) as source,
            ):
                reader.subscribe("test/camera", lambda key, payload, head: arrived.release())
                camera = source.publisher("test/camera", droppable=True)
                assert wait_settled(camera.matching, 10.0)
                router.send_signal(signal.SIGSTOP)
                for _ in range(count):
                    camera.put(bytes(SHARED_FROM_BYTES - 20_000), b"")
                router.send_signal(signal.SIGCONT)
                assert all(arrived.acquire(timeout=10.0) for _ in range(count))
        finally:
            router.kill()


def test_a_message_that_is_too_large_is_dropped_and_the_next_one_comes() -> None:
    with open_bus(BusConfig(mode="peer")) as bus:
        heard: list[int] = []
        bus.subscribe("drivemcp/test/large", lambda key, payload, head: heard.append(len(payload)))
        publisher = bus.publisher("drivemcp/test/large")
        assert wait_settled(publisher.matching, 5.0)
        publisher.put(bytes(MOST_BYTES + 1), b"")
        publisher.put(b"ok", bytes(MOST_HEAD_BYTES + 1))
        publisher.put(bytes(MOST_BYTES), b"")
        publisher.put(b"ok", b"")
        assert wait_settled(lambda: len(heard) == 2, 10.0)
    assert heard == [MOST_BYTES, 2]


def test_between_processes_a_hundred_megabytes_reach_no_one_and_the_link_goes_on() -> None:
    """Two sessions over TCP: what the first sends is dropped in parts by the second, which keeps none of it."""
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    with (
        open_bus(BusConfig(mode="peer", listen=(endpoint,))) as near,
        open_bus(BusConfig(mode="client", connect=(endpoint,))) as far,
    ):
        heard: list[int] = []
        near.subscribe("drivemcp/test/large", lambda key, payload, head: heard.append(len(payload)))
        publisher = far.publisher("drivemcp/test/large")
        assert wait_settled(publisher.matching, 10.0)
        publisher.put(bytes(100_000_000), b"")
        publisher.put(b"ok", b"")
        assert wait_settled(lambda: heard == [2], 30.0), heard


def test_arguments_that_are_too_large_count_as_none() -> None:
    with open_bus(BusConfig(mode="peer")) as bus:
        asked: list[int] = []

        def answer(query: Query) -> None:
            asked.append(len(query.payload))
            query.answer("drivemcp/test/tool", b"")

        bus.serve("drivemcp/test/tool", answer)
        replies: list[Reply | None] = []
        bus.get("drivemcp/test/tool", replies.append, timeout_s=10.0, payload=bytes(MOST_QUERY_BYTES + 1))
        assert wait_settled(lambda: len(replies) == 2, 10.0)
    assert asked == [0]


@pytest.mark.parametrize("there", [True, False])
def test_shared_memory_takes_room(tmp_path: Path, there: bool) -> None:
    assert shares_memory(str(tmp_path if there else tmp_path / "absent")) is there

"""What a session on the bus keeps in memory, in a process of its own."""

import json
import sys
from subprocess import PIPE, Popen

from drivemcp.bus.session import SHARED_FROM_BYTES, open_bus, wait_settled
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

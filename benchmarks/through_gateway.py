"""Subject: a call by HTTP through the gateway to another process. `python -m benchmarks.through_gateway ENDPOINT PORT COUNT`"""

import json
import subprocess
import sys

import anyio

from benchmarks.peers.mcp_client import measure, wait_for_port
from benchmarks.workload import TOOL
from drivemcp.bus.session import open_bus, wait_settled
from drivemcp.config import BusConfig
from services.gateway.service import SERVICE, GatewayConfig


def serve(endpoint: str, port: int) -> None:
    """The gateway's process: serves until its standard input ends."""
    with open_bus(BusConfig(mode="peer", connect=(endpoint,))) as bus:
        node = SERVICE.start(bus, GatewayConfig(port=port))
        sys.stdout.write(f"{wait_settled(lambda: TOOL in node.catalogue(), 10.0)}\n")
        sys.stdout.flush()
        sys.stdin.read()
        node.close()


def main() -> None:
    """Start tool and gateway, measure, end both."""
    endpoint, port, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
    tool = subprocess.Popen([sys.executable, "-m", "benchmarks.ours", endpoint, "serve", "0"], stdin=subprocess.PIPE)
    wait_for_port(int(endpoint.rpartition(":")[2]))
    gateway = subprocess.Popen(
        [sys.executable, "-m", "benchmarks.through_gateway", endpoint, port, "serve"],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE,
    )  # fmt: skip
    try:
        assert gateway.stdout is not None
        if gateway.stdout.readline() != b"True\n":
            raise RuntimeError("the gateway does not see the tool")
        print(json.dumps({"ms": anyio.run(measure, f"http://127.0.0.1:{port}/mcp", count)}))  # noqa: T201
    finally:
        for process in (gateway, tool):
            assert process.stdin is not None
            process.stdin.close()
            process.wait(10)


if __name__ == "__main__":
    if sys.argv[3] == "serve":
        serve(sys.argv[1], int(sys.argv[2]))
    else:
        main()

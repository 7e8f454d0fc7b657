"""Each service alone on an idle machine: time from exec to alive, and resident memory at rest."""

import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from benchmarks.calls import endpoint
from benchmarks.figures import table
from drivemcp.bus.session import open_bus, wait_settled
from drivemcp.config import BusConfig, ServiceConfig
from drivemcp.node import Node
from proto.services import SERVICES, ServiceRow

REST_S = 3.0
PROMISED = {"can": (80.0, 2.0), "arbiter": (80.0, 2.0), "weather": (80.0, 2.0)}


def footprint() -> str:
    """The table."""
    where = endpoint()
    router = subprocess.Popen([sys.executable, "-m", "drivemcp.bus.router", "--listen", where])
    try:
        with open_bus(BusConfig(connect=(where,))) as bus, tempfile.TemporaryDirectory() as folder:
            node = Node(bus, "bench", ServiceConfig())
            node.watch_services()
            node.open(announce=False)
            rows = [_measure(row, node, where, folder) for row in SERVICES if row.name not in ("player",)]
            node.close()
    finally:
        router.terminate()
        router.wait(5)
    return "## Each service alone\n\n" + table(["service", "alive after s", "at rest MB", "promised"], rows)


def _measure(row: ServiceRow, node: Node, where: str, folder: str) -> list[str]:
    sys.stderr.write(f"  {row.name}\n")
    settings = ["--set", "autostart=false"] if row.name == "simulator" else []
    command = [
        sys.executable,
        "-m",
        f"services.{row.name}",
        "--connect",
        where,
        "--set",
        f"out_dir={folder}",
        *settings,
    ]
    started = time.perf_counter()
    with (Path(folder) / f"{row.name}.log").open("wb") as log:
        process = subprocess.Popen(command, stderr=log, stdin=subprocess.DEVNULL)
    try:
        alive = wait_settled(lambda: row.name in node.alive_services(), 40.0)
        took = time.perf_counter() - started
        threading.Event().wait(REST_S)
        memory = resident_mb(Path(f"/proc/{process.pid}/status").read_text())
    finally:
        process.terminate()
        process.wait(10)
    wait_settled(lambda: row.name not in node.alive_services(), 5.0)
    promised = PROMISED.get(row.name)
    goal = f"below {promised[0]:g} MB, {promised[1]:g} s" if promised else ""
    return [row.name, f"{took:.2f}" if alive else "never", f"{memory:.0f}", goal]


def resident_mb(status: str) -> float:
    """MB of a process from its `/proc/PID/status`, which counts in KiB; 0 where it has ended."""
    for line in status.splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) * 1024 / 1e6
    return 0.0

"""Whole processes for tests: a router, and what runs on it. Every wait is bounded; only own processes are ended."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from drivemcp.bus.session import open_bus
from drivemcp.config import BusConfig
from drivemcp.runtime.supervisor import free_port


def wait_for_router(endpoint: str, user: str = "", password_file: str = "") -> None:
    """Until the router takes a session."""
    config = BusConfig(connect=(endpoint,), connect_timeout_s=15.0, user=user, password_file=password_file)
    open_bus(config).close()


@pytest.fixture
def start_router() -> Iterator[Callable[..., str]]:
    """Starts routers: `start_router("--access", FILE, ...)` returns the endpoint."""
    running: list[subprocess.Popen[bytes]] = []

    def start(*arguments: str, ready: Callable[[str], None] = wait_for_router) -> str:
        endpoint = f"tcp/127.0.0.1:{free_port()}"
        command = [sys.executable, "-m", "drivemcp.bus.router", "--listen", endpoint, *arguments]
        running.append(subprocess.Popen(command, stdin=subprocess.DEVNULL))
        ready(endpoint)
        return endpoint

    yield start
    for process in running:
        process.terminate()
        try:
            process.wait(5)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait(5)


@pytest.fixture
def secrets_folder(tmp_path: Path) -> Path:
    """Access control and credentials of all services."""
    from drivemcp.commands.access import write_access

    write_access(tmp_path / "secrets", evaluation=True)
    return tmp_path / "secrets"

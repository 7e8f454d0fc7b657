"""`docker compose up` for real: images built, everything healthy, a log written and verified, tools behind a token, clean down.

Needs a Docker engine and its compose plugin; skipped where none answers. COMPOSE_FILE and the other variables of docker are
honoured: where builds cannot reach a package index, set COMPOSE_FILE=docker-compose.yml:docker/build-host-network.yml.
"""

import json
import shutil
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import anyio
import httpx2 as httpx
import pytest
from mcp.client.client import Client
from mcp.client.streamable_http import streamable_http_client

from proto.services import RESERVED, SERVICES

pytestmark = pytest.mark.stack
ROOT = Path(__file__).parents[2]
PROJECT = "drivemcp-stacktest"
GATEWAY, COCKPIT, VIEWER = "http://127.0.0.1:8970/mcp", "http://127.0.0.1:8980/", "http://127.0.0.1:9090/"
RUNNING = sorted({row.name for row in SERVICES} - {"player"} | {"router"})
DRIVE_S = 25.0
HEALTHY_S = 240


def compose(*arguments: str, timeout_s: float = 60.0, check: bool = True) -> subprocess.CompletedProcess[str]:
    """Run one compose command on a project of our own; its output stands in the failure."""
    command = ["docker", "compose", "-p", PROJECT, *arguments]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=timeout_s, check=False)
    if check and done.returncode != 0:
        pytest.fail(f"{' '.join(command)} ended with {done.returncode}:\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}")
    return done


def why_no_engine() -> str:
    """What is missing; empty when an engine with compose answers."""
    if shutil.which("docker") is None:
        return "there is no docker command"
    for probe in (["docker", "compose", "version"], ["docker", "info"]):
        try:
            done = subprocess.run(probe, capture_output=True, text=True, timeout=20, check=False)
        except subprocess.TimeoutExpired:
            return f"`{' '.join(probe)}` does not answer"
        if done.returncode != 0:
            return f"`{' '.join(probe)}` fails: {done.stderr.strip().splitlines()[-1:]}"
    return ""


def containers() -> dict[str, dict[str, Any]]:
    """The project's containers by service, as compose lists them."""
    lines = compose("ps", "-a", "--format", "json").stdout.splitlines()
    return {entry["Service"]: entry for entry in map(json.loads, lines)}


def inspect(service: str) -> dict[str, Any]:
    """Everything the engine knows of a container."""
    number = compose("ps", "-a", "-q", service).stdout.strip()
    done = subprocess.run(["docker", "inspect", number], capture_output=True, text=True, timeout=20, check=True)
    found: dict[str, Any] = json.loads(done.stdout)[0]
    return found


def inside(service: str, *command: str, timeout_s: float = 60.0, check: bool = True) -> str:
    """What a command in a container prints."""
    done = compose("exec", "-T", service, *command, timeout_s=timeout_s, check=check)
    return done.stdout + ("" if check else done.stderr)


def eventually(holds: Callable[[], bool], within_s: float) -> bool:
    """Ask once a second until it holds."""
    deadline_s = time.monotonic() + within_s
    while not holds():
        if time.monotonic() > deadline_s:
            return False
        time.sleep(1.0)
    return True


@pytest.fixture(scope="module")
def stack() -> Iterator[None]:
    """The whole stack, built and healthy; down again at the end, its volumes too."""
    if reason := why_no_engine():
        pytest.skip(f"containers need a Docker engine with compose: {reason}")
    compose("build", timeout_s=3000.0)
    compose("down", "-v", "--timeout", "10", timeout_s=120.0)
    try:
        compose("up", "-d", "--no-build", "--wait", "--wait-timeout", str(HEALTHY_S), timeout_s=HEALTHY_S + 60.0)
        yield
    finally:
        compose("down", "-v", "--timeout", "10", timeout_s=120.0, check=False)


def log_files() -> list[str]:
    """The logger's files, in the order in which they continue each other."""
    return sorted(inside("logger", "sh", "-c", "ls /data/logs/*.mcap").split())


def tools_at_the_gateway() -> set[str]:
    """The names that the official client lists."""
    token = inside("gateway", "cat", "/secrets/gateway/token").strip()

    async def ask() -> set[str]:
        async with (
            httpx.AsyncClient(headers={"Authorization": f"Bearer {token}"}) as http,
            Client(streamable_http_client(GATEWAY, http_client=http)) as client,
        ):
            return {tool.name for tool in (await client.list_tools()).tools}

    return anyio.run(ask)


def test_every_container_is_healthy_and_set_up_has_ended_well(stack: None) -> None:
    found = containers()
    assert {name: entry["Health"] for name, entry in found.items() if name != "setup"} == dict.fromkeys(
        RUNNING, "healthy"
    )
    assert found["setup"]["ExitCode"] == 0


@pytest.mark.parametrize("service", RUNNING)
def test_a_container_holds_no_compiler_and_says_what_it_is(stack: None, service: str) -> None:
    names = "cc gcc g++ c++ clang ld as make cmake"
    assert inside(service, "sh", "-c", f"for name in {names}; do command -v $name; done; true") == ""
    labels = inspect(service)["Config"]["Labels"]
    assert labels["org.opencontainers.image.title"] == f"DriveMCP {service}"
    assert labels["org.opencontainers.image.licenses"] == "Apache-2.0"
    assert labels["org.opencontainers.image.version"]
    assert labels["org.opencontainers.image.revision"]


def test_the_drive_is_logged_and_the_log_verifies(stack: None) -> None:
    def verified() -> dict[str, Any]:
        text = inside("logger", "python3", "-m", "drivemcp.cli", "audit", "verify", "--json", *log_files())
        report: dict[str, Any] = json.loads(text)
        return report

    def driven() -> bool:
        report = verified()
        return bool(sum(file["messages"] for file in report["files"]) > 20 * DRIVE_S)

    assert eventually(driven, 60.0 + DRIVE_S)
    report = verified()
    assert report["continuity"] == []
    assert all(file["first_bad"] is None for file in report["files"])


def test_the_gateway_asks_for_its_token_and_lists_every_servers_tools(stack: None) -> None:
    with pytest.raises(urllib.error.HTTPError) as refused:
        urllib.request.urlopen(urllib.request.Request(GATEWAY, data=b"{}", method="POST"), timeout=10)
    assert refused.value.code == 401
    refused.value.close()
    of_recordings = {"step_recording"}  # a bus that plays one has it
    wanted = {tool for row in SERVICES if row.name != "player" for tool in row.tools} - set(RESERVED) - of_recordings
    assert eventually(lambda: wanted <= tools_at_the_gateway(), 20.0)
    assert not set(RESERVED) & tools_at_the_gateway()


def test_the_cockpit_lets_in_its_own_token_alone(stack: None) -> None:
    token = inside("cockpit", "cat", "/secrets/cockpit/token").strip()
    for given, status in (("a-token-of-another-service", 401), (token, 200)):
        answer = httpx.get(COCKPIT, headers={"Authorization": f"Bearer {given}"}, timeout=10)
        assert answer.status_code == status


def test_the_viewer_answers_on_loopback(stack: None) -> None:
    with urllib.request.urlopen(VIEWER, timeout=10) as page:
        assert page.status == 200
        assert b"<html" in page.read(4096).lower()


def test_a_member_without_credentials_finds_no_tool(stack: None) -> None:
    said = inside(
        "weather", "python3", "-m", "drivemcp.cli", "tools", "list", "--connect", "tcp/router:7447", "--vehicle", "demo",
        check=False,
    )  # fmt: skip
    assert "applicable_limit" not in said
    assert "assess_weather" not in said


@pytest.mark.parametrize("name", RUNNING)
def test_a_container_sees_its_own_secrets_and_can_write_nowhere_else(stack: None, name: str) -> None:
    assert inside(name, "ls", "/secrets").split() == [name]
    assert inside(name, "id", "-u").strip() == "10001"
    said = inside(name, "sh", "-c", f"touch /x /opt/x /secrets/{name}/x && echo written", check=False)
    assert "written" not in said


HEAVY = ("torch", "numpy", "cv2", "onnxruntime", "can", "mcap", "rerun", "mcp", "highway_env", "cryptography")
HOLDS = {
    "router": set(),
    "weather": set(),
    "rules": {"cryptography"},
    "orchestrator": set(),
    "arbiter": {"cryptography"},
    "can": {"can", "cryptography"},
    "retrieval": {"numpy"},
    "gateway": {"mcp", "cryptography"},
    "cockpit": set(),
    "logger": {"numpy", "mcap", "rerun", "cryptography"},
    "perception": {"numpy", "cv2", "onnxruntime"},
    "drivelm": {"numpy", "cv2", "onnxruntime"},
    "simulator": {"numpy", "cv2", "can", "highway_env"},
}  # fmt: skip


@pytest.mark.parametrize("name", RUNNING)
def test_an_image_holds_its_own_extra_alone(stack: None, name: str) -> None:
    program = f"import importlib.util as u; print(*(m for m in {HEAVY!r} if u.find_spec(m)))"
    assert set(inside(name, "python3", "-c", program).split()) == HOLDS[name]


def test_a_service_that_ends_is_started_again(stack: None) -> None:
    inside("weather", "python3", "-c", "import os, signal; os.kill(1, signal.SIGTERM)", check=False)
    assert eventually(lambda: inspect("weather")["RestartCount"] >= 1, 30.0)
    assert eventually(lambda: containers()["weather"]["Health"] == "healthy", 60.0)


def test_nothing_outgrew_its_memory_or_fell_over_while_driving(stack: None) -> None:
    states = {name: inspect(name) for name in RUNNING}
    assert [name for name, state in states.items() if state["State"]["OOMKilled"]] == []
    assert {name: state["RestartCount"] for name, state in states.items() if name != "weather"} == dict.fromkeys(
        [name for name in RUNNING if name != "weather"], 0
    )


def test_a_logger_stopped_in_order_leaves_a_closed_log(stack: None) -> None:
    before = log_files()
    compose("stop", "logger", timeout_s=40.0)
    verify = ["run", "--rm", "--no-deps", "-T", "--entrypoint", "python3", "logger", "-m", "drivemcp.cli"]
    said = compose(*verify, "audit", "verify", "--closed", *before, timeout_s=60.0).stdout
    assert "verified" in said
    assert "UNCLOSED" not in said


def test_down_leaves_nothing_behind(stack: None) -> None:
    compose("down", "-v", "--timeout", "10", timeout_s=120.0)
    assert containers() == {}
    for kind in ("network", "volume"):
        listing = ["docker", kind, "ls", "-q", "--filter", f"label=com.docker.compose.project={PROJECT}"]
        assert subprocess.run(listing, capture_output=True, text=True, timeout=20, check=True).stdout == ""

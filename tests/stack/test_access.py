"""Access control on a real router: what a row does not say is denied, whoever asks."""

import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from drivemcp.bus.session import Bus, open_bus, wait_settled
from drivemcp.bus.tls import usable
from drivemcp.config import BusConfig, ServiceConfig
from drivemcp.errors import BusError
from drivemcp.node import Node
from drivemcp.runtime.supervisor import free_port
from proto import topics
from proto.decision import BrakeCommand
from proto.vehicle import Ego
from tests.stack.conftest import wait_for_router

pytestmark = pytest.mark.stack
StartRouter = Callable[..., str]


@pytest.fixture
def guarded(start_router: StartRouter, secrets_folder: Path) -> str:
    """A router with generated access control."""
    return start_router(
        "--access", str(secrets_folder / "router/access.json"), "--credentials", str(secrets_folder / "router/users.txt"),
        ready=lambda endpoint: wait_for_router(endpoint, "logger", str(secrets_folder / "logger/password")),
    )  # fmt: skip


@contextmanager
def member(
    endpoint: str, secrets: Path, name: str, user: str | None = None, certificate: str | None = None
) -> Iterator[Node]:
    """A node with the credentials of a service."""
    user = user or name
    folder = str(secrets / (certificate or user)) if endpoint.startswith("tls/") else ""
    config = BusConfig(
        connect=(endpoint,), user=user, password_file=str(secrets / user / "password"), tls_folder=folder
    )  # fmt: skip
    with open_bus(config) as bus, opened(bus, name) as node:
        yield node


@contextmanager
def opened(bus: Bus, name: str) -> Iterator[Node]:
    """A node on a bus."""
    node = Node(bus, name, ServiceConfig())
    yield node
    node.close()


def test_a_service_reads_what_its_row_says(guarded: str, secrets_folder: Path) -> None:
    with member(guarded, secrets_folder, "can") as can, member(guarded, secrets_folder, "weather") as weather:
        weather.subscribe(topics.EGO)
        weather.open(announce=False)
        can.open()

        def arrives() -> bool:
            can.publish(topics.EGO, Ego(speed_mps=3.0))
            return weather.latest(topics.EGO) is not None

        assert wait_settled(arrives, 5.0)


def test_a_guest_without_or_with_wrong_credentials_reads_nothing_and_reaches_no_tool(
    guarded: str, secrets_folder: Path, tmp_path: Path
) -> None:
    wrong = tmp_path / "wrong"
    wrong.write_text("wrong")
    with pytest.raises(BusError):
        open_bus(BusConfig(connect=(guarded,), user="logger", password_file=str(wrong), connect_timeout_s=2.0))
    with member(guarded, secrets_folder, "can") as can:
        serve_ping(can)
        try:
            guest_bus = open_bus(BusConfig(connect=(guarded,), connect_timeout_s=2.0))
        except BusError:
            return  # not even let in
        with guest_bus, opened(guest_bus, "guest") as guest:
            guest.subscribe(topics.EGO)
            guest.open(announce=False)
            can.publish(topics.EGO, Ego(speed_mps=3.0))
            assert guest.client.discover(0.5) == {}
            assert guest.latest(topics.EGO) is None


def serve_ping(node: Node) -> None:
    """Offer `vehicle_health` and go live."""

    @node.tool(deadline_ms=1000)
    def vehicle_health() -> dict[str, str]:
        """Who answers."""
        return {"from": node.name}

    node.open()


def test_the_orchestrator_cannot_actuate_and_the_arbiter_can(guarded: str, secrets_folder: Path) -> None:
    with (
        member(guarded, secrets_folder, "simulator") as simulator,
        member(guarded, secrets_folder, "orchestrator") as orchestrator,
        member(guarded, secrets_folder, "arbiter") as arbiter,
    ):
        simulator.subscribe(topics.BRAKE)
        simulator.open()
        command = BrakeCommand(deceleration_mps2=3.0, jerk_mps3=5.0, grant_id="none")
        for _ in range(20):
            orchestrator.publish(topics.BRAKE, command)

        def arrives() -> bool:
            arbiter.publish(topics.BRAKE, command)
            return simulator.latest(topics.BRAKE) is not None

        assert wait_settled(arrives, 5.0)
        latest = simulator.latest(topics.BRAKE)
        assert latest is not None
        assert latest.publisher == "arbiter"
        assert simulator.health(topics.BRAKE).alive


def test_a_rogue_server_is_never_asked(guarded: str, secrets_folder: Path) -> None:
    with (
        member(guarded, secrets_folder, "can", user="weather") as rogue,
        member(guarded, secrets_folder, "can") as can,
        member(guarded, secrets_folder, "orchestrator") as orchestrator,
    ):
        asked: list[str] = []

        @rogue.tool(deadline_ms=1000)
        def vehicle_health() -> dict[str, str]:
            """The rogue's own."""
            asked.append("rogue")
            return {"from": "rogue"}

        rogue.open()
        serve_ping(can)
        orchestrator.watch_services()
        orchestrator.open()
        assert wait_settled(lambda: "vehicle_health" in orchestrator.catalogue(), 5.0)
        answers = [orchestrator.call("vehicle_health", {}, deadline_ms=2000) for _ in range(20)]
        assert all(answer.result == {"from": "can"} for answer in answers)
        assert asked == []


def test_rules_may_ask_retrieval_and_nobody_else(guarded: str, secrets_folder: Path) -> None:
    with member(guarded, secrets_folder, "can") as can, member(guarded, secrets_folder, "rules") as rules:
        serve_ping(can)
        assert wait_settled(lambda: True, 0.1)
        rules.open(announce=False)
        assert rules.client.discover(0.5) == {}
        assert rules.call("vehicle_health", {}, deadline_ms=500).status == "unavailable"


def access(folder: Path, *arguments: str) -> None:
    """`drivemcp access`, as a user types it."""
    command = [sys.executable, "-m", "drivemcp.cli", "access", str(folder), *arguments]
    subprocess.run(command, check=True, timeout=60)


@pytest.fixture
def between_hosts(start_router: StartRouter, tmp_path: Path) -> tuple[str, str, Path]:
    """A router with certificates: its endpoint for other hosts, the one for this host, and the folder of secrets."""
    folder, endpoint = tmp_path / "secrets", f"tls/127.0.0.1:{free_port()}"
    access(folder, "--tls", "127.0.0.1", "--ca", str(tmp_path / "authority"))
    here = start_router(
        "--listen", endpoint, "--tls", str(folder / "router"),
        "--access", str(folder / "router/access.json"), "--credentials", str(folder / "router/users.txt"),
        ready=lambda plain: wait_for_router(plain, "logger", str(folder / "logger/password")),
    )  # fmt: skip
    return endpoint, here, folder


def tells(sender: Node, reader: Node, speed_mps: float) -> Callable[[], bool]:
    """Publishes the ego at each look; whether the reader has it."""

    def look() -> bool:
        sender.publish(topics.EGO, Ego(speed_mps=speed_mps))
        latest = reader.latest(topics.EGO)
        return latest is not None and latest.message.speed_mps == speed_mps

    return look


def test_from_another_host_a_user_counts_only_with_its_own_certificate(between_hosts: tuple[str, str, Path]) -> None:
    endpoint, here, secrets = between_hosts
    with (
        member(endpoint, secrets, "weather") as weather,
        member(endpoint, secrets, "can", certificate="rules") as thief,
        member(endpoint, secrets, "can") as can,
        member(here, secrets, "can") as local,
    ):
        weather.subscribe(topics.EGO)
        weather.open(announce=False)
        for node in (thief, can, local):
            node.open(announce=False)
        assert wait_settled(tells(can, weather, 3.0), 10.0)
        assert not wait_settled(tells(thief, weather, 99.0), 0.5)
        assert wait_settled(tells(local, weather, 4.0), 10.0)


def test_a_running_router_takes_renewed_certificates_and_its_members_come_back(
    between_hosts: tuple[str, str, Path], tmp_path: Path
) -> None:
    endpoint, _, secrets = between_hosts

    def shown() -> bytes | None:
        host, port = endpoint.removeprefix("tls/").split(":")
        try:
            with (
                socket.create_connection((host, int(port)), 2.0) as raw,
                usable(secrets / "logger").wrap_socket(raw, server_hostname=host) as link,
            ):
                return link.getpeercert(binary_form=True)
        except OSError:
            return None

    with member(endpoint, secrets, "can") as can, member(endpoint, secrets, "weather") as weather:
        weather.subscribe(topics.EGO)
        weather.open(announce=False)
        can.open(announce=False)
        assert wait_settled(tells(can, weather, 3.0), 10.0)
        before = shown()
        assert before
        access(secrets, "--renew", "--ca", str(tmp_path / "authority"))
        assert wait_settled(lambda: shown() not in (None, before), 20.0)
        assert wait_settled(tells(can, weather, 5.0), 20.0)

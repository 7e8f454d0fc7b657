"""Links with certificates on both sides, on real sessions: what gets in, what is refused and why, what a wire shows."""

import secrets
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime, timedelta
from pathlib import Path
from socketserver import BaseRequestHandler, ThreadingTCPServer

import pytest

from drivemcp.bus.certificates import write_certificates
from drivemcp.bus.session import Bus, open_bus, wait_settled
from drivemcp.bus.tls import OWN
from drivemcp.config import BusConfig
from drivemcp.errors import BusError, UserError
from drivemcp.runtime.supervisor import free_port
from drivemcp.testing import serving

MEMBERS = ("router", "can", "weather")
LONG_AGO = datetime.now(UTC) - timedelta(days=90)


@pytest.fixture
def hosts(tmp_path: Path) -> Path:
    """The folders that hosts are given, with certificates that serve."""
    write_certificates(tmp_path / "hosts", tmp_path / "authority", MEMBERS, ("127.0.0.1",))
    return tmp_path / "hosts"


@contextmanager
def routing(folder: Path, scheme: str = "tls") -> Iterator[str]:
    """A router with the certificate in a folder; its endpoint."""
    endpoint = f"{scheme}/127.0.0.1:{free_port()}"
    with open_bus(BusConfig(listen=(endpoint,), tls_folder=str(folder)), mode="router", log="off"):
        yield endpoint


def joined(endpoint: str, folder: Path | None, timeout_s: float = 2.0) -> Bus:
    """A member of the bus by the certificate in its folder."""
    config = BusConfig(connect=(endpoint,), tls_folder=str(folder or ""), connect_timeout_s=timeout_s)
    return open_bus(config, log="off")


def exchanges(sender: Bus, receiver: Bus, payload: bytes = b"x") -> Callable[[], bool]:
    """Sends at each look; whether anything has arrived since the last one."""
    heard = threading.Event()
    key = f"test/{secrets.token_hex(4)}"
    receiver.subscribe(key, lambda _, data, __: heard.set() if data == payload else None)
    publisher = sender.publisher(key)

    def look() -> bool:
        heard.clear()
        publisher.put(payload, b"")
        return heard.wait(0.05)

    return look


def test_members_with_certificates_of_one_authority_exchange(hosts: Path) -> None:
    with (
        routing(hosts / "router") as endpoint,
        joined(endpoint, hosts / "can") as can,
        joined(endpoint, hosts / "weather") as weather,
    ):
        assert wait_settled(exchanges(can, weather), 10.0)
        assert wait_settled(exchanges(weather, can), 10.0)


def with_an_expired_one(hosts: Path) -> Path:
    write_certificates(hosts, hosts.parent / "authority", ["expired"], now=LONG_AGO)
    return hosts / "expired"


def with_one_of_another_authority(hosts: Path) -> Path:
    """It believes ours, and shows what ours did not sign."""
    write_certificates(hosts, hosts.parent / "another", ["stranger"])
    (hosts / "stranger" / "ca.pem").write_bytes((hosts / "router" / "ca.pem").read_bytes())
    return hosts / "stranger"


def that_believes_another_authority(hosts: Path) -> Path:
    write_certificates(hosts, hosts.parent / "another", ["stranger"])
    return hosts / "stranger"


REFUSED: dict[Callable[[Path], Path], str] = {
    with_an_expired_one: "127.0.0.1 refuses our certificate: .*expired",
    with_one_of_another_authority: "127.0.0.1 refuses our certificate: .*unknown ca",
    that_believes_another_authority: "the certificate of 127.0.0.1 is refused here: unable to get local issuer",
}


@pytest.mark.parametrize("stranger", REFUSED, ids=lambda each: str(each.__name__))
def test_a_member_that_does_not_belong_is_refused_and_told_why(hosts: Path, stranger: Callable[[Path], Path]) -> None:
    folder = stranger(hosts)
    with routing(hosts / "router") as endpoint, pytest.raises(BusError, match=REFUSED[stranger]):
        joined(endpoint, folder)


def test_without_a_certificate_there_is_no_link(hosts: Path) -> None:
    """Neither in words of TLS nor in plain ones."""
    with routing(hosts / "router") as endpoint:
        with pytest.raises(UserError, match="takes certificates"):
            joined(endpoint, None)
        with pytest.raises(BusError):
            joined(endpoint.replace("tls/", "tcp/"), None)


def test_a_router_under_another_name_or_with_a_services_certificate_is_refused(hosts: Path, tmp_path: Path) -> None:
    write_certificates(tmp_path / "elsewhere", tmp_path / "authority", ["router"], ("10.1.2.3",))
    with routing(tmp_path / "elsewhere/router") as endpoint, pytest.raises(BusError, match="IP address mismatch"):
        joined(endpoint, hosts / "can")
    with routing(hosts / "weather") as endpoint, pytest.raises(BusError, match="unsuitable certificate purpose"):
        joined(endpoint, hosts / "can")


def test_files_that_are_no_certificates_are_named(hosts: Path) -> None:
    (hosts / "can" / OWN).write_text("nothing of use")
    with pytest.raises(UserError, match=r"can/tls\.pem is no certificate of use"):
        joined("tls/127.0.0.1:1", hosts / "can")
    (hosts / "can" / OWN).unlink()
    with pytest.raises(UserError, match=r"cannot read .*can/tls\.pem"):
        joined("tls/127.0.0.1:1", hosts / "can")


@pytest.mark.parametrize("endpoint", ["tcp/0.0.0.0:7447", "tcp/192.0.2.1:7447", "ws/router:7447", "udp/[::]:7447"])
def test_with_certificates_nothing_plain_leaves_this_host(hosts: Path, endpoint: str) -> None:
    with pytest.raises(UserError, match="not encrypted and leaves this host"):
        joined(endpoint, hosts / "can")


def test_loopback_may_stay_plain(hosts: Path) -> None:
    with (
        routing(hosts / "router", "tcp") as endpoint,
        joined(endpoint, None) as can,
        joined(endpoint, hosts / "weather") as weather,
    ):
        assert wait_settled(exchanges(can, weather), 10.0)


def test_after_a_renewal_old_and_new_certificates_serve_side_by_side(hosts: Path, tmp_path: Path) -> None:
    old = tmp_path / "old"
    (hosts / "can").rename(old)
    renewed = write_certificates(hosts, tmp_path / "authority", MEMBERS, renew=True)
    assert [member.renewed for member in renewed] == [True] * 3
    assert (hosts / "can" / OWN).read_bytes() != (old / OWN).read_bytes()
    with (
        routing(hosts / "router") as endpoint,
        joined(endpoint, old) as can,
        joined(endpoint, hosts / "can") as again,
        joined(endpoint, hosts / "weather") as weather,
    ):
        assert wait_settled(exchanges(can, weather), 10.0)
        assert wait_settled(exchanges(again, can), 10.0)


def test_a_link_ends_with_its_certificate_and_comes_back_with_a_renewed_one(hosts: Path, tmp_path: Path) -> None:
    """All sessions go on running: one that was renewed meanwhile is in again by itself, one that was not stays out."""
    authority = tmp_path / "authority"
    short = write_certificates(hosts, authority, ["can", "weather"], life=timedelta(seconds=5), renew=True)[0].ends
    write_certificates(hosts, authority, ["logger"])
    with (
        routing(hosts / "router") as endpoint,
        joined(endpoint, hosts / "can") as can,
        joined(endpoint, hosts / "weather") as weather,
        joined(endpoint, hosts / "logger") as logger,
    ):
        renewed, forgotten = exchanges(can, logger), exchanges(weather, logger)
        assert wait_settled(forgotten, 4.0)
        write_certificates(hosts, authority, ["can"], renew=True)
        assert wait_settled(lambda: datetime.now(UTC) > short and not any(forgotten() for _ in range(20)), 20.0)
        assert wait_settled(renewed, 10.0)
        assert not forgotten()


class Relay(BaseRequestHandler):
    """Passes bytes on in both directions and keeps them."""

    server: "Wire"

    def handle(self) -> None:
        with socket.create_connection(("127.0.0.1", self.server.beyond)) as far:
            back = threading.Thread(target=self._pass_on, args=(far, self.request))
            back.start()
            self._pass_on(self.request, far)
            back.join(5.0)

    def _pass_on(self, source: socket.socket, sink: socket.socket) -> None:
        with suppress(OSError):
            while data := source.recv(65536):
                self.server.captured += data
                sink.sendall(data)
            sink.shutdown(socket.SHUT_WR)


class Wire(ThreadingTCPServer):
    """What a listener on the wire between two hosts sees."""

    daemon_threads = True

    def __init__(self, beyond: int) -> None:
        super().__init__(("127.0.0.1", 0), Relay)
        self.beyond, self.captured = beyond, bytearray()


@pytest.mark.parametrize(("scheme", "readable"), [("tcp", True), ("tls", False)])
def test_payloads_are_on_a_captured_wire_only_where_it_is_plain(hosts: Path, scheme: str, readable: bool) -> None:
    payload = secrets.token_hex(64).encode()
    with routing(hosts / "router", scheme) as endpoint, serving(Wire(int(endpoint.rpartition(":")[2]))) as wire:
        tapped = f"{scheme}/127.0.0.1:{wire.server_address[1]}"
        with joined(tapped, hosts / "can") as can, joined(endpoint, hosts / "weather") as weather:
            assert wait_settled(exchanges(can, weather, payload), 10.0)
            assert wait_settled(lambda: len(wire.captured) > len(payload), 5.0)
    assert (payload in wire.captured) is readable

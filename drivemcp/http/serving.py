"""Serves an ASGI app in a thread of its own: on loopback freely, anywhere else only with a token."""

import socket
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import msgspec
import uvicorn

from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError
from drivemcp.http.limits import App, protocol, with_size
from drivemcp.node import Node

LOOPBACK = ("127.0.0.1", "localhost", "::1")


class HttpConfig(ServiceConfig, frozen=True, kw_only=True):
    """Where to listen; port 0 takes a free one, which is told in the service's health."""

    host: str = "127.0.0.1"
    """Address to listen on; one beyond loopback needs `token_file`."""
    port: int = 0
    """0 takes a free port."""
    token_file: str = ""
    """File that holds the token of the clients, at least 16 characters."""
    allowed_hosts: tuple[str, ...] = ()
    """Host headers to accept beyond loopback, for example `car.example:*`."""
    request_s: Annotated[float, msgspec.Meta(gt=0.0, le=3600.0)] = 10.0
    """From a connection, or a request's first byte, to its last byte; then the connection is cut."""
    idle_s: Annotated[int, msgspec.Meta(ge=1, le=3600)] = 30
    """Between an answer and the next request of a connection."""
    max_connections: Annotated[int, msgspec.Meta(ge=1, le=10_000)] = 64
    """One more is closed at once."""
    max_request_kb: Annotated[int, msgspec.Meta(ge=1, le=65_536)] = 1024
    """A larger request is answered with 413."""


def token_of(config: HttpConfig) -> str:
    """The token that clients have to bring; empty on loopback without one. Raises ConfigError."""
    if config.token_file:
        try:
            token = Path(config.token_file).read_text(encoding="ascii").strip()
        except OSError as error:
            raise ConfigError(f"token_file {config.token_file}: {error.strerror}") from None
        if len(token) < 16:
            raise ConfigError(f"token_file {config.token_file}: a token has at least 16 characters")
        return token
    if config.host not in LOOPBACK:
        raise ConfigError(f"host {config.host} can be reached from beyond this machine: set token_file")
    return ""


def listen(config: HttpConfig) -> socket.socket:
    """A socket that listens. Raises ConfigError on a port that is taken."""
    family = socket.AF_INET6 if ":" in config.host else socket.AF_INET
    # named, or asyncio leaves Nagle's algorithm on: an answer in two parts then waits 40 ms for the client's acknowledgement
    listener = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((config.host, config.port))
    except OSError as error:
        listener.close()
        raise ConfigError(f"port {config.port} of {config.host} cannot be used: {error.strerror}") from None
    listener.listen(64)
    return listener


def serve(
    node: Node, config: HttpConfig, listener: socket.socket, app: App, guard: Callable[[App], App] = lambda app: app
) -> str:
    """Serve until the node closes, a guard before the bound on sizes. Returns the address, without a path."""
    host, port = listener.getsockname()[:2]
    server = uvicorn.Server(
        uvicorn.Config(
            guard(with_size(app, config.max_request_kb * 1024)),
            log_level="warning",
            lifespan="auto",
            ws="none",
            http=protocol(request_s=config.request_s, most=config.max_connections),
            timeout_keep_alive=config.idle_s,
            timeout_graceful_shutdown=2,
            h11_max_incomplete_event_size=16_384,
        )
    )
    server.install_signal_handlers = lambda: None  # type: ignore[attr-defined]
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, name=f"{node.name}-http", daemon=True)
    thread.start()

    def stop() -> None:
        server.should_exit = True
        thread.join(4.0)
        listener.close()

    node.on_close(stop)
    return f"http://{f'[{host}]' if ':' in host else host}:{port}"

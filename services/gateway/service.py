"""Serves MCP over streamable HTTP: on loopback freely, anywhere else only with a token. The one place with asyncio."""

import hmac
import socket
import threading
from pathlib import Path
from typing import Annotated

import msgspec
import uvicorn

from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError
from drivemcp.node import Node
from drivemcp.service import Service
from services.gateway.limits import protocol, with_size, with_token
from services.gateway.server import make_server

LOOPBACK = ("127.0.0.1", "localhost", "::1")


class GatewayConfig(ServiceConfig, frozen=True, kw_only=True):
    """Where to listen; port 0 takes a free one, which is told in the service's health."""

    host: str = "127.0.0.1"
    port: int = 0
    token_file: str = ""
    allowed_hosts: tuple[str, ...] = ()
    """Host headers to accept beyond loopback, for example `car.example:*`."""
    request_s: Annotated[float, msgspec.Meta(gt=0.0, le=3600.0)] = 10.0
    """From a connection, or a request's first byte, to its last byte; then the connection is cut."""
    idle_s: Annotated[int, msgspec.Meta(ge=1, le=3600)] = 30
    """Between an answer and the next request of a connection."""
    max_connections: Annotated[int, msgspec.Meta(ge=1, le=10_000)] = 64
    max_request_kb: Annotated[int, msgspec.Meta(ge=1, le=65_536)] = 1024


def build(config: GatewayConfig, node: Node) -> None:
    """Listen in a thread of its own. Raises ConfigError on a taken port, or on a public address without a token."""
    token = _token(config)
    node.watch_services()
    listener = _listen(config)
    host, port = listener.getsockname()[:2]
    app = make_server(node).streamable_http_app(
        json_response=True, stateless_http=True, host=config.host, transport_security=_security(config)
    )
    sized = with_size(app, config.max_request_kb * 1024)
    wanted = f"Bearer {token}".encode()
    guarded = with_token(sized, lambda given: hmac.compare_digest(given, wanted)) if token else sized
    server = uvicorn.Server(
        uvicorn.Config(
            guarded,
            log_level="warning",
            lifespan="on",
            ws="none",
            http=protocol(request_s=config.request_s, most=config.max_connections),
            timeout_keep_alive=config.idle_s,
            h11_max_incomplete_event_size=16_384,
        )
    )
    server.install_signal_handlers = lambda: None  # type: ignore[attr-defined]
    thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, name="gateway-http", daemon=True)
    thread.start()
    node.detail["mcp"] = f"http://{host}:{port}/mcp"

    def stop() -> None:
        server.should_exit = True
        thread.join(4.0)
        listener.close()

    node.on_close(stop)


def _security(config: GatewayConfig):  # type: ignore[no-untyped-def]
    from mcp.server.transport_security import TransportSecuritySettings

    if config.host in LOOPBACK and not config.allowed_hosts:
        return None  # the SDK's own protection of loopback
    hosts = ["127.0.0.1:*", "localhost:*", "[::1]:*", *config.allowed_hosts]
    return TransportSecuritySettings(
        enable_dns_rebinding_protection=True, allowed_hosts=hosts, allowed_origins=[f"http://{host}" for host in hosts]
    )


def _token(config: GatewayConfig) -> str:
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


def _listen(config: GatewayConfig) -> socket.socket:
    family = socket.AF_INET6 if ":" in config.host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((config.host, config.port))
    except OSError as error:
        listener.close()
        raise ConfigError(f"port {config.port} of {config.host} cannot be used: {error.strerror}") from None
    listener.listen(64)
    return listener


SERVICE = Service("gateway", GatewayConfig, build)

"""Serves MCP over streamable HTTP: on loopback freely, anywhere else only with a token."""

import hmac
from pathlib import Path
from typing import Annotated

import msgspec

from drivemcp.http.limits import App, with_token
from drivemcp.http.serving import LOOPBACK, HttpConfig, listen, serve, token_of
from drivemcp.node import Node
from drivemcp.registry import service_rows
from drivemcp.service import Service
from services.gateway.changes import Changes
from services.gateway.drives import Drives
from services.gateway.permitting import Gate
from services.gateway.server import make_server
from services.gateway.tool_list import checked_groups


class GatewayConfig(HttpConfig, frozen=True, kw_only=True):
    """Where to listen, what one client may take, and which tools it is offered."""

    tools: tuple[str, ...] = ()
    """Groups of tools (`services/gateway/tool_list.py`), or names of experts; empty: all tools."""

    max_sessions: Annotated[int, msgspec.Meta(ge=1, le=10_000)] = 64
    """Of clients that speak a revision before 2026-07-28; later ones have none."""
    session_idle_s: Annotated[float, msgspec.Meta(gt=0.0, le=86_400.0)] = 600.0
    """Such a session ends after so long without a request or an open stream."""
    images: bool = True
    """Whether answers on the scene and on decisions come with their picture."""


def build(config: GatewayConfig, node: Node) -> None:
    """Listen in a thread of its own. Raises ConfigError on a taken port, or on a public address without a token."""
    token = token_of(config)
    node.watch_services()
    changes, drives = Changes(), Drives(Path(config.out_dir).absolute().parent)
    groups, gate = checked_groups(config.tools, service_rows()), Gate(grant_file=config.grant_file)
    server = make_server(node, changes, drives, images=config.images, groups=groups, gate=gate)
    app = server.streamable_http_app(
        host=config.host,
        transport_security=_security(config),
        max_sessions=config.max_sessions,
        session_idle_timeout=config.session_idle_s,
    )

    def guard(app: App) -> App:
        return with_token(app, lambda given: bears(given, token)) if token else app

    node.detail["mcp"] = f"{serve(node, config, listen(config), app, guard)}/mcp"
    node.on_close(changes.close)  # before the server ends: closers run from the last to the first


def bears(given: bytes, token: str) -> bool:
    """Whether an Authorization header holds the token; its scheme is `Bearer` in any case (RFC 9110, 11.1)."""
    scheme, _, credentials = given.partition(b" ")
    return hmac.compare_digest(credentials.lstrip(b" "), token.encode()) and scheme.lower() == b"bearer"


def _security(config: GatewayConfig):  # type: ignore[no-untyped-def]
    from mcp.server.transport_security import TransportSecuritySettings

    if config.host in LOOPBACK and not config.allowed_hosts:
        return None  # the SDK's own protection of loopback
    hosts = ["127.0.0.1:*", "localhost:*", "[::1]:*", *config.allowed_hosts]
    return TransportSecuritySettings(
        enable_dns_rebinding_protection=True, allowed_hosts=hosts, allowed_origins=[f"http://{host}" for host in hosts]
    )


SERVICE = Service("gateway", GatewayConfig, build)

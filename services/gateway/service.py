"""Serves MCP over streamable HTTP: on loopback freely, anywhere else only with a token."""

import hmac

from drivemcp.http.limits import App, with_token
from drivemcp.http.serving import LOOPBACK, HttpConfig, listen, serve, token_of
from drivemcp.node import Node
from drivemcp.service import Service
from services.gateway.server import make_server


class GatewayConfig(HttpConfig, frozen=True, kw_only=True):
    """Where to listen, and what one client may take."""


def build(config: GatewayConfig, node: Node) -> None:
    """Listen in a thread of its own. Raises ConfigError on a taken port, or on a public address without a token."""
    token = token_of(config)
    node.watch_services()
    app = make_server(node).streamable_http_app(
        json_response=True, stateless_http=True, host=config.host, transport_security=_security(config)
    )
    wanted = f"Bearer {token}".encode()

    def guard(app: App) -> App:
        return with_token(app, lambda given: hmac.compare_digest(given, wanted)) if token else app

    node.detail["mcp"] = f"{serve(node, config, listen(config), app, guard)}/mcp"


def _security(config: GatewayConfig):  # type: ignore[no-untyped-def]
    from mcp.server.transport_security import TransportSecuritySettings

    if config.host in LOOPBACK and not config.allowed_hosts:
        return None  # the SDK's own protection of loopback
    hosts = ["127.0.0.1:*", "localhost:*", "[::1]:*", *config.allowed_hosts]
    return TransportSecuritySettings(
        enable_dns_rebinding_protection=True, allowed_hosts=hosts, allowed_origins=[f"http://{host}" for host in hosts]
    )


SERVICE = Service("gateway", GatewayConfig, build)

"""Links between hosts: TLS with a certificate on both sides. A member's folder holds `ca.pem` and `tls.pem` (certificate and key).

Both are one file each, replaced as a whole: a renewal is never half there. Zenoh reads them again with each connection.
"""

import socket
from contextlib import suppress
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING

from drivemcp.config import BusConfig
from drivemcp.errors import UserError

if TYPE_CHECKING:
    import ssl

AUTHORITY, OWN = "ca.pem", "tls.pem"
_PROBE_S = 2.0
_MADE_BY = "make them with: drivemcp access FOLDER --tls NAME"


def tls_settings(config: BusConfig) -> dict[str, object]:
    """Zenoh's settings for `tls/` endpoints. Raises UserError for files that do not serve and for endpoints that do not fit."""
    encrypted = [one for one in (*config.connect, *config.listen) if one.startswith("tls/")]
    if not config.tls_folder:
        if encrypted:
            raise UserError(
                f"{encrypted[0]} takes certificates: name their folder (bus.tls_folder, --tls of the router)"
            )
        return {}
    plain = [one for one in (*config.connect, *config.listen) if one not in encrypted and not _here(one)]
    if plain:
        raise UserError(f"{plain[0]} is not encrypted and leaves this host: with certificates, write tls/ instead")
    folder = Path(config.tls_folder)
    usable(folder)
    own = str(folder / OWN)
    settings: dict[str, object] = {
        "root_ca_certificate": str(folder / AUTHORITY),
        "enable_mtls": True,
        "verify_name_on_connect": True,
        "close_link_on_expiration": True,
    }
    if config.connect:
        settings |= {"connect_certificate": own, "connect_private_key": own}
    if config.listen:
        settings |= {"listen_certificate": own, "listen_private_key": own}
    return {"transport/link/tls": settings}


def usable(folder: Path) -> "ssl.SSLContext":
    """What Python itself makes of a member's files. Raises UserError where they are absent, broken or do not belong together."""
    import ssl  # a service without certificates does not pay for it

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    for name, load in ((AUTHORITY, context.load_verify_locations), (OWN, context.load_cert_chain)):
        try:
            load(folder / name)
        except ssl.SSLError as error:
            raise UserError(f"{folder / name} is no certificate of use ({error.reason}); {_MADE_BY}") from None
        except OSError as error:
            raise UserError(f"cannot read {folder / name}: {error.strerror}; {_MADE_BY}") from None
    return context


def why_refused(config: BusConfig) -> str:
    """What the first `tls/` endpoint that answers says against a link, or this side against its certificate. Empty: nothing."""
    if not config.tls_folder:
        return ""
    context = usable(Path(config.tls_folder))
    for endpoint in config.connect:
        if endpoint.startswith("tls/"):
            with suppress(OSError, ValueError):
                return _asked(context, *_address(endpoint))
    return ""


def _asked(context: "ssl.SSLContext", host: str, port: int) -> str:
    import ssl

    with socket.create_connection((host, port), _PROBE_S) as raw:
        try:
            with context.wrap_socket(raw, server_hostname=host) as link:
                link.settimeout(_PROBE_S)
                link.recv(1)  # in TLS 1.3 the refusal of a client's certificate comes after the handshake
        except TimeoutError:
            return ""
        except ssl.SSLCertVerificationError as error:
            return f"the certificate of {host} is refused here: {error.verify_message}"
        except ssl.SSLError as error:
            return f"{host} refuses our certificate: {(error.reason or 'no reason').lower().replace('_', ' ')}"
    return ""


def _address(endpoint: str) -> tuple[str, int]:
    """Host and port of `tls/HOST:PORT`. Raises ValueError."""
    host, _, port = endpoint.partition("/")[2].partition("?")[0].partition("#")[0].rpartition(":")
    return host.strip("[]"), int(port)


def _here(endpoint: str) -> bool:
    """Whether an endpoint stays on this host."""
    if not endpoint.startswith(("tcp/", "udp/", "quic/", "ws/")):
        return True
    try:
        host, _ = _address(endpoint)
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False

"""Which addresses of the internet may be asked."""

import ipaddress
import urllib.parse


def is_loopback(host: str) -> bool:
    """Whether a host is this very machine."""
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def is_private(url: str) -> bool:
    """Whether nobody on the way can read or change what passes: https, or http to this very machine."""
    parts = urllib.parse.urlsplit(url)
    host = parts.hostname or ""
    return (parts.scheme == "https" and host != "") or (parts.scheme == "http" and is_loopback(host))

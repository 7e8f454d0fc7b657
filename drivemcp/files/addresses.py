"""Which addresses of the internet may be asked."""

import ipaddress
import urllib.parse


def is_loopback(host: str) -> bool:
    """Whether a host is this machine."""
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def is_private(url: str) -> bool:
    """Whether what passes can be neither read nor changed on the way: https, or http to this machine."""
    parts = urllib.parse.urlsplit(url)
    host = parts.hostname or ""
    return (parts.scheme == "https" and host != "") or (parts.scheme == "http" and is_loopback(host))

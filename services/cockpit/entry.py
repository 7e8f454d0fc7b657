"""Lets a browser in: by a form that takes the token once and leaves a cookie, or by the token in a header."""

import hmac
import time
from collections.abc import Callable
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs

from drivemcp.http.limits import App, BackOff, Receive, Scope, Send
from drivemcp.http.serving import LOOPBACK

COOKIE = "drivemcp-cockpit"
FORM = "/enter"
FREE = ("/page/style.css", "/page/enter.html")
"""What a browser sees without a token: the form and its looks."""
MOST_BYTES = 4096


def with_own_origin(app: App, hosts: tuple[str, ...], *, any_host: bool) -> App:
    """Refuse what a page of another origin sends, and, unless a cookie guards, a name that is not ours (rebinding)."""

    async def guarded(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            return await app(scope, receive, send)
        headers = dict(scope["headers"])
        host, origin = headers.get(b"host", b"").decode("latin-1"), headers.get(b"origin", b"").decode("latin-1")
        if not any_host and not _is_ours(host, hosts):
            return await _answer(send, 421)
        if scope["method"] != "GET" and origin and origin.split("://")[-1] != host:
            return await _answer(send, 403)
        return await app(scope, receive, send)

    return guarded


def with_entry(app: App, token: str, *, now_s: Callable[[], float] = time.monotonic) -> App:
    """Lets in what brings the token or the form's cookie; an address that tries several has to wait."""
    back_off = BackOff()
    ticket = hmac.digest(token.encode(), b"cockpit", "sha256").hex()
    bearer = f"Bearer {token}".encode()

    def right(given: bytes, wanted: bytes) -> bool:
        return hmac.compare_digest(given, wanted)

    async def guarded(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            return await app(scope, receive, send)
        headers, path = dict(scope["headers"]), scope["path"]
        address = str((scope.get("client") or ("",))[0])
        cookie, header = _cookie(headers.get(b"cookie", b"")), headers.get(b"authorization", b"")
        if path == FORM and scope["method"] == "GET":
            return await app({**scope, "path": "/page/enter.html", "raw_path": b"/page/enter.html"}, receive, send)
        if path in FREE:
            return await app(scope, receive, send)
        if cookie and right(cookie.encode(), ticket.encode()):
            return await app(scope, receive, send)
        if path == FORM or header:
            wait_s = back_off.wait_s(address, now_s())
            if wait_s > 0:
                return await _answer(send, 429, (b"retry-after", str(int(wait_s) + 1).encode()))
            given = await _form_token(receive) if path == FORM else header
            if not right(given, token.encode() if path == FORM else bearer):
                back_off.wrong(address, now_s())
                return await _answer(send, 401)
            back_off.right(address)
            if path != FORM:
                return await app(scope, receive, send)
            kept = f"{COOKIE}={ticket}; Path=/; HttpOnly; SameSite=Strict; Max-Age=2592000"
            return await _answer(send, 303, (b"location", b"/"), (b"set-cookie", kept.encode()))
        if path == "/":
            return await _answer(send, 303, (b"location", FORM.encode()))
        return await _answer(send, 401)

    return guarded


def _is_ours(host: str, hosts: tuple[str, ...]) -> bool:
    name = host.rsplit(":", 1)[0] if not host.endswith("]") else host
    names = {*LOOPBACK, "[::1]"}
    return name in names or host in hosts or f"{name}:*" in hosts


def _cookie(header: bytes) -> str:
    jar: SimpleCookie = SimpleCookie()
    try:
        jar.load(header.decode("latin-1"))
    except CookieError:
        return ""
    return jar[COOKIE].value if COOKIE in jar else ""


async def _form_token(receive: Receive) -> bytes:
    body, whole = b"", False
    while not whole and len(body) <= MOST_BYTES:
        message = await receive()
        if message["type"] == "http.disconnect":
            return b""
        body, whole = body + message.get("body", b""), not message.get("more_body", False)
    given = parse_qs(body[:MOST_BYTES].decode("latin-1")).get("token", [""])[0]
    return given.strip().encode("utf-8")


async def _answer(send: Send, status: int, *headers: tuple[bytes, bytes]) -> None:
    await send({"type": "http.response.start", "status": status, "headers": [*headers, (b"content-length", b"0")]})
    await send({"type": "http.response.body", "body": b""})

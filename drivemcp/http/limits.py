"""What one client may take of the gateway: time for a request, idle time, connections, bytes, and tries of a token."""

import asyncio
import time
from collections.abc import Awaitable, Callable, MutableMapping
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

FREE_TRIES = 3
"""Wrong tokens of one address before it has to wait."""
FIRST_WAIT_S, LONGEST_WAIT_S = 0.5, 10.0
"""Each further one doubles the wait."""
FORGOTTEN_S = 300.0
MOST_ADDRESSES = 1024


def protocol(*, request_s: float, most: int) -> type[H11Protocol]:
    """uvicorn's protocol with a bound on connections, and one on the time until a request is there with its body.

    Without it a client that sends a byte now and then holds a connection for ever.
    """

    class Limited(H11Protocol):
        _deadline: asyncio.TimerHandle | None = None

        def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
            super().connection_made(transport)
            if len(self.connections) > most:
                transport.close()
                return
            self._expect()

        def data_received(self, data: bytes) -> None:
            super().data_received(data)
            if self.conn.their_state in (h11.IDLE, h11.SEND_BODY):
                self._expect()
            else:
                self._forget()

        def connection_lost(self, exc: Exception | None) -> None:
            self._forget()
            super().connection_lost(exc)

        def _expect(self) -> None:
            if self._deadline is None:
                self._deadline = self.loop.call_later(request_s, self.transport.abort)

        def _forget(self) -> None:
            if self._deadline is not None:
                self._deadline.cancel()
                self._deadline = None

    return Limited


class BackOff:
    """How long an address has to wait after wrong tokens. Pure but for what it remembers; times in s."""

    def __init__(self) -> None:
        self._tries: dict[str, tuple[int, float]] = {}
        """By address: wrong tokens in a row, and when the last one came."""

    def wait_s(self, address: str, now_s: float) -> float:
        """How long the address has to wait still; 0: it may try."""
        tries, last_s = self._tries.get(address, (0, 0.0))
        if tries < FREE_TRIES:
            return 0.0
        wait_s = min(LONGEST_WAIT_S, FIRST_WAIT_S * 2.0 ** min(tries - FREE_TRIES, 20))
        return max(0.0, last_s + wait_s - now_s)

    def wrong(self, address: str, now_s: float) -> None:
        """A wrong token came."""
        tries, last_s = self._tries.pop(address, (0, now_s))
        self._tries[address] = (tries + 1 if now_s - last_s < FORGOTTEN_S else 1, now_s)
        while len(self._tries) > MOST_ADDRESSES:
            del self._tries[next(iter(self._tries))]

    def right(self, address: str) -> None:
        """The right token came."""
        self._tries.pop(address, None)


def with_token(app: App, is_right: Callable[[bytes], bool], *, now_s: Callable[[], float] = time.monotonic) -> App:
    """Refuse every request that does not carry the token (RFC 6750), and, for a while, an address that tries several."""
    back_off = BackOff()

    async def guarded(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            return await app(scope, receive, send)
        address = str((scope.get("client") or ("",))[0])
        wait_s = back_off.wait_s(address, now_s())
        if wait_s > 0:
            return await _refuse(send, 429, (b"retry-after", str(int(wait_s) + 1).encode()))
        if not is_right(dict(scope["headers"]).get(b"authorization", b"")):
            back_off.wrong(address, now_s())
            return await _refuse(send, 401, (b"www-authenticate", b'Bearer realm="drivemcp"'))
        back_off.right(address)
        return await app(scope, receive, send)

    return guarded


def with_size(app: App, most_bytes: int) -> App:
    """Refuse a request whose body is larger; one that says so beforehand is not read. The app sees a body that is whole."""

    async def guarded(scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            return await app(scope, receive, send)
        said = dict(scope["headers"]).get(b"content-length", b"0")
        if len(said) > 18 or (said.isdigit() and int(said) > most_bytes):
            return await _refuse(send, 413)
        body, whole = b"", False
        while not whole:
            message = await receive()
            if message["type"] == "http.disconnect":
                return None
            body, whole = body + message.get("body", b""), not message.get("more_body", False)
            if len(body) > most_bytes:
                return await _refuse(send, 413)
        given = False

        async def once() -> MutableMapping[str, Any]:
            nonlocal given
            if given:
                return await receive()
            given = True
            return {"type": "http.request", "body": body, "more_body": False}

        return await app(scope, once, send)

    return guarded


async def _refuse(send: Send, status: int, *headers: tuple[bytes, bytes]) -> None:
    closing = [(b"content-length", b"0"), (b"connection", b"close")]
    await send({"type": "http.response.start", "status": status, "headers": [*headers, *closing]})
    await send({"type": "http.response.body", "body": b""})

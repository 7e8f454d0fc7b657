"""One stream of events to every page: what the bus brings, kept for a page that is slow, the newest for one that begins."""

import asyncio
import threading
import time
from collections.abc import AsyncIterator

import msgspec

MOST_WAITING = 100
"""Events that wait for one page; beyond them the oldest is lost."""
FRESH_S = 1.5
"""A page that begins is sent the newest event of a kind only where it is no older: what is older is no state of now."""
SILENCE_S = 1.0
"""After so long without an event a comment is sent, so that a connection that broke is found."""


class _Page:
    def __init__(self, loop: asyncio.AbstractEventLoop, first: list[bytes]) -> None:
        self.loop = loop
        self.waiting: asyncio.Queue[bytes | None] = asyncio.Queue(MOST_WAITING)
        for event in first:
            self.put(event)

    def put(self, event: bytes | None) -> None:
        if self.waiting.full():
            self.waiting.get_nowait()
        self.waiting.put_nowait(event)


class Stream:
    """Events from the node's worker thread to the pages' event loop."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._pages: set[_Page] = set()
        self._newest: dict[str, tuple[float, bytes]] = {}
        self._closed = False

    def put(self, kind: str, data: object) -> None:
        """Send to all pages, and to each that comes later, as the newest of its kind."""
        event = b"event: %s\ndata: %s\n\n" % (kind.encode(), msgspec.json.encode(data))
        with self._lock:
            self._newest[kind] = (time.monotonic(), event)
            pages = list(self._pages)
        self._send(pages, event)

    def close(self) -> None:
        """End every page's stream."""
        with self._lock:
            self._closed = True
            pages = list(self._pages)
        self._send(pages, None)

    async def events(self) -> AsyncIterator[bytes]:
        """What one page is sent, until it or the stream ends."""
        with self._lock:
            now_s = time.monotonic()
            first = [event for put_s, event in self._newest.values() if now_s - put_s <= FRESH_S]
            page = _Page(asyncio.get_running_loop(), first)
            self._pages.add(page)
            closed = self._closed
        try:
            yield b"retry: 500\n\n"
            while not closed:
                try:
                    async with asyncio.timeout(SILENCE_S):
                        event = await page.waiting.get()
                except TimeoutError:
                    event = b": still here\n\n"
                if event is None:
                    return
                yield event
        finally:
            with self._lock:
                self._pages.discard(page)

    def _send(self, pages: list[_Page], event: bytes | None) -> None:
        for page in pages:
            try:
                page.loop.call_soon_threadsafe(page.put, event)
            except RuntimeError:  # the loop has ended, and with it the page
                continue

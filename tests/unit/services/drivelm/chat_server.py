"""A local server that speaks the chat protocol, and misbehaves as the test says."""

import base64
import json
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import cv2
import numpy as np

from services.drivelm.reading.crops import Picture

Handle = Callable[["Asked", BaseHTTPRequestHandler], None]


class Asked:
    """One request as the server saw it."""

    def __init__(self, path: str, authorization: str, body: dict[str, Any]) -> None:
        self.path, self.authorization, self.body = path, authorization, body

    @property
    def prompt(self) -> str:
        """The text that came with the picture."""
        return str(self.body["messages"][0]["content"][1]["text"])

    @property
    def picture(self) -> Picture:
        """The picture, RGB."""
        url = self.body["messages"][0]["content"][0]["image_url"]["url"]
        raw = base64.b64decode(url.removeprefix("data:image/png;base64,"), validate=True)
        return np.asarray(cv2.imdecode(np.frombuffer(raw, np.uint8), cv2.IMREAD_COLOR_RGB), np.uint8)


class ChatServer:
    """Where it listens, and what it was asked."""

    def __init__(self, handle: Handle) -> None:
        self.handle, self.asked = handle, list[Asked]()
        self.release = threading.Event()
        """Set when the server closes: handlers that wait must wait on this."""
        self._changed = threading.Condition()
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_POST(self) -> None:
                body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
                asked = Asked(self.path, self.headers.get("Authorization", ""), body)
                outer.note(asked)
                try:
                    outer.handle(asked, self)
                except OSError:
                    self.close_connection = True

            def log_message(self, format: str, *args: object) -> None:
                """Keep quiet."""

        self._server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        self.url = f"http://127.0.0.1:{self._server.server_address[1]}/v1"
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.01,), daemon=True)
        self._thread.start()

    def note(self, asked: Asked) -> None:
        """Keep what was asked."""
        with self._changed:
            self.asked.append(asked)
            self._changed.notify_all()

    def wait_asked(self, count: int) -> None:
        """At least so many requests came. Raises AssertionError after ten seconds."""
        with self._changed:
            assert self._changed.wait_for(lambda: len(self.asked) >= count, 10.0)

    def close(self) -> None:
        """Let waiting handlers go, and end."""
        self.release.set()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join(5.0)


@contextmanager
def chat_server(handle: Handle) -> Iterator[ChatServer]:
    """A server on loopback until the block ends."""
    server = ChatServer(handle)
    try:
        yield server
    finally:
        server.close()


def send(handler: BaseHTTPRequestHandler, body: bytes, status: int = 200, **headers: str) -> None:
    """Send one response."""
    handler.send_response(status)
    for name, value in {"Content-Length": str(len(body)), **headers}.items():
        handler.send_header(name.replace("_", "-"), value)
    handler.end_headers()
    handler.wfile.write(body)


def completion(text: str | None, *, logprob: float | None = None, finish: str = "stop", **message: Any) -> bytes:
    """A chat completion; with `logprob`, each word is a token of that log-probability."""
    choice: dict[str, Any] = {
        "index": 0,
        "finish_reason": finish,
        "message": {"role": "assistant", "content": text, **message},
    }
    if logprob is not None and text:
        words = [word if number == 0 else f" {word}" for number, word in enumerate(text.split(" "))]
        choice["logprobs"] = {"content": [{"token": word, "logprob": logprob} for word in words]}
    return json.dumps({"id": "1", "object": "chat.completion", "choices": [choice]}).encode()


def says(text: str, logprob: float | None = None) -> Handle:
    """A server that always says the same."""
    return lambda asked, handler: send(handler, completion(text, logprob=logprob))

"""The page of the viewer as we serve it: Rerun's own files under a policy that lets the browser ask this machine alone.

Rerun's page loads a font, sends analytics, and asks for a new version and for examples, whatever its server's settings are.
"""

import re
import threading
import urllib.request
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from shutil import copyfileobj

FILES = {
    "/": "text/html; charset=utf-8",
    "/re_viewer.js": "text/javascript",
    "/re_viewer_bg.wasm": "application/wasm",
    "/favicon.svg": "image/svg+xml",
    "/favicon.ico": "image/x-icon",
}
"""What the page consists of; no other path is answered."""
_OUTSIDE = re.compile(rb"<link[^>]*https?://[^>]*>")
TIMEOUT_S = 10.0


def policy(source: str) -> str:
    """The content security policy of a page that reads from `source`, an address such as http://127.0.0.1:9876."""
    return (
        "default-src 'none'; script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval'; style-src 'self' 'unsafe-inline'; "
        f"img-src 'self' data: blob:; font-src 'self' data:; worker-src 'self' blob:; connect-src 'self' {source}"
    )


class Page:
    """Serves the page on a port of its own until it is closed. Raises OSError where the port is taken."""

    def __init__(self, bind: str, port: int, files: str, source: str) -> None:
        """`files`: the address of Rerun's own page, without a slash at its end; `source`: that of its data."""
        handler = type("Handler", (_Handler,), {"files": files, "policy": policy(source)})
        self._server = ThreadingHTTPServer((bind, port), handler)
        self._server.daemon_threads = True
        threading.Thread(target=self._server.serve_forever, name="view-page", daemon=True).start()

    def close(self) -> None:
        """Serve no more."""
        self._server.shutdown()
        self._server.server_close()


class _Handler(BaseHTTPRequestHandler):
    files = ""
    policy = ""
    timeout = TIMEOUT_S

    def do_GET(self) -> None:
        path = self.path.partition("?")[0]
        kind = FILES.get(path)
        if kind is None:
            self.send_error(HTTPStatus.NOT_FOUND)
            return
        try:
            with urllib.request.urlopen(self.files + path, timeout=TIMEOUT_S) as found:
                self._head(kind)
                if path == "/":
                    self.wfile.write(_OUTSIDE.sub(b"", found.read()))
                else:
                    copyfileobj(found, self.wfile)
        except OSError as error:
            self.log_error("%s", error)
            self.close_connection = True

    def _head(self, kind: str) -> None:
        """Without a length, which Rerun does not tell either: the connection's end is the content's."""
        self.send_response(HTTPStatus.OK)
        for name, value in (
            ("content-type", kind), ("content-security-policy", self.policy), ("referrer-policy", "no-referrer"),
            ("x-content-type-options", "nosniff"),
        ):  # fmt: skip
            self.send_header(name, value)
        self.end_headers()

    def log_message(self, format: str, *args: object) -> None:
        """Says nothing: standard output is the logger's."""

"""The viewer's page as we serve it: Rerun's files, and a policy that lets a browser ask this machine alone."""

import http.client
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import pytest

from services.logger.view.page import FILES, Page
from services.logger.view.server import Server, free_port
from services.logger.view.settings import ViewSettings
from tests.browser import chromium, needs_chromium

INDEX = (
    b'<html><link rel="preconnect" href="https://fonts.googleapis.com" /><link\n href="https://fonts.googleapis.com/css2?x"\n'
    b' rel="stylesheet"\n/><link rel="icon" href="favicon.ico" /><title>t</title></html>'
)


class Upstream(BaseHTTPRequestHandler):
    """Answers every path, as a server would that has more to show than the page needs."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.end_headers()
        self.wfile.write(INDEX if self.path == "/" else self.path.encode())

    def log_message(self, format: str, *args: object) -> None:
        """Says nothing."""


@pytest.fixture
def port() -> Iterator[int]:
    upstream = ThreadingHTTPServer(("127.0.0.1", 0), Upstream)
    thread = threading.Thread(target=upstream.serve_forever)
    thread.start()
    own = free_port("127.0.0.1")
    page = Page("127.0.0.1", own, f"http://127.0.0.1:{upstream.server_port}", "http://127.0.0.1:9")
    yield own
    page.close()
    upstream.shutdown()
    thread.join(5.0)
    upstream.server_close()


def ask(port: int, path: str) -> tuple[int, str, bytes]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=10.0)
    connection.request("GET", path)
    answer = connection.getresponse()
    found = answer.status, answer.headers.get("content-security-policy", ""), answer.read()
    connection.close()
    return found


def test_the_page_names_no_other_host_and_its_policy_allows_none(port: int) -> None:
    status, policy, body = ask(port, "/?url=x")
    assert status == 200
    assert b"https://" not in body
    assert b"favicon.ico" in body
    assert "connect-src 'self' http://127.0.0.1:9" in policy
    assert policy.startswith("default-src 'none'")
    assert "https:" not in policy


@pytest.mark.parametrize("path", ["/other", "/../re_viewer.js", "/re_viewer.js/x", "/%2e%2e/"])
def test_no_other_path_is_passed_on(port: int, path: str) -> None:
    assert ask(port, path)[0] == 404


@pytest.mark.parametrize("path", sorted(set(FILES) - {"/"}))
def test_a_file_of_the_page_comes_as_it_is(port: int, path: str) -> None:
    status, policy, body = ask(port, path)
    assert (status, body) == (200, path.encode())
    assert policy


@pytest.mark.stack
@needs_chromium
def test_a_browser_with_the_viewer_asks_this_machine_alone() -> None:
    with Server(ViewSettings(mode="web")) as server, chromium("--enable-unsafe-swiftshader") as browser:
        page = browser.new_page()
        asked: list[str] = []
        page.on("request", lambda request: asked.append(request.url))
        with page.expect_request(lambda request: "ReadMessages" in request.url, timeout=60_000):
            page.goto(server.page)
        page.wait_for_event("console", lambda said: "Content Security Policy" in said.text, timeout=60_000)
    outside = [url for url in asked if not url.startswith(("http://127.0.0.1:", "blob:", "data:"))]
    assert outside == []

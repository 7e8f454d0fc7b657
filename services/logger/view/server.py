"""The Rerun server as a process: it alone can be bound to loopback, which the SDK's serving functions cannot."""

import ctypes
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import TracebackType
from typing import Self
from urllib.parse import quote

import rerun_cli  # type: ignore[import-untyped]

from services.logger.view.page import Page
from services.logger.view.settings import ViewSettings

READY_S = 15.0
_PR_SET_PDEATHSIG = 1


class ServerFailed(RuntimeError):
    """The viewer's server did not come up."""


class Server:
    """Serves the web viewer and takes the drawing; ends with its `with` block, and with this process."""

    def __init__(self, settings: ViewSettings) -> None:
        self._bind = settings.bind
        self._port = settings.port or free_port(settings.bind)
        self._web_port = settings.web_port or free_port(settings.bind)
        self._own_port = free_port(settings.bind)
        """Of Rerun's own page, which is not told."""
        self._page: Page | None = None
        self._memory_mb = settings.memory_mb
        self._scratch = tempfile.TemporaryDirectory(prefix="drivemcp-view-")
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def sink(self) -> str:
        """Where the SDK sends."""
        return f"rerun+http://{self._host}:{self._port}/proxy"

    @property
    def page(self) -> str:
        """What a browser opens."""
        return f"http://{self._host}:{self._web_port}/?url={quote(self.sink, safe='')}"

    @property
    def _host(self) -> str:
        return "127.0.0.1" if self._bind in ("0.0.0.0", "::", "") else self._bind

    def __enter__(self) -> Self:
        for port in (self._port, self._web_port, self._own_port):
            require_free(self._bind, port)
        own, source = (f"http://{self._host}:{port}" for port in (self._own_port, self._port))
        self._page = Page(self._bind, self._web_port, own, source)
        binary = str(Path(rerun_cli.__file__).parent / "rerun")
        # settings of its own: analytics are off here, and the user's are left alone
        environment = {**os.environ, "XDG_CONFIG_HOME": self._scratch.name}
        subprocess.run(
            [binary, "analytics", "disable"], env=environment, capture_output=True, timeout=READY_S, check=True
        )
        self._process = subprocess.Popen(
            [
                binary, "--serve-web", "--bind", self._bind, "--port", str(self._port),
                "--web-viewer-port", str(self._own_port), "--server-memory-limit", f"{self._memory_mb}MB", "--newest-first",
            ],
            env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
            preexec_fn=_die_with_parent if sys.platform == "linux" else None,
        )  # fmt: skip
        self._wait_ready(self._process)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._page is not None:
            self._page.close()
        if self._process is not None:
            self._process.terminate()
            try:
                self._process.wait(3.0)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait(3.0)
            if self._process.stderr is not None:
                self._process.stderr.close()
        self._scratch.cleanup()

    def _wait_ready(self, process: "subprocess.Popen[bytes]") -> None:
        deadline_s = time.monotonic() + READY_S
        for port in (self._port, self._own_port):
            while not _accepts(self._host, port):
                if process.poll() is not None or time.monotonic() > deadline_s:
                    process.kill()
                    said = process.communicate(timeout=3.0)[1].decode(errors="replace").strip().splitlines()
                    raise ServerFailed(f"the viewer does not listen on {self._host}:{port}: {said[-1:] or 'no answer'}")
                time.sleep(0.05)


def free_port(bind: str) -> int:
    """A port that was free just now."""
    with _probe(bind) as probe:
        probe.bind((bind, 0))
        return int(probe.getsockname()[1])


def require_free(bind: str, port: int) -> None:
    """Raises ServerFailed where the port is taken: a program that listens there already would be taken for the viewer."""
    with _probe(bind) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as the viewer binds: old connections do not count
        try:
            probe.bind((bind, port))
        except OSError as error:
            raise ServerFailed(f"port {port} of {bind} cannot be used: {error.strerror}") from None


def _probe(bind: str) -> socket.socket:
    return socket.socket(socket.AF_INET6 if ":" in bind else socket.AF_INET, socket.SOCK_STREAM)


def _accepts(host: str, port: int) -> bool:
    try:
        with socket.create_connection((host, port), timeout=0.5):
            return True
    except OSError:
        return False


def _die_with_parent() -> None:
    """In the child, before exec: the kernel ends it when its parent is gone, whatever ended that."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM)

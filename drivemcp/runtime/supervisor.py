"""Looks after the processes of one stack: router and services, ready in order, restarted with back-off, ended together."""

import os
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import Any, Self

import msgspec

from drivemcp.errors import DriveMcpError
from drivemcp.runtime.parent import PARENT

STOP_GRACE_S = 6.0
_BACKOFF_S = (0.05, 0.2, 0.5, 1.0, 2.0)
CALM_S = 20.0
"""A process that ran for so long is restarted with the shortest wait again."""
_ENVIRONMENT = {
    "LP_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "SDL_VIDEODRIVER": "dummy",
    "PYTHONUNBUFFERED": "1",
    "PYGAME_HIDE_SUPPORT_PROMPT": "1",
}


class StackFailed(DriveMcpError, RuntimeError):
    """A process of the stack does not start; the message ends with the end of its log."""


def free_port(host: str = "127.0.0.1") -> int:
    """A TCP port that is free now."""
    with socket.socket() as probe:
        probe.bind((host, 0))
        port: int = probe.getsockname()[1]
        return port


class Child:
    """One process that should be running."""

    def __init__(self, name: str, command: Sequence[str], log: Path, calm_s: float) -> None:
        self.name = name
        self.restarts = 0
        """How often it was started again."""
        self.in_a_row = 0
        """How often without having run calmly in between."""
        self._command = list(command)
        self._log = log
        self._calm_s = calm_s
        self._environment = {**os.environ, **_ENVIRONMENT, PARENT: str(os.getpid())}
        self._process: subprocess.Popen[bytes] | None = None
        self._started_s = 0.0
        self._due_s: float | None = None

    @property
    def pid(self) -> int | None:
        """The process id while it runs."""
        return self._process.pid if self._process is not None and self._process.poll() is None else None

    def start(self) -> None:
        """Start the process, appending to its log."""
        self._log.parent.mkdir(parents=True, exist_ok=True)
        with self._log.open("ab") as sink:
            self._process = subprocess.Popen(
                self._command, stdin=subprocess.DEVNULL, stdout=sink, stderr=sink, env=self._environment,
                start_new_session=True,
            )  # fmt: skip
        self._started_s = time.monotonic()

    def look_after(self, say: Callable[[str], None]) -> None:
        """Restart the process if it has ended, later each time."""
        if self._process is None or self._process.poll() is None:
            return
        now_s = time.monotonic()
        if self._due_s is None:
            if now_s - self._started_s > self._calm_s:
                self.in_a_row = 0
            wait_s = _BACKOFF_S[min(self.in_a_row, len(_BACKOFF_S) - 1)]
            say(f"{self.name} ended with {self._process.returncode}; starting it again in {wait_s} s")
            self._due_s = now_s + wait_s
        elif now_s >= self._due_s:
            self._due_s = None
            self.restarts += 1
            self.in_a_row += 1
            self.start()

    def failed(self) -> bool:
        """Whether it has ended by itself."""
        return self._process is not None and self._process.poll() is not None

    def terminate(self) -> None:
        """Ask it to end."""
        if self.pid is not None and self._process is not None:
            self._process.terminate()

    def end(self, timeout_s: float) -> None:
        """Wait for it to end; kill it when it does not."""
        if self._process is None:
            return
        try:
            self._process.wait(max(0.05, timeout_s))
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait(2.0)

    def log_tail(self, lines: int = 12) -> str:
        """The end of its log."""
        try:
            return "\n".join(self._log.read_text(errors="replace").splitlines()[-lines:])
        except OSError:
            return "(no log)"


class Supervisor:
    """The processes of one stack under one folder: `config/`, `log/`, and what the services write."""

    def __init__(
        self,
        folder: Path,
        say: Callable[[str], None] = lambda _: None,
        interrupted: threading.Event | None = None,
        calm_s: float = CALM_S,
    ) -> None:
        self.folder = folder
        self._say = say
        self._calm_s = calm_s
        self._interrupted = interrupted or threading.Event()
        self._children: dict[str, Child] = {}
        self._lock = threading.Lock()
        self._stopping = threading.Event()
        self._jobs: SimpleQueue[Callable[[], None]] = SimpleQueue()
        self._idle, self._over = threading.Event(), threading.Event()
        self._watcher = threading.Thread(target=self._watch, name="supervisor", daemon=True)
        self._watcher.start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def run(self, name: str, module: str, arguments: Sequence[str]) -> Child:
        """Start `python -m module arguments` and keep it running."""
        command = [sys.executable, "-m", module, *arguments]
        child = Child(name, command, self.folder / "log" / f"{name}.log", self._calm_s)
        self._start(child)
        with self._lock:
            self._children[name] = child
        return child

    def _start(self, child: Child) -> None:
        """On the watcher's thread: for the kernel the parent of a process is the thread that started it."""
        done, problem = threading.Event(), list[Exception]()

        def start() -> None:
            try:
                child.start()
            except Exception as error:  # noqa: BLE001 it is the caller's
                problem.append(error)
            finally:
                done.set()

        self._jobs.put(start)
        while not done.wait(0.2):
            if self._idle.is_set():
                raise KeyboardInterrupt
        if problem:
            raise problem[0]

    def run_service(self, name: str, module: str, config: Mapping[str, Any], before: Sequence[str] = ()) -> Child:
        """Write the service's configuration and start it; `before`: what a module that hosts services is told first."""
        path = self.folder / "config" / f"{name}.json"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(msgspec.json.format(msgspec.json.encode(config)))
        return self.run(name, module, [*before, "--config", str(path)])

    def child(self, name: str) -> Child:
        """One of the processes."""
        with self._lock:
            return self._children[name]

    @property
    def children(self) -> tuple[Child, ...]:
        """All processes, in the order in which they were started."""
        with self._lock:
            return tuple(self._children.values())

    def wait_until(self, ready: Callable[[], bool], what: str, timeout_s: float) -> None:
        """Wait for a condition.

        Raises StackFailed when a process keeps ending, or the time is over; KeyboardInterrupt when it was interrupted.
        """
        deadline_s = time.monotonic() + timeout_s
        while not ready():
            broken = next((child for child in self.children if child.in_a_row >= 2 and child.failed()), None)
            if broken is not None or time.monotonic() > deadline_s:
                raise StackFailed(f"{what} did not come up\n{(broken or self.children[-1]).log_tail()}")
            if self._stopping.wait(0.02) or self._interrupted.is_set():
                raise KeyboardInterrupt

    def stop(self, last: Sequence[str] = ("router",)) -> None:
        """End all together, then those named `last`, one after the other; nothing is left running."""
        if self._stopping.is_set():
            return
        self._stopping.set()
        self._idle.wait(2.0)
        together = [child for child in self.children if child.name not in last]
        _end(together)
        for name in last:
            _end([child for child in self.children if child.name == name])
        self._over.set()
        self._watcher.join(2.0)

    def _watch(self) -> None:
        while not self._stopping.is_set():
            with suppress(Empty):
                self._jobs.get(timeout=0.02)()
            for child in self.children:
                child.look_after(self._say)
        self._idle.set()
        self._over.wait()  # with this thread its processes would end, all at once


def _end(children: Sequence[Child]) -> None:
    for child in children:
        child.terminate()
    deadline_s = time.monotonic() + STOP_GRACE_S
    for child in children:
        child.end(deadline_s - time.monotonic())

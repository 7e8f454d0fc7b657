"""A drive as a user starts it, in surroundings that a test chooses, with a watcher beside it."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from drivemcp.bus.session import wait_settled
from drivemcp.client import RunningStack
from tests.stack.chaos.watcher import Seen
from tests.stack.marked import marked

ROOT = Path(__file__).parents[3]
STARTS_S = 180.0
ENDS_S = 60.0


class Ended(msgspec.Struct, frozen=True, kw_only=True):
    """How a drive ended."""

    status: int
    summary: dict[str, Any]
    said: str
    folder: Path
    took_s: float

    @property
    def logs(self) -> list[Path]:
        """Its log, file by file."""
        return sorted((self.folder / "logs").glob("*.mcap"))


class Drive:
    """One that is under way."""

    def __init__(
        self,
        folder: Path,
        before: Sequence[str],
        around: Sequence[str],
        environment: dict[str, str],
        arguments: Sequence[str],
    ) -> None:
        self.folder, self._watched = folder, folder / "watched.jsonl"
        self._environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder)}
        command = [
            *before,
            sys.executable,
            "-m",
            "drivemcp.cli",
            "up",
            "--headless",
            "--json",
            "--out",
            str(folder / "out"),
            *arguments,
        ]
        self.begun_s = time.monotonic()
        self._said = (folder / "said.txt").open("w+")
        self.up = subprocess.Popen(
            command, cwd=ROOT, env={**self._environment, **environment}, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=self._said, text=True,
        )  # fmt: skip
        self._around = list(around)
        self._watcher: subprocess.Popen[bytes] | None = None

    def watch(self) -> None:
        """Begin to watch once the stack has noted itself."""
        note = self.folder / f"drivemcp-{os.getuid()}" / "stack.json"
        assert wait_settled(lambda: note.exists() or self.up.poll() is not None, STARTS_S), self.said()
        assert self.up.poll() is None, self.said()
        command = [*self._around, sys.executable, "-m", "tests.stack.chaos.watcher", str(self._watched)]
        self._watcher = subprocess.Popen(command, cwd=ROOT, env=self._environment)

    def stack(self) -> RunningStack:
        """What it has noted of itself."""
        note = self.folder / f"drivemcp-{os.getuid()}" / "stack.json"
        return msgspec.json.decode(note.read_bytes(), type=RunningStack)

    def seen(self) -> list[Seen]:
        """All advisories so far."""
        lines = self._watched.read_bytes().splitlines() if self._watched.exists() else []
        return [msgspec.json.decode(line, type=Seen) for line in lines if line.endswith(b"}")]

    def wait_seen(self, count: int, timeout_s: float) -> bool:
        """Until so many more have come."""
        wanted = len(self.seen()) + count
        deadline_s = time.monotonic() + timeout_s
        while len(self.seen()) < wanted:
            if time.monotonic() > deadline_s or self.up.poll() is not None:
                return False
            pause(0.2)
        return True

    def pids(self) -> dict[int, str]:
        """The processes of this drive, and their command lines."""
        return marked(self.folder)

    def pid(self, name: str) -> int | None:
        """The process of one service."""
        module = "drivemcp.bus.router" if name == "router" else f"services.{name} "
        return next((pid for pid, line in self.pids().items() if f"-m {module}" in line), None)

    def said(self) -> str:
        """What it has told so far."""
        self._said.flush()
        return Path(self._said.name).read_text(errors="replace")[-6000:]

    def end(self) -> Ended:
        """End it as Ctrl-C does, or wait for its end."""
        if self.up.poll() is None:
            self.up.send_signal(signal.SIGINT)
        asked_s = time.monotonic()
        told, _ = self.up.communicate(timeout=ENDS_S)
        lines = told.strip().splitlines()
        folders = [one for one in (self.folder / "out").glob("*") if one.is_dir()]
        return Ended(
            status=self.up.returncode, summary=json.loads(lines[-1]) if lines else {}, said=self.said(),
            folder=folders[0] if folders else self.folder, took_s=time.monotonic() - asked_s,
        )  # fmt: skip

    def close(self) -> None:
        """Leave nothing behind."""
        if self._watcher is not None:
            self._watcher.kill()
            self._watcher.wait(10.0)
        if self.up.poll() is None:
            self.up.kill()
        for pid in self.pids():
            os.kill(pid, signal.SIGKILL)
        self.up.wait(20.0)
        self._said.close()


def pause(seconds: float) -> None:
    """Let time pass: a disturbance lasts."""
    threading.Event().wait(seconds)


@contextmanager
def driving(
    folder: Path,
    *arguments: str,
    before: Sequence[str] = (),
    around: Sequence[str] = (),
    environment: dict[str, str] | None = None,
) -> Iterator[Drive]:
    """A drive that has come to its stride. `before`: what its command is run by; `around`: the same for the watcher."""
    folder.mkdir(parents=True, exist_ok=True)
    drive = Drive(folder, before, around, environment or {}, arguments)
    try:
        drive.watch()
        assert drive.wait_seen(30, STARTS_S), drive.said()
        yield drive
    finally:
        drive.close()

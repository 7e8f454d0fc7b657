"""The one folder whose logs may be read, and how much of a log is read."""

import gzip
import os
import time
import zlib
from collections.abc import Iterator
from pathlib import Path

import can
import msgspec

from drivemcp.errors import UserError
from drivemcp.files.can_logs.log import CHANNELS_LOOK, ENDINGS, CanLog, check_log
from drivemcp.files.can_logs.text import suffix_of

LISTED_LIMIT, DEPTH = 200, 2
LARGEST_BYTES = 256_000_000
"""Of a packed log: unpacked."""
FRAMES_LIMIT, TIME_LIMIT_S = 2_000_000, 20.0
CHUNK = 1 << 20
EVERY = CHANNELS_LOOK // 100
"""After so many frames a look at the clock."""


class LogFile(msgspec.Struct, frozen=True, kw_only=True):
    """A log: its path inside the folder, as the other tools take it."""

    path: str
    size_bytes: int


class LogFolder:
    """Logs below one folder. Nothing outside is read, by whatever path or link."""

    def __init__(self, folder: str) -> None:
        self._folder = Path(folder).resolve() if folder else None

    @property
    def name(self) -> str:
        """Where it is; empty: no folder is configured."""
        return "" if self._folder is None else str(self._folder)

    def files(self) -> tuple[list[LogFile], bool]:
        """The logs in it and in its folders, by name, and whether there are more."""
        found: list[LogFile] = []
        for root, folders, names in os.walk(self._open()):
            deep = len(Path(root).relative_to(self._open()).parts) + 1 >= DEPTH
            folders[:] = [] if deep else sorted(each for each in folders if not each.startswith("."))
            for name in sorted(names):
                path = Path(root, name)
                if suffix_of(path) in ENDINGS and path.is_file() and not path.is_symlink():
                    if len(found) == LISTED_LIMIT:
                        return found, True
                    relative = path.relative_to(self._open()).as_posix()
                    found.append(LogFile(path=relative, size_bytes=path.stat().st_size))
        return found, False

    def find(self, path: str) -> Path:
        """The log that a caller names. Raises UserError for what is no log, lies elsewhere or is too large."""
        shown, base = repr(path[:80]), self._open()
        try:
            found = (base / path).resolve()
            inside = found.is_relative_to(base) and found.is_file()
        except (OSError, ValueError, RuntimeError):
            inside = False
        if not inside:
            raise UserError(f"path: {shown} is no file in the folder of logs; list_can_logs names those there are")
        check_log(found, "path")
        if _size(found) > LARGEST_BYTES:
            raise UserError(f"path: {shown} holds more than {LARGEST_BYTES // 1_000_000} MB; cut it into parts")
        return found

    def _open(self) -> Path:
        if self._folder is None:
            raise UserError("no folder of logs is configured: set log_folder in the CAN service's configuration")
        if not self._folder.is_dir():
            raise UserError("log_folder in the CAN service's configuration is no folder; make it or name another")
        return self._folder


class Reading:
    """The frames of a log as (s after the first, channel, message), as far as frames and time are allowed."""

    def __init__(self, path: Path) -> None:
        self.log = CanLog(path)
        self.frames = 0
        self.truncated = False

    def __iter__(self) -> Iterator[tuple[float, str, can.Message]]:
        ends = time.monotonic() + TIME_LIMIT_S
        for each in self.log.messages():
            self.frames += 1
            yield each
            if self.frames >= FRAMES_LIMIT or (self.frames % EVERY == 0 and time.monotonic() > ends):
                self.truncated = True
                return

    @property
    def remark(self) -> str:
        """What could not be read, in one line; empty where all was."""
        stopped = (
            f"read up to frame {self.frames}, the rest is left out; cut the log into parts" if self.truncated else ""
        )
        return "; ".join(filter(None, (stopped, self.log.summary)))


def _size(path: Path) -> int:
    """Bytes of a log, of a packed one unpacked, counted as far as they matter."""
    if path.suffix.lower() != ".gz":
        return path.stat().st_size
    size = 0
    try:
        with gzip.open(path, "rb") as file:
            while size <= LARGEST_BYTES and (part := file.read(CHUNK)):
                size += len(part)
    except (OSError, EOFError, zlib.error):
        pass  # the reader tells what is damaged
    return size

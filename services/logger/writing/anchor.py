"""Heads kept elsewhere: signed lines appended to a file that the drive's folder does not hold.

A file that only grows, on another disk or another machine, shows a tail that was cut and a whole log that was taken away.
It does so even where a person with write access to all of the log's folder has put that in order again.
"""

import os
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import msgspec

from proto.health import ChainHead
from services.logger.format import chain
from services.logger.format.signing import Signer, signature_holds


class Line(msgspec.Struct, frozen=True, kw_only=True):
    """One line: a head as the log signed it or, with `retired`, that retention deletes the file."""

    time: str
    file: str
    signature: str
    key_id: str
    head: str = ""
    n: int = 0
    messages: int = 0
    closed: bool = False
    retired: bool = False


def retired_text(file: str) -> bytes:
    """The bytes that are signed when retention deletes a file."""
    return f"{chain.FORMAT} retired {file}".encode()


class Anchor:
    """Appends: the first and the last head of each file, between them one every `every_s`. A disk that refuses costs lines, not the log."""

    def __init__(self, path: Path, signer: Signer, *, every_s: float, failed: Callable[[str], None]) -> None:
        self._path, self._signer, self._every_s, self._failed = path, signer, every_s, failed
        self._lock = threading.Lock()
        self._written_s: float | None = None

    def sealed(self, head: ChainHead, n: int) -> None:
        """A flush is in the file."""
        now_s = time.monotonic()
        due = self._written_s is None or now_s - self._written_s >= self._every_s
        if not (due or n == 0 or head.closed):
            return
        self._written_s = now_s
        self._append(
            Line(
                time=_now(),
                file=head.file,
                signature=head.signature,
                key_id=head.key_id,
                head=head.head_sha256,
                n=n,
                messages=head.records,
                closed=head.closed,
            )
        )

    def retired(self, file: str) -> None:
        """Retention is about to delete a file."""
        signature = self._signer.sign(retired_text(file))
        self._append(Line(time=_now(), file=file, signature=signature, key_id=self._signer.key_id, retired=True))

    def _append(self, line: Line) -> None:
        data = msgspec.json.encode(line) + b"\n"
        try:
            with self._lock:
                descriptor = os.open(self._path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_CLOEXEC, 0o640)
                try:
                    if os.write(descriptor, data) != len(data):
                        raise OSError("the disk is full")
                    os.fdatasync(descriptor)
                finally:
                    os.close(descriptor)
        except OSError as error:
            self._failed(f"heads are not anchored in {self._path}: {error.strerror or error}")


class Anchored(msgspec.Struct, frozen=True, kw_only=True):
    """What an anchor file says."""

    heads: dict[str, frozenset[str]]
    """By file."""
    retirements: tuple[Line, ...]

    def is_retired(self, file: str, public_keys: Sequence[str]) -> bool:
        """Whether one of these keys signed that retention deleted it."""
        return any(
            line.file == file and signature_holds(key, retired_text(file), line.signature)
            for line in self.retirements
            for key in public_keys
        )


def read(path: Path) -> Anchored:
    """An anchor file. A last line that was cut is left out. Raises OSError, and ValueError for what is no anchor file."""
    heads, retirements = dict[str, set[str]](), list[Line]()
    for text in path.read_bytes().split(b"\n")[:-1]:
        if not text.startswith(b"{"):
            raise ValueError("a line of it is no JSON object")
        try:
            line = msgspec.json.decode(text, type=Line)
        except msgspec.DecodeError:
            continue  # cut by a disk that was full; the next line began behind it
        if line.retired:
            retirements.append(line)
        else:
            heads.setdefault(line.file, set()).add(line.head)
    return Anchored(heads={file: frozenset(found) for file, found in heads.items()}, retirements=tuple(retirements))


def _now() -> str:
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())

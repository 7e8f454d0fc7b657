"""Recorded CAN logs by python-can: every readable record in order, and by file and record what could not be read."""

import contextlib
import gzip
import itertools
import math
import struct
import zlib
from collections import Counter, deque
from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import IO, Any, NamedTuple

import can
from can.util import dlc2len

from drivemcp.errors import ConfigError
from proto.sensors import CanFrame
from services.can.buses.link import from_message

TEXT: dict[str, Any] = {
    ".asc": can.ASCReader, ".csv": can.CSVReader, ".log": can.CanutilsLogReader, ".trc": can.TRCReader,
}  # fmt: skip
BINARY: dict[str, Any] = {".blf": can.BLFReader, ".mf4": can.MF4Reader}
BROKEN: tuple[type[Exception], ...] = (
    ValueError, TypeError, KeyError, IndexError, OSError, EOFError, NotImplementedError, RuntimeError,
    struct.error, zlib.error, can.CanError, can.io.blf.BLFParseError,
)  # fmt: skip
"""What python-can's readers raise on bytes that are no log."""
NOTES_LIMIT = 20
GAP_S, LOOK_AHEAD = 3600.0, 16
"""A jump of the time by more than this is held against so many records that follow."""
FD_LENGTHS = frozenset(dlc2len(code) for code in range(16))


class Record(NamedTuple):
    """A frame and when it came, s after the log's first; its stamp is the replayer's to give."""

    at_s: float
    frame: CanFrame


class RecordedLog:
    """One log file. Iterating reads it from its start; what went wrong is in `notes`, and counted over all readings."""

    def __init__(self, path: Path, channel: str = "") -> None:
        self.path, self.channel = path, channel
        self.read = self.malformed = self.passed_over = 0
        self.left_out: Counter[str] = Counter()
        """Frames of other channels than the one that is replayed."""
        self.notes: list[str] = []

    def __iter__(self) -> Iterator[Record]:
        self.read = 0
        first_s: float | None = None
        last_s = 0.0
        for message in self._in_time():
            first_s = message.timestamp if first_s is None else first_s
            last_s = max(last_s, message.timestamp - first_s)  # the order counts where stamps fall back
            if self._wanted(message):
                yield Record(last_s, from_message(message, 0))

    def _in_time(self) -> Iterator[can.Message]:
        """The readable records but those whose time jumps ahead and is taken back by a record soon after."""
        sound = self._sound()
        window = deque(itertools.islice(sound, LOOK_AHEAD))
        newest_s: float | None = None
        while window:
            number, message = window.popleft()
            window.extend(itertools.islice(sound, 1))
            jumps = newest_s is None or message.timestamp > newest_s + GAP_S
            if jumps and any(later.timestamp < message.timestamp - GAP_S for _, later in window):
                self.note("its time lies hours after that of what follows", f"record {number}")
                continue
            newest_s = message.timestamp if newest_s is None else max(newest_s, message.timestamp)
            yield message

    def _sound(self) -> Iterator[tuple[int, can.Message]]:
        """The readable records, numbered."""
        for message in self._messages():
            self.read += 1
            if complaint := _complaint(message):
                self.note(complaint)
            else:
                yield self.read, message

    def note(self, complaint: str, place: str = "") -> None:
        """Remember what could not be read, and where."""
        self.malformed += 1
        text = f"{self.path.name}: {place or f'record {self.read}'}: {complaint}"
        if len(self.notes) < NOTES_LIMIT and text not in self.notes:
            self.notes.append(text)

    @property
    def summary(self) -> str:
        """What was not replayed, in words; empty where nothing was left out."""
        others = ", ".join(f"{count} frames of channel {name}" for name, count in sorted(self.left_out.items()))
        parts = [
            f"{self.malformed} malformed, first {self.notes[0]}" if self.notes else "",
            f"{self.passed_over} lines that are no frames" if self.passed_over else "",
            f"left out {others}; this is channel {self.channel}" if others else "",
        ]
        return "; ".join(filter(None, parts))

    def _wanted(self, message: can.Message) -> bool:
        """Of a log with several channels one is replayed: the one named, or that of the first frame."""
        channel = "" if message.channel is None else str(message.channel)
        self.channel = self.channel or channel
        if channel == self.channel:
            return True
        self.left_out[channel] += 1
        return False

    def _messages(self) -> Iterator[can.Message]:
        suffix = _suffix(self.path)
        return self._text(TEXT[suffix]) if suffix in TEXT else self._binary(BINARY[suffix])

    def _text(self, kind: Any) -> Iterator[can.Message]:
        """Line by line: a malformed line costs itself alone."""
        with _open(self.path) as file:
            lines = _Lines(file)
            reader = kind(lines)
            stream = iter(reader)
            bad = 0
            while not lines.ended:
                seen = lines.count
                try:
                    message = next(stream)
                except BROKEN as error:
                    if bad == lines.number:
                        self.note("the header does not tell how to read what follows", f"after line {bad}")
                        break
                    self.read += 1
                    bad = lines.number
                    self.note(_words(error), f"line {bad}")
                    stream = iter(_resumed(reader, lines))
                    continue
                except StopIteration:
                    self.passed_over += (lines.count - seen) if self.read else 0
                    break
                self.passed_over += (lines.count - seen - 1) if self.read else 0
                yield message
            if lines.complaint and bad != lines.number:
                self.note(lines.complaint, f"line {lines.number}")

    def _binary(self, kind: Any) -> Iterator[can.Message]:
        """Up to the first malformed record: where the next one begins nobody knows."""
        with contextlib.ExitStack() as stack:
            try:
                reader = kind(stack.enter_context(self.path.open("rb")))
                stack.callback(reader.stop)
                yield from reader
            except _broken(self.path) as error:
                self.note(f"{_words(error)}; nothing after it can be read", f"after record {self.read}")
            else:
                if complaint := _cut(reader, self.path):
                    self.note(complaint, f"after record {self.read}")


def check_log(path: Path, field: str) -> None:
    """That there is such a log, of a kind that can be read here. Raises ConfigError naming the setting."""
    suffix = _suffix(path)
    if suffix not in TEXT | BINARY:
        raise ConfigError(f"{field}: {path.name} is none of {', '.join(sorted(TEXT | BINARY))}")
    if not path.is_file():
        raise ConfigError(f"{field}: there is no file {path}")
    if suffix == ".mf4" and find_spec("asammdf") is None:
        raise ConfigError(f"{field}: {path.name} takes the package asammdf: pip install asammdf")


class _Lines:
    """A text file by lines, counted; what python-can's text readers read from."""

    def __init__(self, file: IO[str]) -> None:
        self._file = file
        self._put_back: list[str] = []
        self.number = self.count = 0
        self.ended = False
        self.complaint = ""

    def __iter__(self) -> Iterator[str]:
        return self

    def __next__(self) -> str:
        if self._put_back:
            return self._put_back.pop()
        try:
            line = self._file.readline()
        except (OSError, EOFError, zlib.error) as error:
            line, self.complaint = "", f"the file breaks off: {_words(error)}"
        if not line:
            self.ended = True
            raise StopIteration
        self.number += 1
        self.count += bool(line.strip())
        if not line.endswith("\n"):
            self.complaint = "the last line does not end; it may be cut"
        return line

    def put_back(self, line: str) -> None:
        """Give this line next."""
        self._put_back.append(line)

    def read(self, size: int = -1) -> str:
        """The rest."""
        return self._file.read(size)

    def close(self) -> None:
        """The file is closed by who opened it."""


def _resumed(reader: Any, lines: _Lines) -> Any:
    """The reader behind a malformed line. Readers look for a header when they start: they are shown an empty line."""
    lines.put_back("\n")
    return reader


def _open(path: Path) -> IO[str]:
    opener: Any = gzip.open if path.suffix.lower() == ".gz" else open
    file: IO[str] = opener(path, "rt", encoding="utf-8", errors="replace")
    return file


def _suffix(path: Path) -> str:
    suffixes = [suffix.lower() for suffix in path.suffixes[-2:]]
    packed = len(suffixes) == 2 and suffixes[1] == ".gz" and suffixes[0] in TEXT
    return suffixes[0] if packed else path.suffix.lower()


def _complaint(message: can.Message) -> str:
    """What is wrong with a record; empty where nothing is."""
    length = len(message.data)
    if not math.isfinite(message.timestamp):
        return "its time is no number"
    if not 0 <= message.arbitration_id < 1 << (29 if message.is_extended_id else 11) and not message.is_error_frame:
        return f"0x{message.arbitration_id:X} is no id"
    if message.is_remote_frame:
        return ""
    if length not in (FD_LENGTHS if message.is_fd else range(9)):
        return f"{length} bytes in a frame"
    if length != message.dlc and not (message.is_fd and length == dlc2len(min(message.dlc, 15))):
        return f"{length} bytes where it says {message.dlc}"
    return ""


def _broken(path: Path) -> tuple[type[Exception], ...]:
    """What reading this file raises; asammdf, which is loaded only where it reads, has an error of its own."""
    if path.suffix.lower() != ".mf4":
        return BROKEN
    return (*BROKEN, import_module("asammdf.blocks.utils").MdfException)


def _cut(reader: Any, path: Path) -> str:
    """Whether a BLF lacks its end: python-can reads what there is and is silent about the rest."""
    wanted, size = getattr(reader, "file_size", None), path.stat().st_size
    if wanted is None or wanted == size:
        return ""
    return (
        f"cut: {size} of {wanted} bytes" if wanted > size else "not closed when it was written; its end may be missing"
    )


def _words(error: Exception) -> str:
    return " ".join(str(error).split())[:200] or type(error).__name__

"""One log: every readable record in order, and by file and line or record what could not be read."""

import contextlib
import itertools
import math
import struct
import zlib
from collections import Counter
from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import can
from can.util import dlc2len

from drivemcp.errors import UserError
from drivemcp.files.can_logs.forms import form_of
from drivemcp.files.can_logs.stamps import in_time
from drivemcp.files.can_logs.text import FORMS, Lines, excerpt, foreign, open_text, suffix_of
from proto.sensors import CanFrame

BINARY: dict[str, Any] = {".blf": can.BLFReader, ".mf4": can.MF4Reader}
ENDINGS = tuple(sorted((*FORMS, *BINARY)))
BROKEN: tuple[type[Exception], ...] = (
    ValueError, TypeError, KeyError, IndexError, OSError, EOFError, NotImplementedError, RuntimeError, OverflowError,
    struct.error, zlib.error, can.CanError, can.io.blf.BLFParseError,
)  # fmt: skip
"""What python-can's readers raise on bytes that are no log."""
NOTES_LIMIT = 20
CHANNELS_LOOK = 50_000
"""Records that are looked at for how many buses a log holds."""
FD_LENGTHS = frozenset(dlc2len(code) for code in range(16))


class Record(NamedTuple):
    """A frame and when it came, s after the log's first; its stamp is the replayer's to give."""

    at_s: float
    frame: CanFrame


class CanLog:
    """One log file. Iterating reads it from its start; what went wrong is in `notes`, and counted over all readings."""

    def __init__(self, path: Path, channel: str = "") -> None:
        self.path, self.channel = path, channel
        self.read = self.malformed = 0
        self.left_out: Counter[str] = Counter()
        """Frames of other channels than the one that is replayed."""
        self.unread: Counter[str] = Counter()
        """Lines that are no frames, by what is said of the first of each kind."""
        self._first_unread: dict[str, str] = {}
        self.notes: list[str] = []
        self.remarks: list[str] = []
        """What was assumed or made of the stamps."""

    def __iter__(self) -> Iterator[Record]:
        for at_s, channel, message in self.messages():
            if self._wanted(channel):
                yield Record(at_s, frame_of(message, 0))

    def _sound(self) -> Iterator[tuple[int, can.Message]]:
        """The readable records, numbered."""
        self.read = 0
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

    def _refuse(self, number: int, complaint: str) -> None:
        self.note(complaint, f"record {number}")

    def _remark(self, number: int, words: str) -> None:
        text = f"record {number}: {words}" if number else words
        if len(self.remarks) < NOTES_LIMIT and text not in self.remarks:
            self.remarks.append(text)

    def messages(self) -> Iterator[tuple[float, str, can.Message]]:
        """(time, channel, record) in the order of the log; the channel is empty where a record names none."""
        for at_s, message in in_time(self._sound(), self._remark, self._refuse):
            yield at_s, "" if message.channel is None else str(message.channel), message

    def channels(self) -> Counter[str]:
        """Frames by channel, in the first 50,000 records; those that name none are of any channel."""
        return Counter(channel for _, channel, _ in itertools.islice(self.messages(), CHANNELS_LOOK) if channel)

    @property
    def summary(self) -> str:
        """What was not replayed and what was made of the times, in words; empty where there is nothing to say."""
        others = ", ".join(f"{count} frames of channel {name}" for name, count in sorted(self.left_out.items()))
        parts = [
            f"{self.malformed} malformed, first {self.notes[0]}" if self.notes else "",
            *(f"{count} lines not read, {self._first_unread[kind]}" for kind, count in self.unread.items()),
            f"left out {others}; this is channel {self.channel}" if others else "",
            *self.remarks[:3],
        ]
        return "; ".join(filter(None, parts))

    @property
    def nothing(self) -> str:
        """Why there is no frame to replay, once the log was read to its end."""
        bare = (
            "it holds no CAN frames; of decoded signals none is made"
            if suffix_of(self.path) == ".mf4"
            else "it has nothing but a header"
        )
        empty = bare if self.path.stat().st_size else "it is empty"
        return "; ".join(filter(None, (foreign(self.path), self.summary))) or empty

    def _wanted(self, channel: str) -> bool:
        """Of a log with several channels one is replayed: the one named, or that of the first frame."""
        self.channel = self.channel or channel
        if channel in ("", self.channel):
            return True
        self.left_out[channel] += 1
        return False

    def _messages(self) -> Iterator[can.Message]:
        suffix = suffix_of(self.path)
        return self._binary(BINARY[suffix]) if suffix in BINARY else self._text()

    def _text(self) -> Iterator[can.Message]:
        """Line by line: a malformed line costs itself alone."""
        form = form_of(self.path)
        if form.remark:
            self._remark(0, form.remark)
        with open_text(self.path) as file:
            lines = Lines(file, form)
            reader = form.make(lines)
            stream = iter(reader)
            bad = 0
            newest: dict[tuple[int, bool], str] = {}
            """The line of each id that was read last."""
            while not lines.ended:
                try:
                    message = next(stream)
                except BROKEN:
                    *before, (number, text) = lines.take() or [(lines.number, "")]
                    self._pass_over(before, form)
                    if bad == number:
                        self.note("the header does not say how to read what follows", f"after line {bad}")
                        break
                    self.read += 1
                    bad = number
                    self.note(form.malformed(text), f"line {bad}")
                    lines.put_back("\n")  # a reader looks for a header when it starts: it is shown an empty line
                    stream = iter(reader)
                    continue
                except StopIteration:
                    break
                *before, (_, text) = lines.take() or [(lines.number, "")]
                self._pass_over(before, form)
                form.mend(message)
                key = (message.arbitration_id, message.is_extended_id)
                if lines.complaint and len(text.rstrip()) < len(newest.get(key, "").rstrip()):
                    self.note(
                        f"{lines.complaint}, since it is shorter than that of this id before: left out",
                        f"line {lines.number}",
                    )
                    return
                newest[key] = text
                yield message
            self._pass_over(lines.take(), form)
            if lines.complaint and bad != lines.number:
                self.note(lines.complaint, f"line {lines.number}")

    def _pass_over(self, lines: list[tuple[int, str]], form: Any) -> None:
        """Count the lines of which no frame was made, and keep the first of each kind."""
        for number, text in lines:
            if words := form.unread(text):
                self.unread[words] += 1
                self._first_unread.setdefault(words, f"first line {number} {words}: {excerpt(text)}")

    def _binary(self, kind: Any) -> Iterator[can.Message]:
        """Up to the first malformed record: where the next one begins is unknown."""
        with contextlib.ExitStack() as stack:
            try:
                reader = kind(stack.enter_context(self.path.open("rb")))
                stack.callback(reader.stop)
                yield from reader
            except _broken(self.path):
                kind_of_file = suffix_of(self.path)
                said = f"the file is damaged there, or no {kind_of_file} at all; nothing after it can be read"
                self.note(said, f"after record {self.read}")
            else:
                if complaint := _cut(reader, self.path):
                    self.note(complaint, f"after record {self.read}")


def check_log(path: Path, field: str) -> None:
    """That there is such a log, of a kind that can be read here. Raises UserError naming the setting."""
    suffix = suffix_of(path)
    if suffix not in ENDINGS:
        known = foreign(path)
        raise UserError(
            f"{field}: {path.name} does not end in one of {', '.join(ENDINGS)}" + (f"; {known}" if known else "")
        )
    if not path.is_file():
        raise UserError(f"{field}: there is no file {path}")
    if suffix == ".mf4" and find_spec("asammdf") is None:
        raise UserError(f"{field}: {path.name} takes the package asammdf: pip install asammdf")


def check_channel(path: Path, channel: str, option: str) -> None:
    """That a channel is named where the log holds several. Raises UserError that lists them and names the option."""
    if channel:
        return
    found = CanLog(path).channels()
    if len(found) > 1:
        raise UserError(f"{path.name} holds {len(found)} buses: {listed(path, found)}; choose one with {option}")


def listed(path: Path, found: Counter[str]) -> str:
    """Channels and their frames, in words; python-can counts those of .asc and .blf from 0, the files from 1."""
    counted = " (counted from 0)" if suffix_of(path) in (".asc", ".blf") else ""
    return f"{', '.join(f'channel {name} ({count} frames)' for name, count in sorted(found.items()))}{counted}"


def frame_of(message: can.Message, stamp_ns: int) -> CanFrame:
    """python-can's message as a frame."""
    return CanFrame(
        stamp_ns=stamp_ns,
        arbitration_id=message.arbitration_id,
        data=bytes(message.data),
        extended=message.is_extended_id,
        fd=message.is_fd,
        remote=message.is_remote_frame,
        requested_bytes=min(message.dlc, 8) if message.is_remote_frame else 0,
        error=message.is_error_frame,
        bitrate_switch=message.bitrate_switch,
        error_state=message.error_state_indicator,
    )


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
    # codes 9 to 15 of a classic frame mean eight bytes (ISO 11898-1)
    said = (message.dlc, dlc2len(min(message.dlc, 15))) if message.is_fd else (min(message.dlc, 8),)
    return "" if length in said else f"{length} bytes where it says {message.dlc}"


def _broken(path: Path) -> tuple[type[Exception], ...]:
    """What reading this file raises; asammdf, which is loaded only where it reads, has an error of its own, and stumbles over a
    file that was not finalised as over a variable that it never set.
    """
    if path.suffix.lower() != ".mf4":
        return BROKEN
    return (*BROKEN, NameError, AttributeError, AssertionError, import_module("asammdf.blocks.utils").MdfException)


def _cut(reader: Any, path: Path) -> str:
    """Whether a BLF lacks its end: python-can reads what there is and is silent about the rest."""
    wanted, size = getattr(reader, "file_size", None), path.stat().st_size
    if wanted is None or wanted == size:
        return ""
    return (
        f"cut: {size} of {wanted} bytes" if wanted > size else "not closed when it was written; its end may be missing"
    )

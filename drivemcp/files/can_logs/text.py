"""Lines of text logs as python-can reads them, and what is said of a line that is no frame."""

import codecs
import gzip
import logging
import re
import zlib
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import IO, Any

import can

from drivemcp.files.time_of_day import Clock, second_of_day

logging.getLogger("can.io.trc").setLevel(logging.ERROR)
"""It tells of each line that it cannot read; so do we, by its number."""
EVENT = re.compile(r"\s*(-?)(\d+)[.,](\d+)(?=\s)")
"""How an event of an .asc begins: its stamp, whose decimal point some locales write as a comma."""
_BASE = re.compile(r"^\s*base\s+(hex|dec)(?:.*\btimestamps\s+(relative|absolute))?", re.I | re.M)
_FD_ERROR = re.compile(r"^\s+CANFD\s+(\d+)\s+(?:[RT]x\s+)?ErrorFrame\b.*", re.I)
_REQUEST = re.compile(r"\s+(?:CANFD\s+)?\d+\s+(?:\S+\s+){0,2}TxRq\b", re.I)
"""A request to send is no frame yet; the frame has a line of its own."""
_SYMBOLIC = re.compile(
    rf"{EVENT.pattern}\s+(?:CANFD\s+)?\d+\s+(?:[RT]x\s+)?(?![0-9A-F]+x?\s)[A-Za-z_]\w*(?:::\w+)?\s+(?:[RT]x\s+d|[01]\s+[01])\s"
)
"""A frame by its message's name, as CANalyzer logs in symbolic mode."""
HEADER_LINES = 1000
EXCERPT = 60
_ASC_OWN = re.compile(
    r"\s*($|//|date\b|base\b|(no\s+)?internal events|begin\s+trigger|end\s+trigger|previous log|version\b|[-\d.,]+\s+(start of|begin|end))",
    re.I,
)
_LOGGED = re.compile(r"\(([^)]*)\)\s+(\S+)\s+([0-9a-f]+#\S*)(?:\s+([RT]))?(?:\s.*)?$", re.I)
_SHOWN = re.compile(
    r"(?:\(([^)]*)\)\s+)?(\S+)\s+(?:[RT]X\s+\S+\s+\S+\s+)?([0-9A-F]{8}|[0-9A-F]{3})\s+(?:\[(\d+)\]|\{[0-9A-F]\})\s*(.*)$"
)
_COLOURS = re.compile(r"\x1b\[[0-9;]*m")
_RAW_LENGTH = re.compile(r"_[9A-F]$", re.I)
_ERROR_FRAME = re.compile(r"^[2367ABEF][0-9A-F]{7}#.*$", re.I)
"""SocketCAN's mark of an error frame, of whatever class; python-can knows one class and takes the others for data."""
CSV_HEADER = "timestamp,arbitration_id,extended,remote,error,dlc,data"
_TRC_COMMA = re.compile(r"^(;\$STARTTIME=\d+|\s*\d+\)?\s+-?\d+),(\d+)")
_TRC_KEYWORD = re.compile(r"\s*;\$([A-Z]+)=([^;\s]*)[;\s]*$", re.I)
"""A line of the head; PEAK ends some with a semicolon, which is no part of the value."""
_TRC_ID = re.compile(r"^(\s*\d+\)?\s+\S+\s+\d+\s+[A-Z]+\s+[0-9A-F]{4,8})(?=\s)", re.I)
_TRC_STATE = re.compile(r"\s*\d+\)?\s+[\d.,]+\s.*\b(?:Warng|Error|ST|ER|EC|EV|FFFFFFFF)\b", re.I)
_TRC_LENGTH = re.compile(r"(\s)(?:9|1[0-5])(\s+(?:[0-9A-F]{2}\s+){7}[0-9A-F]{2}\s*)$", re.I)
_TRC_LONG = re.compile(r"\s*\d+\)?\s+[\d.]+\s+(?:F[DBE]|BI)\s", re.I)
"""Of a CAN FD frame python-can knows the length code, and a data byte may look like one."""
_FOREIGN = (
    ("LOGG", "a .blf log under another ending: rename it"),
    ("MDF     3", "a measurement of MDF 3: asammdf converts it to MDF 4"),
    ("MDF     4", "an .mf4 log under another ending: rename it"),
    ("UnFinMF", "an .mf4 log that was not finalised: finalise it, as asammdf does where it opens and saves it"),
    ("PK\x03\x04", "packed by zip: unpack it"),
    ("\x1f\x8b", "packed by gzip: add .gz to its name"),
    ("version https://git-lfs", "a pointer of Git LFS and not the log: git lfs pull"),
    ("@ TEXT @", "a trace of CANHacker: convert it to a table with the columns time_ms, id (hex) and data"),
    ("***BUSMASTER", "a log of BUSMASTER: export it as .asc"),
    (";$FILEVERSION", "a .trc log under another ending: rename it"),
    ("date ", "an .asc log under another ending: rename it"),
    ("base ", "an .asc log under another ending: rename it"),
    ("(", "a candump log under another ending: rename it to .log"),
    ("timestamp,arbitration_id", "a .csv log under another ending: rename it"),
    ("Time Stamp,ID,", "a table under another ending: rename it to .csv"),
    ("<", "a page or XML and not a log: was a download answered by a web page?"),
)
"""How a file begins that is of another kind than its name says, and what it is."""
_ITS_OWN = {
    ".log": "(",
    ".asc": "date base ",
    ".trc": ";$FILEVERSION",
    ".csv": f"{CSV_HEADER} Time Stamp,ID,",
    ".blf": "LOGG",
    ".mf4": "MDF     4",
}
_WANTED = {
    ".asc": "an event of an .asc log",
    ".csv": f"a row of python-can's .csv log ({CSV_HEADER})",
    ".log": "a line of candump -L",
    ".trc": "a line of a .trc log",
}


class Form:
    """A kind of text log. `line` gives what python-can is shown of a line; `stamp_s` its time where python-can cannot read it."""

    reader: Any
    suffix: str
    stamp_s: float | None = None
    remark = ""
    """What had to be assumed of the file."""

    def make(self, lines: Any) -> Any:
        """python-can's reader of these lines."""
        return self.reader(lines)

    def line(self, text: str) -> str:
        """The line as python-can reads it."""
        return text

    def mend(self, message: can.Message) -> None:
        """Put right what python-can cannot tell from the line."""
        if self.stamp_s is not None:
            message.timestamp = self.stamp_s

    def unread(self, text: str) -> str:
        """What a line is of which python-can made no frame; empty where the format has such lines."""
        return "" if not text.strip() else f"is not {_WANTED[self.suffix]}"

    def malformed(self, text: str) -> str:
        """What is wrong with a line that python-can refuses."""
        return f"is not {_WANTED[self.suffix]}: {excerpt(text)}"


NAMED = "names its message and gives no id; let the logger write numbers (symbolic mode off)"


class Asc(Form):
    """Vector's: with its number base, times that may be differences or negative, and decimal commas."""

    suffix = ".asc"

    def __init__(self, header: list[str]) -> None:
        text = "".join(header)
        base = _BASE.search(text)
        self._base = base[1].lower() if base else "hex"
        self._differences = bool(re.search(r"\btimestamps\s+relative", text, re.I))
        self._reader: Any = None
        self._at_s = 0.0
        self.remark = "" if base else "no line 'base': numbers are taken as hexadecimal"

    def make(self, lines: Any) -> Any:
        lines.put_back("\n")  # python-can looks for a header first; this one was read here
        self._reader = can.ASCReader(lines, base=self._base)
        return self._reader

    def line(self, text: str) -> str:
        self.stamp_s = None
        if (base := _BASE.match(text)) and self._reader is not None:  # of another measurement behind the first
            self._reader._converted_base = 10 if base[1].lower() == "dec" else 16
            self._differences = base[2].lower() == "relative" if base[2] else self._differences
            return text
        event = EVENT.match(text)
        if event is None:
            return text
        if _REQUEST.match(text, event.end()):
            return f"// {text}"
        sign, whole, part = event.groups()
        stamp_s = float(f"{sign}{whole}.{part}")
        self._at_s = self._at_s + stamp_s if self._differences else stamp_s
        self.stamp_s = self._at_s
        rest = _FD_ERROR.sub(r" \1  ErrorFrame", text[event.end() :])
        return f"{whole}.{part}{rest}"

    def unread(self, text: str) -> str:
        if _ASC_OWN.match(text):
            return ""
        if _SYMBOLIC.match(text):
            return NAMED
        return "is no CAN frame (statistics, markers, other buses)" if EVENT.match(text) else super().unread(text)

    def malformed(self, text: str) -> str:
        return f"{NAMED}: {excerpt(text)}" if _SYMBOLIC.match(text) else super().malformed(text)


class Candump(Form):
    """candump's, in the form of -L and as shown on the screen."""

    suffix = ".log"
    reader = can.CanutilsLogReader
    _channel = ""

    def __init__(self) -> None:
        self._clock = Clock()

    def line(self, text: str) -> str:
        plain = _COLOURS.sub("", text).strip()
        logged = _LOGGED.match(plain)
        found = logged.groups() if logged else _from_screen(plain)
        if found is None:
            return text
        time, channel, frame, direction = (each or "" for each in found)
        self.stamp_s, self._channel = seconds(time, self._clock), channel
        if self.stamp_s is None:
            return text
        frame = _ERROR_FRAME.sub("20000080#", _RAW_LENGTH.sub("", frame))
        return f"(0) {channel} {frame}{f' {direction}' if direction else ''}\n"

    def mend(self, message: can.Message) -> None:
        super().mend(message)
        if message.is_error_frame:
            message.channel = self._channel  # python-can leaves it out

    def malformed(self, text: str) -> str:
        shown = _SHOWN.match(_COLOURS.sub("", text).strip())
        if shown and shown[1] is None:
            return f"is candump's screen form without times; record with candump -L: {excerpt(text)}"
        return super().malformed(text)


class Csv(Form):
    """python-can's own table."""

    suffix = ".csv"
    reader = can.CSVReader

    def __init__(self, unknown: str = "") -> None:
        """`unknown`: a header that is not python-can's and lacks a column for time, id or bytes."""
        self._unknown = unknown

    def malformed(self, text: str) -> str:
        if not self._unknown:
            return super().malformed(text)
        named = "`time_s` (or `time_ms`, `time_us`), `id` and `data`"
        return f"its header {excerpt(self._unknown)} names no columns {named}: decoded signals make no frames, others are named so"

    def mend(self, message: can.Message) -> None:
        message.is_fd = len(message.data) > 8  # the table does not say so

    def unread(self, text: str) -> str:
        return "" if text.strip() in (CSV_HEADER, self._unknown) else super().unread(text)


class Trc(Form):
    """PEAK's; python-can takes a length code above 8 for a number of bytes."""

    suffix = ".trc"
    reader = can.TRCReader
    _bare = False
    """Of version 1.2: it is 1.3 without the column that is reserved there; python-can knows the latter alone."""

    def line(self, text: str) -> str:
        if not text.strip():
            return ";\n"  # python-can takes an empty line for the end of the head
        if said := _TRC_KEYWORD.match(text):
            key, value = said.groups()
            self._bare = self._bare or (key, value) == ("FILEVERSION", "1.2")
            text = f";${key}={'1.3' if self._bare and key == 'FILEVERSION' else value}\n"
        elif self._bare:
            text = _TRC_ID.sub(r"\1 -", text)
        text = _TRC_COMMA.sub(r"\1.\2", text)
        return text if _TRC_LONG.match(text) else _TRC_LENGTH.sub(r"\g<1>8\2", text)

    def unread(self, text: str) -> str:
        if text.lstrip().startswith(";"):
            return ""
        return "is no CAN frame (states and errors of the bus)" if _TRC_STATE.match(text) else super().unread(text)


FORMS = (".asc", ".csv", ".log", ".trc")


def _from_screen(text: str) -> tuple[str | None, ...] | None:
    """A line as candump shows it: its time, channel, frame as -L writes it, and direction."""
    shown = _SHOWN.match(text)
    if shown is None or shown[1] is None:
        return None
    time, channel, number, count, rest = shown.groups()
    if rest.startswith("remote request"):
        return time, channel, f"{number}#R{int(count or 8)}", ""
    size = 8 if count is None else int(count)
    data = rest.split()[:size]
    if len(data) < size or not all(re.fullmatch("[0-9A-F]{2}", each) for each in data):
        return None
    mark = "##0" if count is not None and len(count) == 2 else "#"  # CAN FD is shown with two digits
    return time, channel, f"{number}{mark}{''.join(data)}", ""


def seconds(text: str, clock: Clock) -> float | None:
    """Seconds since 1970, or since some start; of a date that is not ISO 8601 the time of day alone, by a clock over midnight."""
    try:
        return float(text.replace(",", "."))
    except ValueError:
        pass
    try:
        return datetime.fromisoformat(text.strip()).timestamp()
    except (ValueError, OverflowError, OSError):
        of_day = second_of_day(text)
    return clock.after(of_day) if of_day is not None else None


def open_text(path: Path) -> IO[str]:
    """The file as text, by its byte order mark; packed or not."""
    opener: Any = gzip.open if path.suffix.lower() == ".gz" else open
    with opener(path, "rb") as raw:
        try:
            head = raw.read(4)
        except (OSError, EOFError):
            head = b""
    wide = head.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
    file: IO[str] = opener(path, "rt", encoding="utf-16" if wide else "utf-8-sig", errors="replace")
    return file


def suffix_of(path: Path) -> str:
    """The ending that tells the kind: of `drive.log.gz` it is `.log`."""
    suffixes = [suffix.lower() for suffix in path.suffixes[-2:]]
    packed = len(suffixes) == 2 and suffixes[1] == ".gz" and suffixes[0] in FORMS
    return suffixes[0] if packed else path.suffix.lower()


def excerpt(text: str) -> str:
    """The beginning of a line, in quotes, as one line of plain characters."""
    plain = " ".join(text.split())
    return repr(plain if len(plain) <= EXCERPT else f"{plain[:EXCERPT]}...")


def foreign(path: Path) -> str:
    """What the file is if it begins like one of another kind; else empty."""
    try:
        with path.open("rb") as file:
            head = file.read(64).decode("latin-1").removeprefix("\xef\xbb\xbf").lstrip()
    except OSError:
        return ""
    if path.suffix.lower() == ".gz":
        return "" if head.startswith("\x1f\x8b") else "it is not packed by gzip: take .gz from its name"
    own = _ITS_OWN.get(suffix_of(path), "")
    said = (words for start, words in _FOREIGN if head.startswith(start) and start not in own)
    return next((f"it is {words}" for words in said), "")


class Lines:
    """A text file by lines, counted; what python-can's text readers read from."""

    def __init__(self, file: IO[str], form: Form) -> None:
        self._file, self._form = file, form
        self._put_back: list[str] = []
        self.number = 0
        self.given: list[tuple[int, str]] = []
        """Lines given since the last frame; the reader of frames takes them."""
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
            line, self.complaint = "", _breaks_off(error)
        if not line:
            self.ended = True
            raise StopIteration
        self.number += 1
        if not line.endswith("\n"):
            self.complaint = "the last line does not end; it may be cut"
        self.given.append((self.number, line))
        return self._form.line(line)

    def put_back(self, line: str) -> None:
        """Give this line next."""
        self._put_back.append(line)

    def take(self) -> list[tuple[int, str]]:
        """The lines given since this was last asked."""
        given, self.given = self.given, []
        return given

    def read(self, size: int = -1) -> str:
        """The rest."""
        return self._file.read(size)

    def close(self) -> None:
        """The file is closed by the code that opened it."""


def _breaks_off(error: Exception) -> str:
    reason = error.strerror if isinstance(error, OSError) and error.strerror else "its packing is damaged or cut"
    return f"the file breaks off: {reason}"

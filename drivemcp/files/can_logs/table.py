"""Tables of frames as other programs export them (SavvyCAN, Kvaser, Vehicle Spy, CANedge, asammdf, PCAN, cabana): columns by name.

python-can reads its own table alone.
"""

import csv
import itertools
import re
import statistics
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import can
from can.util import dlc2len

from drivemcp.files.can_logs.text import Form, excerpt, seconds
from drivemcp.files.since_1970 import UNTOLD_TO, are_days, counts_per_s, dated_s
from drivemcp.files.time_of_day import Clock

HEAD_LINES = 200
LOOK_ROWS = 1000
"""Rows that show in which base the numbers are, and what the times count."""
_UNIT = r"[ _]*[(\[]?(?P<unit>s|sec|seconds|ms|msec|us|µs|ns)?[)\]]?"
_BASE = r"(?:[ _]*[(\[]?(?P<base>hex|dec)[a-z]*[)\]]?)?"
_OWN = r"(?:can_dataframe[._])?"
COLUMNS: Mapping[str, str] = {
    "time": rf"(?:(?:abs(?:olute)?[ _]?)?time(?:[ _]?stamps?|[ _]?offset|stampepoch)?|zeit(?:stempel)?){_UNIT}",
    "id": rf"{_OWN}(?:(?:arb(?:itration)?|can|cob|frame|message|msg)?[ _-]?id|identifier|addr(?:ess)?){_BASE}",
    "extended": rf"{_OWN}(?:ide|xtd|ext(?:ended)?|is[ _]extended.*)",
    "bus": rf"{_OWN}(?:bus[ _]?channel|bus|chan(?:nel)?|chn|kanal|network|interface)",
    "length": rf"{_OWN}(?:dlc|len(?:gth)?|data[ _]?length(?:[ _]?code)?|size)",
    "remote": rf"{_OWN}(?:rtr|remote)",
    "error": r"er|err(?:or)?",
    "fd": rf"{_OWN}(?:edl|fdf|fd)",
    "data": rf"{_OWN}(?:data[ _]?(?:bytes?|field)?|payload|message[ _]?data|daten){_BASE}",
}
OTHERWISE: Mapping[str, str] = {
    "time": r"(?:date[ _/-]?time|(?:rel(?:ative)?|system)[ _]?time(?:[ _]?stamp)?|elapsed(?:[ _]?time)?|ts|t|"
    rf"(?P<count>mi(?:lli|cro)s)(?:econds)?(?:\(\))?){_UNIT}",
    "data": rf"bytes{_BASE}",
}
"""Names that may mean something else, where no column has one of the others."""
COUNTS = {"millis": "ms", "micros": "us"}
_BYTE = re.compile(rf"(?:d|b|db|data|byte|data[ _]?byte)[ _]?\[?\d+\]?{_BASE}")
_KIND = re.compile(r"(?:(?:frame|msg|message|id|can[ _-]?id)[ _]?)?(?:type|format|flags?)")
KINDS: Mapping[str, frozenset[str]] = {
    "extended": frozenset({"x", "xr", "xtd", "ext", "extended", "eff"}),
    "remote": frozenset({"rtr", "remote", "sr", "xr"}),
    "error": frozenset({"err", "error", "errorframe"}),
    "fd": frozenset({"fd", "fdf", "canfd"}),
}
"""Words in a column for the kind of frame; `R` is left out, since it may stand for received."""
LARGEST_ID = (1 << 29) - 1
_TRUE = ("1", "t", "true", "x", "yes", "ext", "extended", "rtr", "r", "y")
_BARE = re.compile(r"\d+\.\d+,[0-9a-f]{3,8},\d{1,2},(?:[0-9a-f]{2}(?:,|$))+", re.I)
"""A row of a data set without a header: time, id, length, bytes, and perhaps a label."""
BARE = ("time", "id (hex)", "dlc", *(f"d{number} (hex)" for number in range(8)))
SAVVYCAN = ("time stamp", "id", "extended")
"""It counts microseconds and writes hexadecimal numbers, and says neither."""
CANALYST = ("index", "system time", "time stamp")
"""Its stamp is a hexadecimal count of an untold unit; the system's time has tenths of milliseconds behind a second point."""
_TENTHS = re.compile(r"(\d+:\d\d:\d\d\.\d{3})\.(\d)")


class Header(NamedTuple):
    """Where a table's columns are."""

    lines: int
    """Before the first row."""
    delimiter: str
    places: Mapping[str, int]
    bytes_at: tuple[int, ...]
    """Columns of one byte each."""
    kinds_at: tuple[int, ...]
    """Columns that say what kind of frame it is."""
    unit: str
    id_base: int
    """0: not said."""
    data_base: int


def header_of(head: Sequence[str]) -> Header | None:
    """The header in a file's first lines; None where it has none."""
    for count, line in enumerate(head[:HEAD_LINES], 1):
        if _BARE.match(line.strip()):
            return _header(count - 1, ",", BARE)
        delimiter = max(",;\t", key=line.count)
        names = [name.strip().lower().replace("μ", "µ") for name in _cells(line, delimiter)]
        found = _header(count, delimiter, names)
        if found is not None:
            return found
    return None


def _header(lines: int, delimiter: str, names: Sequence[str]) -> Header | None:
    each_byte = [(at, found) for at, name in enumerate(names) if (found := _BYTE.fullmatch(name))]
    otherwise = {what: pattern for what, pattern in OTHERWISE.items() if what != "data" or not each_byte}
    matched = {
        what: _column(pattern, names) or _column(otherwise.get(what, ""), names) for what, pattern in COLUMNS.items()
    }
    if tuple(names[:3]) == CANALYST:
        matched["time"] = _column(CANALYST[1], names)
    time, number, data = matched["time"], matched["id"], matched["data"]
    if time is None or number is None or not (data or each_byte):
        return None
    ours = tuple(names[:3]) == SAVVYCAN
    data_said = data[1]["base"] if data else each_byte[0][1]["base"]
    said = time[1].groupdict()
    unit = said.get("unit") or COUNTS.get(said.get("count") or "", "us" if ours else "")
    raw = names[number[0]].startswith("can_dataframe")
    id_said = number[1]["base"] or ("hex" if ours else "dec" if raw else "")
    return Header(
        lines, delimiter, {what: found[0] for what, found in matched.items() if found},
        () if data else tuple(at for at, _ in each_byte),
        tuple(at for at, name in enumerate(names) if _KIND.fullmatch(name)),
        unit, _BASES[id_said], _BASES[data_said or ("hex" if ours else "")],
    )  # fmt: skip


def _column(pattern: str, names: Sequence[str]) -> tuple[int, re.Match[str]] | None:
    """The first column of such a name."""
    return next(((at, found) for at, name in enumerate(names) if name and (found := re.fullmatch(pattern, name))), None)


_BASES: Mapping[str | None, int] = {"hex": 16, "dec": 10, "": 0, None: 0}
_WITH_UNIT = re.compile(r"([+-]?\d+(?:[.,]\d+)?)\s*(s|sec|ms|msec|us|µs|μs|ns)", re.I)
"""A time that says its unit itself."""
_PER_S = {"ms": 1e3, "msec": 1e3, "us": 1e6, "µs": 1e6, "μs": 1e6, "ns": 1e9}


def _cells(line: str, delimiter: str) -> list[str]:
    return next(csv.reader([line.strip("\r\n")], delimiter=delimiter), [])


class Table(Form):
    """A table of another program than python-can."""

    suffix = ".csv"

    def __init__(self, header: Header, head: Sequence[str]) -> None:
        self._header = header
        self._clock = Clock()
        rows = [_cells(line, header.delimiter) for line in head[header.lines :] if line.strip()]
        self._id_base = header.id_base or self._base_of_ids(rows)
        self._data_base = header.data_base or self._base_of_bytes(rows)
        self._untimely = "" if header.unit else _untimely([self._cell(row, "time") for row in rows])

    def _base_of_ids(self, rows: Sequence[Sequence[str]]) -> int:
        texts = [text for row in rows if (text := self._cell(row, "id"))]
        short = [
            self._cell(row, "id") for row in rows if self._cell(row, "extended") and not self._true(row, "extended")
        ]
        if any(
            re.search("[a-fx]|h$", text, re.I) or (len(text) in (3, 4, 8) and text.startswith("0")) for text in texts
        ):
            return 16
        if any(text.isdigit() and int(text, 16) > 0x7FF for text in short):
            return 10
        if any(text.isdigit() and int(text, 16) > LARGEST_ID for text in texts):
            return 10
        self.remark = "its header does not say whether ids are hexadecimal; they are taken as such (name the column `ID (dec)` if not)"
        return 16

    def _base_of_bytes(self, rows: Sequence[Sequence[str]]) -> int:
        texts = [text for row in rows for text in self._bytes(row)]
        if any(re.search(r"\b0x", text, re.I) for row in rows for text in self._written(row)):
            return 16
        if any(text.startswith("[") for text in (self._cell(row, "data") for row in rows)):
            return 10
        if any(re.fullmatch("(?:0x)?(?:[0-9a-f]{2}){2,}", self._cell(row, "data"), re.I) for row in rows):
            return 16  # bytes without a gap between them
        if any(re.search("[a-f]", text, re.I) or (len(text) == 2 and text.startswith("0")) for text in texts):
            return 16
        return 10 if any(len(text) == 3 for text in texts) else self._id_base

    def make(self, lines: Any) -> Any:
        return _Rows(self, lines)

    def message(self, line: str) -> can.Message:
        """The frame of a row. Raises ValueError or IndexError where the row holds no frame."""
        if self._untimely:
            raise ValueError
        row = _cells(line, self._header.delimiter)
        text = self._cell(row, "id")
        number = int(re.sub("[xh]$", "", text, flags=re.I), self._id_base)
        extended = (
            self._true(row, "extended")
            if "extended" in self._header.places
            else number > 0x7FF or text[-1:] in "xX" or self._says(row, "extended")
        )
        remote, error = self._says(row, "remote"), self._says(row, "error") or self._is_kvasers_error(row)
        data = bytes(int(each, self._data_base) for each in self._bytes(row))
        length = self._cell(row, "length")
        told = int(length) if length.isdigit() else len(data)
        fd = self._true(row, "fd") if "fd" in self._header.places else len(data) > 8 or self._says(row, "fd")
        if not remote and self._header.bytes_at and len(data) != dlc2len(min(told, 15)):
            data = data[:told]
        bus = self._cell(row, "bus")
        return can.Message(
            timestamp=self._time(self._cell(row, "time")), arbitration_id=number, is_extended_id=extended, is_fd=fd,
            is_remote_frame=remote, is_error_frame=error, channel=bus or None,
            dlc=len(data) if error else told, data=b"" if remote else data,
        )  # fmt: skip

    def _time(self, text: str) -> float:
        if not self._header.unit and (at_s := dated_s(text)) is not None:
            return at_s
        if not self._header.unit and (own := _WITH_UNIT.fullmatch(text)):
            return float(own[1].replace(",", ".")) / _PER_S.get(own[2].lower(), 1.0)
        value = seconds(_TENTHS.sub(r"\1\2", text), self._clock)
        if value is None:
            raise ValueError
        return value if ":" in text else value / _PER_S.get(self._header.unit, counts_per_s(value))

    def _cell(self, row: Sequence[str], what: str) -> str:
        at = self._header.places.get(what)
        return row[at].strip() if at is not None and at < len(row) else ""

    def _says(self, row: Sequence[str], what: str) -> bool:
        """Whether a column of its own or one for the kind of frame says so."""
        kinds = (row[at].lower() for at in self._header.kinds_at if at < len(row))
        return self._true(row, what) or any(not KINDS[what].isdisjoint(re.findall("[a-z]+", each)) for each in kinds)

    def _is_kvasers_error(self, row: Sequence[str]) -> bool:
        """Whether a row is flagged `E` and has neither id nor bytes; elsewhere the letter may stand for an extended id."""
        flagged = any(row[at].strip().lower() == "e" for at in self._header.kinds_at if at < len(row))
        return flagged and self._cell(row, "id") == self._cell(row, "length") == "0"

    def _true(self, row: Sequence[str], what: str) -> bool:
        return self._cell(row, what).lower() in _TRUE

    def _written(self, row: Sequence[str]) -> list[str]:
        """The cells of a row that hold its bytes."""
        return [row[at] for at in self._header.bytes_at if at < len(row)] or [self._cell(row, "data")]

    def _bytes(self, row: Sequence[str]) -> list[str]:
        """The bytes of a row as they are written, whether each stands in its own column or all in one."""
        if self._header.bytes_at:
            found = (row[at].strip() for at in self._header.bytes_at if at < len(row))
            return [
                re.sub("^0x", "", each, flags=re.I) for each in found if re.fullmatch("(0x)?[0-9a-f]{1,3}", each, re.I)
            ]
        text = re.sub(
            r"^0x(?=[0-9a-f]{2,}$)",
            "",
            re.sub(r"^(?:b(?=['\"])|x\|)", "", self._cell(row, "data")).strip("[]()'\" "),
            flags=re.I,
        )
        if re.fullmatch("(?:[0-9a-f]{2})*", text, re.I):
            return [text[at : at + 2] for at in range(0, len(text), 2)]
        return [re.sub("^0x", "", each, flags=re.I) for each in re.split(r"[\s,;:.|-]+", text) if each]

    def unread(self, text: str) -> str:
        return ""

    def malformed(self, text: str) -> str:
        if self._untimely:
            return self._untimely
        row = _cells(text, self._header.delimiter)
        time = self._cell(row, "time")
        says_unit = not self._header.unit and _WITH_UNIT.fullmatch(time)
        if time and not says_unit and seconds(time, Clock()) is None:
            return f"its time {excerpt(time)} is neither seconds, a time of day nor an ISO 8601 time"
        return f"is no row of this table: {excerpt(text)}"


class _Rows:
    """What python-can's readers are to the other forms."""

    def __init__(self, table: Table, lines: Any) -> None:
        self._table, self._lines = table, lines
        self._rows = itertools.dropwhile(lambda line: lines.number <= table._header.lines, lines)

    def __iter__(self) -> Iterator[can.Message]:
        for line in self._rows:
            if line.strip():
                yield self._table.message(line)


def _untimely(times: Sequence[str]) -> str:
    """Why times without a unit are no seconds, and what to do: days, or whole numbers, not since 1970, most of them more than a second
    apart; empty: they may be seconds."""
    values = [float(each) for each in times if re.fullmatch(r"\d+(?:\.\d+)?", each)]
    if len(values) < max(2, len(times)) or max(values) > UNTOLD_TO:
        return ""
    if are_days(values):
        return "its times count days, as spreadsheets do: format the column as date and time with fractions of a second"
    step = statistics.median(after - before for before, after in itertools.pairwise(values))
    if step <= 1 or not all(each.is_integer() for each in values):
        return ""
    return "its times are whole numbers, and its header names no unit: name the column `time_ms` or `time_us`"

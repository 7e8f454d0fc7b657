"""Long-term memory, in SQLite: what was remembered, signed heads of the log, and an index of traces.

One connection, one lock: the log's writer, the node's worker and the tools' threads share it. Every statement is short.
Memories are never overwritten; the newest of a key counts, the older ones are its history.
"""

import os
import sqlite3
import stat
import threading
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Literal, NamedTuple
from urllib.parse import quote

import msgspec

from proto.decision import TraceRecord
from proto.health import ChainHead

Kind = Literal["preferences", "feedback", "rulepack", "drive", "note"]
MAX_VALUE_BYTES = 65_536
MAX_ROWS = 500
HEADS_KEPT_EVERY = 100
_SCHEMA = """
CREATE TABLE IF NOT EXISTS memories(
    id INTEGER PRIMARY KEY, kind TEXT NOT NULL, key TEXT NOT NULL, value TEXT NOT NULL, stamp_ns INTEGER NOT NULL);
CREATE INDEX IF NOT EXISTS memories_by_key ON memories(kind, key, id);
CREATE TABLE IF NOT EXISTS heads(
    file TEXT NOT NULL, n INTEGER NOT NULL, records INTEGER NOT NULL, head TEXT NOT NULL, signature TEXT NOT NULL,
    key_id TEXT NOT NULL, closed INTEGER NOT NULL, PRIMARY KEY(file, n)) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS traces(
    id INTEGER PRIMARY KEY, file TEXT NOT NULL, tick INTEGER NOT NULL, stamp_ns INTEGER NOT NULL, cause TEXT NOT NULL,
    decision TEXT NOT NULL, events TEXT NOT NULL, urgency TEXT NOT NULL, topic TEXT NOT NULL, directive TEXT NOT NULL,
    target_mps REAL);
CREATE INDEX IF NOT EXISTS traces_by_time ON traces(stamp_ns);
"""


class Memory(msgspec.Struct, frozen=True, kw_only=True):
    """One thing remembered."""

    kind: str
    key: str
    value: dict[str, Any]
    stamp_ns: int


class TraceRow(msgspec.Struct, frozen=True, kw_only=True):
    """One tick as the index knows it; the whole trace stands in the log file."""

    tick: int
    stamp_ns: int
    cause: str
    decision: str
    events: tuple[str, ...]
    urgency: str
    topic: str
    directive: str
    target_mps: float | None
    file: str


class TraceQuery(msgspec.Struct, frozen=True, kw_only=True):
    """What traces are asked for; an empty field or a zero asks nothing."""

    event: str = ""
    decision: str = ""
    text: str = ""
    after_ns: int = 0
    before_ns: int = 0
    limit: int = 20


class MemoryStore:
    """The database. Raises sqlite3.Error where it cannot be read or written."""

    def __init__(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        os.close(os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o640))
        os.chmod(path, stat.S_IMODE(path.stat().st_mode) & 0o640)  # what SQLite keeps beside it has the same mode
        self._db = sqlite3.connect(path, check_same_thread=False, timeout=1.0)
        self._lock = threading.Lock()
        with self._lock:
            self._db.execute("PRAGMA journal_mode=WAL")
            self._db.execute("PRAGMA synchronous=NORMAL")
            self._db.executescript(_SCHEMA)

    def close(self) -> None:
        """Closes the database."""
        with self._lock:
            self._db.close()

    def remember(self, kind: Kind, key: str, value: dict[str, Any], *, stamp_ns: int) -> int:
        """Adds a memory; its number. Raises ValueError where the value is too large."""
        text = msgspec.json.encode(value).decode()
        if len(text) > MAX_VALUE_BYTES:
            raise ValueError(f"a memory holds at most {MAX_VALUE_BYTES} bytes, this one has {len(text)}")
        with self._lock, self._db:
            cursor = self._db.execute(
                "INSERT INTO memories(kind, key, value, stamp_ns) VALUES (?, ?, ?, ?)",
                (kind, key, text, _held(stamp_ns)),
            )
        return int(cursor.lastrowid or 0)

    def recall(self, kind: Kind, key: str = "", *, limit: int = 20) -> tuple[Memory, ...]:
        """What was remembered, newest first; of every key without one."""
        with self._lock:
            rows = self._db.execute(
                "SELECT kind, key, value, stamp_ns FROM memories WHERE kind = ? AND (? = '' OR key = ?)"
                " ORDER BY id DESC LIMIT ?",
                (kind, key, key, max(0, min(limit, MAX_ROWS))),
            ).fetchall()
        return tuple(
            Memory(kind=kind, key=key, value=msgspec.json.decode(value), stamp_ns=stamp_ns)
            for kind, key, value, stamp_ns in rows
        )

    def add_head(self, head: ChainHead, n: int) -> None:
        """Keeps a signed head of a file: the newest, and of the older ones every hundredth."""
        with self._lock, self._db:
            if (n - 1) % HEADS_KEPT_EVERY:
                self._db.execute("DELETE FROM heads WHERE file = ? AND n = ?", (head.file, n - 1))
            self._db.execute(
                "INSERT OR REPLACE INTO heads VALUES (?, ?, ?, ?, ?, ?, ?)",
                (head.file, n, head.records, head.head_sha256, head.signature, head.key_id, int(head.closed)),
            )

    def add_traces(self, rows: Sequence[TraceRow]) -> None:
        """Indexes ticks."""
        with self._lock, self._db:
            self._db.executemany(
                "INSERT INTO traces(file, tick, stamp_ns, cause, decision, events, urgency, topic, directive, target_mps)"
                " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                [
                    (
                        row.file,
                        row.tick,
                        row.stamp_ns,
                        row.cause,
                        row.decision,
                        " ".join(("", *row.events, "")),
                        row.urgency,
                        row.topic,
                        row.directive,
                        row.target_mps,
                    )
                    for row in rows
                ],
            )

    def find_traces(self, query: TraceQuery) -> tuple[TraceRow, ...]:
        """Ticks that fit, newest first."""
        conditions: list[tuple[str, str | int]] = []
        if query.event:
            conditions.append(("instr(events, ' ' || ? || ' ') > 0", query.event))
        if query.decision:
            conditions.append(("decision = ?", query.decision.upper()))
        if query.text:
            conditions.append(("instr(lower(directive), lower(?)) > 0", query.text))
        if query.after_ns:
            conditions.append(("stamp_ns >= ?", _held(query.after_ns)))
        if query.before_ns:
            conditions.append(("stamp_ns < ?", _held(query.before_ns)))
        where = " AND ".join(condition for condition, _ in conditions) or "1"
        values = [value for _, value in conditions]
        with self._lock:
            rows = self._db.execute(
                "SELECT tick, stamp_ns, cause, decision, events, urgency, topic, directive, target_mps, file FROM traces"
                f" WHERE {where} ORDER BY id DESC LIMIT ?",
                (*values, max(0, min(query.limit, MAX_ROWS))),
            ).fetchall()
        return tuple(_trace_row(row) for row in rows)

    def forget_file(self, file: str) -> None:
        """A log file is retired: its heads and the index of its traces go with it."""
        with self._lock, self._db:
            self._db.execute("DELETE FROM heads WHERE file = ?", (file,))
            self._db.execute("DELETE FROM traces WHERE file = ?", (file,))


def trace_row(trace: TraceRecord, file: str) -> TraceRow:
    """The row of a tick; its numbers as near as a database can hold them."""
    return TraceRow(
        tick=_held(trace.tick),
        stamp_ns=_held(trace.stamp_ns),
        cause=trace.cause,
        decision=trace.decision.kind,
        events=tuple(event.kind for event in trace.events),
        urgency=trace.advisory.urgency,
        topic=trace.advisory.topic,
        directive=trace.advisory.directive,
        target_mps=trace.advisory.target_mps,
        file=file,
    )


def _held(number: int) -> int:
    """The nearest number of 64 bits."""
    return min(max(number, -(2**63)), 2**63 - 1)


def _trace_row(row: tuple[Any, ...]) -> TraceRow:
    tick, stamp_ns, cause, decision, events, urgency, topic, directive, target_mps, file = row
    return TraceRow(
        tick=tick,
        stamp_ns=stamp_ns,
        cause=cause,
        decision=decision,
        events=tuple(events.split()),
        urgency=urgency,
        topic=topic,
        directive=directive,
        target_mps=target_mps,
        file=file,
    )


class KeptHead(NamedTuple):
    """A head of a log file, and the key that signed it; empty: no head is kept."""

    head: str = ""
    key_id: str = ""


def kept_head(database: Path, file: str) -> KeptHead:
    """The newest head of a log file that a memory keeps, read without touching it. Raises sqlite3.Error."""
    with closing(_read_only(database)) as db:
        row = db.execute("SELECT head, key_id FROM heads WHERE file = ? ORDER BY n DESC LIMIT 1", (file,)).fetchone()
    return KeptHead(*map(str, row)) if row else KeptHead()


def kept_files(database: Path) -> frozenset[str]:
    """The log files that a memory keeps heads of, read without touching it. Raises sqlite3.Error."""
    with closing(_read_only(database)) as db:
        return frozenset(str(name) for (name,) in db.execute("SELECT DISTINCT file FROM heads"))


def _read_only(database: Path) -> sqlite3.Connection:
    return sqlite3.connect(f"file:{quote(str(database))}?mode=ro", uri=True, timeout=2.0)

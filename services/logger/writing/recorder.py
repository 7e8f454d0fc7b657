"""From what arrives to what is logged, remembered and shown. Knows no bus: payloads in, records out."""

import sqlite3
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal, Protocol

import msgspec

from drivemcp.bus.received import decode
from drivemcp.errors import MALFORMED
from proto import topics
from proto.decision import TraceRecord
from proto.health import ChainHead
from proto.topics import Topic
from services.logger.format.container import writable_ns
from services.logger.memory import MemoryStore, TraceRow, trace_row
from services.logger.writing.log_file import Record
from services.logger.writing.topic_formats import record
from services.logger.writing.withheld import Withholding, is_kept

Pictures = Literal["all", "events", "none"]
MAX_WAITING = 256
"""Pictures held back at most, whatever the clock does."""


class HeadKeeper(Protocol):
    """Has heads kept where the drive's folder does not hold them."""

    def sealed(self, head: ChainHead, n: int) -> None:
        """A flush is in the file."""

    def retired(self, file: str) -> None:
        """Retention is about to delete a file."""


class PictureGate:
    """Holds pictures back until it is known whether something happened around them. Times in ns."""

    def __init__(self, mode: Pictures, *, before_ns: int, after_ns: int) -> None:
        self._mode, self._before_ns, self._after_ns = mode, before_ns, after_ns
        self._waiting: deque[Record] = deque(maxlen=MAX_WAITING)
        self._open_until_ns = -1

    def offer(self, picture: Record) -> list[Record]:
        """The pictures to log now that this one has come, oldest first."""
        if self._mode == "all":
            return [picture]
        if self._mode == "none":
            return []
        if picture.log_time_ns <= self._open_until_ns:
            return [picture]
        self._waiting.append(picture)
        while self._waiting and self._waiting[0].log_time_ns < picture.log_time_ns - self._before_ns:
            self._waiting.popleft()
        return []

    def event(self, now_ns: int) -> list[Record]:
        """Something happened: the pictures from before it that are to be logged now."""
        self._open_until_ns = max(self._open_until_ns, now_ns + self._after_ns)
        kept = [one for one in self._waiting if one.log_time_ns >= now_ns - self._before_ns]
        self._waiting.clear()
        return kept


class Recorder:
    """Takes payloads on the node's worker; hears of sealed flushes on the writer's thread."""

    def __init__(
        self,
        *,
        memory: MemoryStore | None,
        pictures: PictureGate,
        show: Callable[[str, Record], None],
        warn: Callable[[str], None],
        keepers: Sequence[HeadKeeper] = (),
        withholding: Withholding | None = None,
    ) -> None:
        self._keepers = keepers
        self._withholding = withholding
        """Where the log keeps no continuous record of the way driven."""
        self._memory, self._pictures, self._show, self._warn = memory, pictures, show, warn
        self._lock = threading.Lock()
        self._rows: list[TraceRow] = []
        self._versions: dict[str, str] | None = None
        self.malformed: Counter[str] = Counter()
        self.misstamped: Counter[str] = Counter()
        self.memory_failures = 0
        self.head: ChainHead | None = None
        self.put: Callable[[Record], None] = lambda _: None
        """Where records go; set before the first one comes."""

    def take(
        self,
        topic: Topic[msgspec.Struct],
        name: str,
        payload: bytes,
        *,
        sequence: int,
        stamp_ns: int,
        now_ns: int,
    ) -> None:
        """One publication. A payload that does not fit its topic is counted and not logged.

        A stamp that no log can hold is logged as the nearest one, and told.
        """
        written_ns, now_ns = writable_ns(stamp_ns), writable_ns(now_ns)
        try:
            message = decode(topic, payload)
            made = record(
                topic, message, payload, name=name, sequence=sequence, stamp_ns=written_ns, log_time_ns=now_ns
            )
        except (*MALFORMED, ValueError) as error:
            self._told(self.malformed, name, f"message {sequence} does not fit its topic and is not logged: {error}")
            return
        if written_ns != stamp_ns:
            self._told(
                self.misstamped, name, f"message {sequence} has stamp {stamp_ns} and is logged with {written_ns}"
            )
        self._show(topic.name, made)
        if self._withholding is not None and not is_kept(topic, message):
            for over in self._withholding.take(made):
                self.put(over)
            return
        for one in self._pictures.offer(made) if topic.logged == "foxglove_image" else (made,):
            self.put(one)
        if topic.name == topics.TRACE.name and isinstance(message, TraceRecord):
            self._note(message, now_ns)

    def end(self) -> None:
        """No more comes: what was left out since the last hash is told."""
        for over in self._withholding.rest() if self._withholding is not None else ():
            self.put(over)

    def sealed(self, head: ChainHead, n: int) -> None:
        """A flush is in the file: its head and its traces go to memory; its first and last make an entry of the drive.

        `head` is the new one only then: a service that hears of it finds the traces.
        """
        with self._lock:
            rows, self._rows = self._rows, []
        try:
            if self._memory is not None:
                self._keep(self._memory, head, n, rows)
        finally:
            self.head = head
        for keeper in self._keepers:
            keeper.sealed(head, n)

    def _keep(self, memory: MemoryStore, head: ChainHead, n: int, rows: list[TraceRow]) -> None:
        try:
            memory.add_head(head, n)
            if n == 0 or head.closed:
                now_ns = time.time_ns()
                entry = {"file": head.file, "messages": head.records, "closed": head.closed, "head": head.head_sha256}
                memory.remember("drive", head.file, entry, stamp_ns=now_ns)
            if rows:
                memory.add_traces([msgspec.structs.replace(row, file=head.file) for row in rows])
        except sqlite3.Error as error:
            self._memory_failed(error)

    def trouble(self, text: str) -> None:
        """Writing fails, or works again."""
        self._warn(text)

    def retired(self, path: Path) -> None:
        """A log file is about to be deleted to keep the bounds."""
        self._warn(f"retired {path.name}: the bounds of retention are reached")
        for keeper in self._keepers:
            keeper.retired(path.name)
        if self._memory is not None:
            try:
                self._memory.forget_file(path.name)
            except sqlite3.Error as error:
                self._memory_failed(error)

    def _note(self, trace: TraceRecord, now_ns: int) -> None:
        """What a trace means beyond its own record: pictures around it, its row, a change of versions."""
        if trace.decision.kind != "SILENT":
            for picture in self._pictures.event(now_ns):
                self.put(picture)
        with self._lock:
            self._rows.append(trace_row(trace, ""))
        if trace.versions and trace.versions != self._versions:
            self._versions = trace.versions
            self._remember_versions(trace)

    def _remember_versions(self, trace: TraceRecord) -> None:
        if self._memory is None:
            return
        try:
            known = self._memory.recall("rulepack", "versions", limit=1)
            if not known or known[0].value != trace.versions:
                self._memory.remember("rulepack", "versions", dict(trace.versions), stamp_ns=trace.stamp_ns)
        except sqlite3.Error as error:
            self._memory_failed(error)

    def _told(self, counter: Counter[str], name: str, text: str) -> None:
        """Counts it; some are told."""
        counter[name] += 1
        if counter[name] in (1, 100, 10_000):
            self._warn(f"{name}: {text}")

    def _memory_failed(self, error: sqlite3.Error) -> None:
        self.memory_failures += 1
        if self.memory_failures in (1, 100, 10_000):
            self._warn(f"long-term memory cannot be written: {error}")

"""Writes the log on a thread of its own: `put` never waits for a disk, a full disk never stops a drive."""

import queue
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Protocol

import msgspec

from proto.health import ChainHead
from services.logger.format.container import writable_ns
from services.logger.format.signing import Signer
from services.logger.writing import log_folder
from services.logger.writing.log_file import DiskFile, LogFile, Origin, RawFile, Record
from services.logger.writing.topic_formats import Gap, gap_record


class BackgroundThread:
    """Runs jobs one after the other. What a job raises is told to `failed`; the next one runs all the same."""

    def __init__(self, name: str, *, failed: Callable[[Exception], None]) -> None:
        self._jobs: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        self._failed = failed
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def put(self, job: Callable[[], None]) -> None:
        """Runs it later."""
        self._jobs.put(job)

    @property
    def behind(self) -> int:
        """How many jobs wait."""
        return self._jobs.qsize()

    def close(self, timeout_s: float) -> bool:
        """Runs what waits; whether that was done in time."""
        self._jobs.put(None)
        self._thread.join(timeout_s)
        return not self._thread.is_alive()

    def _run(self) -> None:
        while (job := self._jobs.get()) is not None:
            try:
                job()
            except Exception as error:  # noqa: BLE001 whatever one job raises, the later ones are still to be run
                self._failed(error)


MAX_FLUSH_MS = 200.0
"""What a kill -9 may cost at most (design 9); flushes come twice as often, so that a busy machine still keeps it."""
_BATCH_BYTES = 8_000_000


class WriterSettings(msgspec.Struct, frozen=True, kw_only=True):
    """How the log is written."""

    directory: Path
    vehicle: str = "ego"
    flush_ms: float = 100.0
    fsync_s: float = 1.0
    max_file_mb: float = 512.0
    max_file_s: float = 3600.0
    queue_mb: float = 64.0
    retention: log_folder.Retention = log_folder.Retention()


class Tally(msgspec.Struct, kw_only=True):
    """What the writer has done; read by others, written by its thread (`lost` also by `put`)."""

    messages: int = 0
    stored_bytes: int = 0
    lost: int = 0
    worst_flush_ms: float = 0.0
    trouble: str = ""
    """The error that keeps it from writing now; empty when all is well."""
    file: str = ""
    files: int = 0


class Listener(Protocol):
    """Receives what happens to the log, on a thread beside the writer's."""

    def sealed(self, head: ChainHead, n: int) -> None:
        """A flush is in the file."""

    def trouble(self, text: str) -> None:
        """Writing fails, or works again."""

    def retired(self, path: Path) -> None:
        """An old file is about to be deleted."""


class LogWriter:
    """Takes records from any thread, writes and seals them every `flush_ms`."""

    def __init__(
        self,
        settings: WriterSettings,
        signer: Signer,
        listener: Listener,
        *,
        now_ns: Callable[[], int] = time.time_ns,
        open_raw: Callable[[Path], RawFile] = DiskFile,
    ) -> None:
        self._settings, self._signer, self._listener = settings, signer, listener
        self._now_ns, self._open_raw = now_ns, open_raw
        self._started_ns = time.time_ns()
        self._lock = threading.Lock()
        self._waiting: list[Record] = []
        self._waiting_bytes = 0
        self._gap: Gap | None = None
        self._gaps = self._refused = 0
        self._file: LogFile | None = None
        self._opened_s = self._synced_s = 0.0
        self._previous: log_folder.Previous | None = None
        self._stop = threading.Event()
        self.tally = Tally()
        self._aside = BackgroundThread("log-aside", failed=self._failed)
        self._thread = threading.Thread(target=self._run, name="log-writer", daemon=True)

    def start(self) -> None:
        """Begins to write."""
        self._thread.start()

    def put(self, record: Record) -> None:
        """Hands a record over. Never waits; beyond `queue_mb` the newest are lost, and counted."""
        with self._lock:
            if self._waiting_bytes > self._settings.queue_mb * 1e6:
                self.tally.lost += 1
                self._gap = _widened(self._gap, record.log_time_ns, self.tally.trouble or "the writer is behind")
                return
            self._waiting.append(record)
            self._waiting_bytes += len(record.data)

    def missed(self, count: int, reason: str) -> None:
        """Counts messages that never came to be records, and leaves a gap."""
        with self._lock:
            self.tally.lost += count
            self._gap = _widened(self._gap, self._now_ns(), reason, count)

    def close(self, timeout_s: float = 5.0) -> bool:
        """Writes what waits, closes the file in order; whether that was done in time."""
        self._stop.set()
        self._thread.join(timeout_s)
        settled = self._aside.close(timeout_s)
        return settled and not self._thread.is_alive() and not self.tally.trouble

    @property
    def running(self) -> bool:
        """Whether the thread lives."""
        return self._thread.is_alive()

    @property
    def waiting(self) -> int:
        """Records that are in memory and in no file yet."""
        with self._lock:
            return len(self._waiting)

    def mb_per_hour(self) -> float:
        """The size that this drive's log takes an hour, from what it took so far."""
        elapsed_s = max(1.0, (time.time_ns() - self._started_ns) / 1e9)
        return self.tally.stored_bytes / 1e6 / elapsed_s * 3600

    def _run(self) -> None:
        pause_s = min(self._settings.flush_ms, MAX_FLUSH_MS / 2) / 1e3
        while not self._stop.wait(pause_s):
            self._guarded(self._flush)
        self._guarded(self._flush)
        self._guarded(self._finish)
        self.tally.lost += len(self._waiting)  # what could not be written to the last

    def _guarded(self, work: Callable[[], None]) -> None:
        """Runs it; what keeps it from writing is counted and told once, and tried again next time."""
        started_s = time.monotonic()
        try:
            work()
        except Exception as error:  # noqa: BLE001 whatever it is, the thread that writes the log goes on
            self._failed(error)
        self.tally.worst_flush_ms = max(self.tally.worst_flush_ms, (time.monotonic() - started_s) * 1e3)

    def _failed(self, error: Exception) -> None:
        text = f"the log cannot be written: {getattr(error, 'strerror', '') or error or type(error).__name__}"
        if text != self.tally.trouble:
            self.tally.trouble = text
            self._tell(text)

    def _tell(self, text: str) -> None:
        self._aside.put(lambda: self._listener.trouble(text))

    def _flush(self) -> None:
        with self._lock:
            records = list(self._waiting)
        for batch in _batches(records):
            self._append_sound(self._file or self._open(), batch)
        if self._append_gap() or records:
            self._after()

    def _append_gap(self) -> bool:
        """What was lost since the last one; whether there was any. If it cannot be written it waits, wider by what is lost since."""
        with self._lock:
            gap, self._gap = self._gap, None
        if gap is None:
            return False
        self._gaps += 1
        try:
            self._append(self._file or self._open(), [gap_record(gap, sequence=self._gaps)], counted=0)
        except Exception:
            with self._lock:
                since = self._gap
                self._gap = gap if since is None else _widened(gap, since.until_ns, gap.reason, since.lost)
            raise
        return True

    def _append_sound(self, file: LogFile, batch: list[Record]) -> None:
        """The batch, without those of its records that no file takes. Raises OSError; then they may be given again."""
        try:
            self._append(file, batch)
        except OSError:
            raise
        except Exception as error:  # noqa: BLE001 a record that cannot be stored may cost itself, not the log
            if len(batch) == 1:
                self._lose(batch[0], error)
                return
            middle = len(batch) // 2
            self._append_sound(file, batch[:middle])
            self._append_sound(file, batch[middle:])

    def _lose(self, record: Record, error: Exception) -> None:
        """The first record of the queue cannot be stored: it leaves it, is counted, and leaves a gap."""
        with self._lock:
            self._waiting_bytes -= len(record.data)
            del self._waiting[:1]
            self.tally.lost += 1
            self._gap = _widened(self._gap, self._now_ns(), f"a record of {record.topic} cannot be stored: {error}")
        self._refused += 1
        if self._refused in (1, 100, 10_000):
            self._tell(f"{record.topic}: record {record.sequence} cannot be stored and is lost: {error}")

    def _append(self, file: LogFile, batch: list[Record], *, counted: int | None = None) -> None:
        """One flush into the file; only then do its records leave the queue."""
        before = file.size
        head = file.append(batch, now_ns=self._now_ns())
        done = len(batch) if counted is None else counted
        with self._lock:
            self._waiting_bytes -= sum(len(record.data) for record in self._waiting[:done])
            del self._waiting[:done]
        if self.tally.trouble:
            self.tally.trouble = ""
            self._tell("the log is written again")
        self.tally.messages += len(batch)
        self.tally.stored_bytes += file.size - before
        self._sealed(head, file.chained - 1)

    def _sealed(self, head: ChainHead, n: int) -> None:
        self._aside.put(lambda: self._listener.sealed(head, n))

    def _after(self) -> None:
        """Durability and rotation."""
        file, now_s = self._file, time.monotonic()
        if file is None:
            return
        if now_s - self._synced_s >= self._settings.fsync_s:
            self._synced_s = now_s
            self._aside.put(file.sync)
        if file.size >= self._settings.max_file_mb * 1e6 or now_s - self._opened_s >= self._settings.max_file_s:
            self._finish()

    def _open(self) -> LogFile:
        settings = self._settings
        settings.directory.mkdir(parents=True, exist_ok=True)
        if self._previous is None:
            self._previous = log_folder.previous(settings.directory, self._signer)
        name = log_folder.name(self._started_ns, self.tally.files)
        origin = Origin(
            file=name,
            vehicle=settings.vehicle,
            public_key=self._signer.public_hex,
            previous_file=self._previous.file,
            previous_head=self._previous.head,
        )
        raw = self._open_raw(settings.directory / name)
        try:
            self._file = LogFile(raw, origin, self._signer)
        except OSError:
            raw.close()
            (settings.directory / name).unlink(missing_ok=True)
            raise
        self.tally.files += 1
        self._opened_s = self._synced_s = time.monotonic()
        self.tally.file = name
        self._aside.put(lambda: self._retire(name))
        return self._file

    def _retire(self, spare: str) -> None:
        keep, directory = self._settings.retention, self._settings.directory
        log_folder.retire(directory, keep, now_s=time.time(), spare=spare, going=self._listener.retired)

    def _finish(self) -> None:
        """Closes the file in order; the next begins from its head. A file that cannot be closed stays unclosed."""
        file, self._file = self._file, None
        if file is None:
            return
        self._previous = log_folder.Previous(file=file.origin.file, head=file.head.head_sha256)
        try:
            head = file.append([], now_ns=self._now_ns(), closed=True)
            self._previous = log_folder.Previous(file=file.origin.file, head=head.head_sha256)
            self._sealed(head, file.chained - 1)
            file.finish()
        finally:
            self._aside.put(file.release)


def _batches(records: list[Record]) -> Iterator[list[Record]]:
    """Parts of bounded size, so that what piled up does not become one giant chunk."""
    batch, size = list[Record](), 0
    for record in records:
        batch.append(record)
        size += len(record.data)
        if size >= _BATCH_BYTES:
            yield batch
            batch, size = [], 0
    if batch:
        yield batch


def _widened(gap: Gap | None, now_ns: int, reason: str, count: int = 1) -> Gap:
    now_ns = writable_ns(now_ns)
    if gap is None:
        return Gap(lost=count, from_ns=now_ns, until_ns=now_ns, reason=reason)
    return msgspec.structs.replace(gap, lost=gap.lost + count, until_ns=max(gap.until_ns, now_ns))

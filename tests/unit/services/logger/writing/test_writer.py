"""How the log is written: timed flushes, rotation, a disk that is full, a process that is killed."""

import errno
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from proto.health import ChainHead
from services.logger.format import chain, signing
from services.logger.format.reader import messages
from services.logger.verification.verifier import verify
from services.logger.writing import log_folder
from services.logger.writing.log_file import DiskFile, RawFile
from services.logger.writing.topic_formats import Gap
from services.logger.writing.writer import LogWriter, WriterSettings
from tests.unit.services.logger.conftest import record

WAIT_S = 10.0
T = TypeVar("T")


class Heard:
    """A listener that can be waited for."""

    def __init__(self) -> None:
        self.changed = threading.Condition()
        self.heads: list[ChainHead] = []
        self.troubles: list[str] = []
        self.gone: list[str] = []

    def sealed(self, head: ChainHead, n: int) -> None:
        self._add(self.heads, head)

    def trouble(self, text: str) -> None:
        self._add(self.troubles, text)

    def retired(self, path: Path) -> None:
        self._add(self.gone, path.name)

    def wait(self, ready: Callable[[], bool]) -> None:
        with self.changed:
            assert self.changed.wait_for(ready, WAIT_S)

    def _add(self, to: list[T], what: T) -> None:
        with self.changed:
            to.append(what)
            self.changed.notify_all()


class FullDisk:
    """A file on a disk that is full when told so: a write stores a part and fails, as the kernel does."""

    full = False

    def __init__(self, path: Path) -> None:
        self._file = DiskFile(path)

    def write(self, data: bytes) -> None:
        if self.full:
            self._file.write(data[: len(data) // 2])
            raise OSError(errno.ENOSPC, "No space left on device")
        self._file.write(data)

    def truncate(self, size: int) -> None:
        self._file.truncate(size)

    def sync(self) -> None:
        self._file.sync()

    def close(self) -> None:
        self._file.close()


def _writer(
    folder: Path,
    signer: signing.Signer,
    heard: Heard,
    *,
    open_raw: Callable[[Path], RawFile] = DiskFile,
    **settings: float | log_folder.Retention,
) -> LogWriter:
    made = WriterSettings(directory=folder, **({"flush_ms": 10.0} | settings))  # type: ignore[arg-type]
    writer = LogWriter(made, signer, heard, open_raw=open_raw)
    writer.start()
    return writer


def test_what_was_put_is_in_the_file_in_order(tmp_path: Path, signer: signing.Signer) -> None:
    heard = Heard()
    writer = _writer(tmp_path, signer, heard)
    for i in range(500):
        writer.put(record("a", i, i))
    assert writer.close()
    (path,) = log_folder.logs(tmp_path)
    assert [logged.sequence for logged in messages(path)] == list(range(500))
    assert verify(path).closed
    assert heard.heads[-1].closed
    assert heard.heads[-1].head_sha256 == verify(path).head


def test_a_record_is_sealed_without_the_file_being_closed(tmp_path: Path, signer: signing.Signer) -> None:
    heard = Heard()
    writer = _writer(tmp_path, signer, heard)
    writer.put(record("a", 1, 1))
    heard.wait(lambda: bool(heard.heads))
    (path,) = log_folder.logs(tmp_path)
    report = verify(path)
    assert report.intact
    assert not report.closed
    assert report.messages == 1
    writer.close()


def test_full_files_are_followed_by_new_ones_that_go_on_from_their_head(tmp_path: Path, signer: signing.Signer) -> None:
    heard = Heard()
    writer = _writer(tmp_path, signer, heard, max_file_mb=0.01)
    for i in range(30):
        sealed = len(heard.heads)
        writer.put(record("a", i, i, data=bytes(msgspec.json.encode({"x": "y" * 500 + str(i)}))))
        heard.wait(lambda sealed=sealed: len(heard.heads) > sealed)  # type: ignore[misc]
    writer.close()
    paths = log_folder.logs(tmp_path)
    assert len(paths) > 2
    reports = [verify(path) for path in paths]
    assert all(report.closed for report in reports)
    starts = [report.origin.previous_head for report in reports if report.origin]
    assert starts == [chain.ZERO, *(report.head for report in reports[:-1])]
    assert [logged.sequence for path in paths for logged in messages(path)] == list(range(30))


def test_after_a_restart_the_new_file_starts_from_the_old_head_even_if_that_was_cut(
    tmp_path: Path, signer: signing.Signer
) -> None:
    first = _writer(tmp_path, signer, Heard())
    first.put(record("a", 1, 1))
    first.close()
    (old,) = log_folder.logs(tmp_path)
    raw = old.read_bytes()
    head = verify(old).head
    old.write_bytes(raw[: len(raw) - 100])  # the summary is torn, the chain is whole
    second = _writer(tmp_path, signer, Heard())
    second.put(record("a", 2, 2))
    second.close()
    new = log_folder.logs(tmp_path)[-1]
    assert new != old
    origin = verify(new).origin
    assert origin is not None
    assert (origin.previous_file, origin.previous_head) == (old.name, head)


def test_a_full_disk_is_told_once_and_the_log_goes_on_when_there_is_space_again(
    tmp_path: Path, signer: signing.Signer
) -> None:
    class Disk(FullDisk):
        pass

    heard = Heard()
    writer = _writer(tmp_path, signer, heard, open_raw=Disk)
    writer.put(record("a", 0, 0))
    heard.wait(lambda: len(heard.heads) == 1)
    Disk.full = True
    for i in range(1, 20):
        writer.put(record("a", i, i))
    heard.wait(lambda: len(heard.troubles) == 1)
    assert "No space left" in writer.tally.trouble
    assert verify(log_folder.logs(tmp_path)[0]).intact  # no half a flush is left
    assert writer.waiting == 19
    Disk.full = False
    heard.wait(lambda: len(heard.heads) > 1)
    assert writer.close()
    assert writer.waiting == 0
    (path,) = log_folder.logs(tmp_path)
    assert verify(path).closed
    assert [logged.sequence for logged in messages(path)] == list(range(20))
    assert len(heard.troubles) == 2
    assert writer.tally.lost == 0


def test_what_a_full_disk_costs_is_counted_and_stands_in_the_log_as_a_gap(
    tmp_path: Path, signer: signing.Signer
) -> None:
    class Disk(FullDisk):
        full = True

    heard = Heard()
    writer = _writer(tmp_path, signer, heard, open_raw=Disk, queue_mb=0.005)
    for i in range(300):
        writer.put(record("a", i, i, data=b'"' + b"x" * 98 + b'"'))
    heard.wait(lambda: len(heard.troubles) == 1)
    Disk.full = False
    heard.wait(lambda: len(heard.troubles) == 2)
    assert writer.close()
    (path,) = log_folder.logs(tmp_path)
    logged = list(messages(path))
    kept = [one.sequence for one in logged if one.name == "a"]
    (gap,) = [msgspec.json.decode(one.data, type=Gap) for one in logged if one.name == "logger/gap"]
    assert kept == list(range(len(kept)))
    assert gap.lost == writer.tally.lost == 300 - len(kept) > 0
    assert gap.until_ns == 299
    assert verify(path).closed


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(times=st.lists(st.one_of(st.integers(0, 2**63 - 1), st.integers(-(2**70), 2**70)), min_size=1, max_size=12))
def test_a_record_that_cannot_be_stored_costs_itself_and_nothing_else(
    times: list[int], signer: signing.Signer, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder, heard = tmp_path_factory.mktemp("bad"), Heard()
    sound = [i for i, stamp_ns in enumerate(times) if 0 <= stamp_ns < 2**64]
    writer = _writer(folder, signer, heard)
    for i, stamp_ns in enumerate(times):
        writer.put(msgspec.structs.replace(record("a", i, i), publish_time_ns=stamp_ns))
    writer.put(record("a", len(times), 1))
    assert writer.running
    assert writer.close()
    (path,) = log_folder.logs(folder)
    assert verify(path).closed
    logged = list(messages(path))
    assert [one.sequence for one in logged if one.name == "a"] == [*sound, len(times)]
    gaps = [msgspec.json.decode(one.data, type=Gap) for one in logged if one.name == "logger/gap"]
    assert sum(gap.lost for gap in gaps) == writer.tally.lost == len(times) - len(sound)
    assert len(heard.troubles) == min(writer.tally.lost, 1)


def test_what_a_full_queue_loses_leaves_a_gap_whatever_its_times_say(tmp_path: Path, signer: signing.Signer) -> None:
    writer = LogWriter(WriterSettings(directory=tmp_path, flush_ms=10.0, queue_mb=0.0), signer, Heard())
    writer.put(record("a", 1, 1))
    writer.put(record("a", 2, -1))
    writer.start()
    assert writer.close()
    (path,) = log_folder.logs(tmp_path)
    (gap,) = [msgspec.json.decode(one.data, type=Gap) for one in messages(path) if one.name == "logger/gap"]
    assert (gap.lost, gap.from_ns) == (1, 0)


@pytest.mark.parametrize("full", [False, True], ids=["written", "full at first"])
def test_what_is_lost_while_a_gap_is_written_is_counted_once(
    tmp_path: Path, signer: signing.Signer, full: bool
) -> None:
    """Nothing but the gap is to be written; each of the first two writes loses three more."""
    writer: LogWriter
    losing = [True, True]

    class Disk(FullDisk):
        def write(self, data: bytes) -> None:
            if losing:
                losing.pop()
                writer.missed(3, "too many")
                if full and losing:
                    raise OSError(errno.ENOSPC, "No space left on device")
            super().write(data)

    heard = Heard()
    writer = _writer(tmp_path, signer, heard, open_raw=Disk)
    writer.missed(2, "too many")
    heard.wait(lambda: not losing and bool(heard.heads))
    assert writer.close()
    (path,) = log_folder.logs(tmp_path)
    gaps = [msgspec.json.decode(one.data, type=Gap) for one in messages(path) if one.name == "logger/gap"]
    assert [gap.lost for gap in gaps] == ([5, 3] if full else [2, 6])
    assert writer.tally.lost == 8


@pytest.mark.parametrize("error", [ValueError("not this"), RuntimeError()])
def test_a_listener_that_fails_stops_neither_the_log_nor_what_it_is_told_next(
    tmp_path: Path, signer: signing.Signer, error: Exception
) -> None:
    class Failing(Heard):
        def sealed(self, head: ChainHead, n: int) -> None:
            super().sealed(head, n)
            if n == 0:
                raise error

    heard = Failing()
    writer = _writer(tmp_path, signer, heard)
    writer.put(record("a", 1, 1))
    heard.wait(lambda: len(heard.troubles) == 1)
    writer.put(record("a", 2, 2))
    heard.wait(lambda: len(heard.heads) > 1)
    assert writer.close()
    assert verify(log_folder.logs(tmp_path)[0]).messages == 2


def test_a_folder_that_cannot_be_written_never_raises_into_the_drive(tmp_path: Path, signer: signing.Signer) -> None:
    (tmp_path / "file").write_text("")
    heard = Heard()
    writer = _writer(tmp_path / "file" / "logs", signer, heard)
    writer.put(record("a", 1, 1))
    heard.wait(lambda: bool(heard.troubles))
    assert writer.running
    assert not writer.close()
    assert writer.tally.lost == 1


def test_the_oldest_files_are_retired_and_told_of(tmp_path: Path, signer: signing.Signer) -> None:
    heard = Heard()
    for i in range(4):
        writer = _writer(tmp_path, signer, heard, retention=log_folder.Retention(max_total_mb=0.006))
        writer.put(record("a", i, i))
        writer.close()
    left = log_folder.logs(tmp_path)
    assert 1 <= len(left) < 4
    assert len(heard.gone) == 4 - len(left)
    assert [logged.sequence for logged in messages(left[-1])] == [3]


def test_a_file_is_told_of_before_it_is_deleted(tmp_path: Path) -> None:
    (tmp_path / "1.mcap").write_bytes(bytes(2000))
    (tmp_path / "2.mcap").write_bytes(bytes(2000))
    told: list[tuple[str, bool]] = []
    keep = log_folder.Retention(max_total_mb=0.003)
    log_folder.retire(
        tmp_path, keep, now_s=0.0, spare="2.mcap", going=lambda path: told.append((path.name, path.exists()))
    )
    assert told == [("1.mcap", True)]
    assert [path.name for path in log_folder.logs(tmp_path)] == ["2.mcap"]


_CHILD = """
import sys, time
from pathlib import Path
from typing import TypeVar
from services.logger.format import signing
from services.logger.writing.writer import LogWriter, WriterSettings
from tests.unit.services.logger.conftest import record

class Quiet:
    def sealed(self, head, n): print("sealed", head.records, flush=True)
    def trouble(self, text): pass
    def retired(self, path): pass

folder = Path(sys.argv[1])
writer = LogWriter(WriterSettings(directory=folder / "logs"), signing.load_or_make(folder / "secrets"), Quiet())
writer.start()
for i in range(1_000_000):
    writer.put(record("a", i, time.time_ns(), data=b'{"x":"' + b"y" * 2000 + b'"}'))
    time.sleep(0.002)
"""


def test_a_kill_minus_nine_costs_nothing_that_was_sealed(tmp_path: Path) -> None:
    child = subprocess.Popen([sys.executable, "-c", _CHILD, str(tmp_path)], stdout=subprocess.PIPE, text=True)
    assert child.stdout is not None
    never = threading.Timer(60.0, child.kill)
    never.start()
    sealed = next((sealed for line in child.stdout if (sealed := _sealed(line)) >= 200), 0)
    never.cancel()
    child.send_signal(signal.SIGKILL)
    sealed = max([sealed, *map(_sealed, child.stdout.read().splitlines(keepends=True))])
    child.wait(WAIT_S)
    child.stdout.close()
    (path,) = log_folder.logs(tmp_path / "logs")
    report = verify(path)
    assert report.intact
    assert not report.closed
    assert report.messages >= sealed >= 200


def _sealed(line: str) -> int:
    """How many records the child says are sealed; 0 of a line that the kill has cut."""
    return int(line.split()[1]) if line.endswith("\n") else 0


def test_it_pauses_for_at_most_half_of_the_200_ms_that_a_kill_may_cost(tmp_path: Path, signer: signing.Signer) -> None:
    pauses: list[float] = []

    class Stop(threading.Event):
        def wait(self, timeout: float | None = None) -> bool:
            assert timeout is not None
            pauses.append(timeout)
            return super().wait(timeout)

    heard = Heard()
    writer = LogWriter(WriterSettings(directory=tmp_path, flush_ms=60_000.0), signer, heard)
    writer._stop = Stop()
    writer.start()
    writer.put(record("a", 1, 1))
    heard.wait(lambda: bool(heard.heads))
    writer.close()
    assert 0.0 < max(pauses) <= 0.1


@pytest.mark.parametrize("size", [0, 5])
def test_an_empty_or_torn_file_does_not_stop_the_next(tmp_path: Path, signer: signing.Signer, size: int) -> None:
    (tmp_path / "20200101T000000.000Z-000.mcap").write_bytes(b"\x89MCAP0\r\n"[:size])
    writer = _writer(tmp_path, signer, Heard())
    writer.put(record("a", 1, 1))
    assert writer.close()
    assert verify(log_folder.logs(tmp_path)[-1]).closed

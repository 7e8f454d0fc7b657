"""What a long file costs in memory, and that its index is the same however long it was kept."""

import gc
import sys
import tracemalloc
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.records import ChunkIndex

from services.logger.format.container import TIME_MAX_NS, ChunkIndexes, encode
from services.logger.format.signing import Signer
from services.logger.verification.verifier import verify
from services.logger.writing.log_file import DiskFile, LogFile, Origin
from tests.unit.services.logger.conftest import record


class Nowhere:
    """A file of which nothing is kept."""

    def write(self, data: bytes) -> None:
        """Takes it."""

    def truncate(self, size: int) -> None:
        """There is nothing to cut."""

    def sync(self) -> None:
        """There is nothing to keep."""

    def close(self) -> None:
        """There is nothing to close."""


times = st.integers(0, TIME_MAX_NS)
numbers = st.integers(0, 2**63 - 1)
entries = st.builds(
    ChunkIndex,
    chunk_length=st.integers(0, 2**31), chunk_start_offset=st.integers(0, 2**48), compression=st.sampled_from(["", "zstd"]),
    compressed_size=numbers, message_end_time=times, message_index_length=numbers,
    message_index_offsets=st.dictionaries(st.integers(0, 65535), st.integers(0, 2**50), max_size=20),
    message_start_time=times, uncompressed_size=numbers,
)  # fmt: skip


@given(st.lists(entries, max_size=30), st.integers(0, 30))
def test_the_index_is_the_same_as_if_each_entry_had_been_kept(found: list[ChunkIndex], asked: int) -> None:
    kept = ChunkIndexes()
    for number, each in enumerate(found):
        if number == asked:
            assert kept.encoded() == b"".join(map(encode, found[:number]))
        kept.append(each)
    assert kept.encoded() == kept.encoded() == b"".join(map(encode, found))
    assert kept.count == len(found)


@contextmanager
def calls() -> Iterator[Counter[str]]:
    """Counts calls of functions, Python's and C's."""
    counted: Counter[str] = Counter()
    sys.setprofile(lambda frame, event, argument: counted.update((event,)))
    try:
        yield counted
    finally:
        sys.setprofile(None)


def test_a_long_file_is_closed_with_no_more_calls_than_a_short_one(tmp_path: Path, signer: Signer) -> None:
    took = []
    for flushes in (50, 3000):
        path = tmp_path / f"{flushes}.mcap"
        file = LogFile(DiskFile(path), Origin(file=path.name, vehicle="ego", public_key=signer.public_hex), signer)
        for n in range(flushes):
            file.append([record(f"topic/{k}", n, n * 10 + k) for k in range(15)], now_ns=n * 10)
        file.append([], now_ns=flushes * 10, closed=True)
        with calls() as counted:
            file.finish()
        file.release()
        took.append(counted["call"] + counted["c_call"])
        report = verify(path)
        assert (report.closed, report.messages, report.chained) == (True, 15 * flushes, flushes + 1)
        with path.open("rb") as opened:
            summary = make_reader(opened).get_summary()
        assert summary is not None
        assert len(summary.chunk_indexes) == 2 * flushes + 1
    assert took[1] <= took[0] + 20, "written during the drive, not at its end"


def test_an_hour_of_flushes_takes_less_than_five_megabytes(signer: Signer) -> None:
    """Ten a second on fifteen topics; a tenth of an hour of each is measured, at its beginning and later."""
    file = LogFile(Nowhere(), Origin(file="t.mcap", vehicle="ego", public_key=signer.public_hex), signer)

    def flush(first: int, count: int) -> None:
        for n in range(first, first + count):
            file.append(
                [record(f"topic/{k}", n, n * 100_000_000 + k * 7919) for k in range(15)], now_ns=n * 100_000_000
            )

    flush(0, 200)
    tracemalloc.start()
    try:
        gc.collect()  # and what Python keeps of tuples to use them again
        before, _ = tracemalloc.get_traced_memory()
        flush(200, 1800)
        gc.collect()
        after, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert (after - before) / 1800 * 36_000 < 5e6

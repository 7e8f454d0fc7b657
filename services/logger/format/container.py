"""The MCAP container, byte for byte: records, chunks with their indexes, and the summary at the end.

Writer and verifier build the same bytes by the same functions, so the verifier can tell a single changed byte in framing
and summary from what was written. The encoding of the rarer records is the `mcap` package's; files open in any MCAP
reader.
Source: the MCAP format specification, https://mcap.dev/spec
"""

import struct
import zlib
from collections import Counter
from collections.abc import Iterable, Sequence

import msgspec
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    McapRecord,
    MessageIndex,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

MAGIC = b"\x89MCAP0\r\n"
FRAME = struct.Struct("<BQ")
"""Opcode and length before every record's content."""
MESSAGE_HEAD = struct.Struct("<HIQQ")
"""Channel id, sequence, log time and publish time at the start of a message's content."""
TIME_MAX_NS = 2**63 - 1
"""Latest time that is written. MCAP's times are unsigned; databases and viewers take them as signed 64 bits."""
_PACKER = zstandard.ZstdCompressor(level=1)


class Stored(msgspec.Struct, frozen=True, kw_only=True):
    """A record inside a chunk: what its content begins with, and the content as stored. Times in ns."""

    opcode: int
    id: int
    content: bytes
    sequence: int = 0
    log_time_ns: int = 0

    @property
    def raw(self) -> bytes:
        """The record with its frame."""
        return FRAME.pack(self.opcode, len(self.content)) + self.content


def encode(record: McapRecord) -> bytes:
    """One record with its frame."""
    builder = RecordBuilder()
    record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]


def definition(record: Schema | Channel) -> Stored:
    """A schema or channel as it stands in a chunk."""
    opcode = Opcode.SCHEMA if isinstance(record, Schema) else Opcode.CHANNEL
    return Stored(opcode=int(opcode), id=record.id, content=encode(record)[FRAME.size :])


def message(*, channel_id: int, sequence: int, log_time_ns: int, publish_time_ns: int, data: bytes) -> Stored:
    """A message as it stands in a chunk. MCAP counts sequences in 32 bits."""
    sequence &= 0xFFFFFFFF
    head = MESSAGE_HEAD.pack(channel_id, sequence, log_time_ns, publish_time_ns)
    return Stored(
        opcode=int(Opcode.MESSAGE), id=channel_id, content=head + data, sequence=sequence, log_time_ns=log_time_ns
    )


def writable_ns(time_ns: int) -> int:
    """The nearest time that can be written."""
    return min(max(time_ns, 0), TIME_MAX_NS)


class Group(msgspec.Struct, frozen=True, kw_only=True):
    """A chunk with the message indexes that follow it, as bytes, and its entry in the file's index."""

    chunk: bytes
    indexes: bytes
    entry: ChunkIndex
    records: tuple[Stored, ...]

    @property
    def raw(self) -> bytes:
        """All its bytes."""
        return self.chunk + self.indexes


def group(records: Sequence[Stored], *, offset: int, compress: bool) -> Group:
    """The chunk of `records` that is to stand at byte `offset`."""
    payload = b"".join(record.raw for record in records)
    data = _PACKER.compress(payload) if compress else payload
    return frame_group(tuple(records), payload, data, compression="zstd" if compress else "", offset=offset)


def frame_group(records: tuple[Stored, ...], payload: bytes, data: bytes, *, compression: str, offset: int) -> Group:
    """A chunk whose compressed bytes are given: also what a verifier expects around bytes that it has read."""
    start_ns, end_ns = span_ns(records)
    chunk = encode(
        Chunk(
            compression=compression,
            data=data,
            message_start_time=start_ns,
            message_end_time=end_ns,
            uncompressed_crc=zlib.crc32(payload),
            uncompressed_size=len(payload),
        )
    )
    indexes, offsets = _message_indexes(records, first=offset + len(chunk))
    entry = ChunkIndex(
        chunk_length=len(chunk),
        chunk_start_offset=offset,
        compression=compression,
        compressed_size=len(data),
        message_end_time=end_ns,
        message_index_length=len(indexes),
        message_index_offsets=offsets,
        message_start_time=start_ns,
        uncompressed_size=len(payload),
    )
    return Group(chunk=chunk, indexes=indexes, entry=entry, records=records)


def span_ns(records: Iterable[Stored]) -> tuple[int, int]:
    """First and last log time of the messages among `records`; zeros without one."""
    times = [record.log_time_ns for record in records if record.opcode == Opcode.MESSAGE]
    return (min(times), max(times)) if times else (0, 0)


def _message_indexes(records: Iterable[Stored], *, first: int) -> tuple[bytes, dict[int, int]]:
    places: dict[int, list[tuple[int, int]]] = {}
    within = 0
    for record in records:
        if record.opcode == Opcode.MESSAGE:
            places.setdefault(record.id, []).append((record.log_time_ns, within))
        within += FRAME.size + len(record.content)
    parts, offsets, at = [], {}, first
    for channel_id, entries in places.items():
        offsets[channel_id] = at
        parts.append(encode(MessageIndex(channel_id=channel_id, records=entries)))
        at += len(parts[-1])
    return b"".join(parts), offsets


class ChunkIndexes:
    """The entries of a file's chunks as its summary will hold them, packed: an hour has 72,000, 50 MB as objects and some 3 MB here.

    Each is encoded when its chunk is written, so that a long file is closed at once.
    """

    def __init__(self) -> None:
        small = zstandard.ZstdCompressionParameters.from_level(3, window_log=17)  # else a window of 2 MB fills up, too
        self._packer = zstandard.ZstdCompressor(compression_params=small).compressobj()
        self._parts: list[bytes] = []
        self.count = 0

    def append(self, entry: ChunkIndex) -> None:
        """One more."""
        self.count += 1
        if part := self._packer.compress(_encoded(entry)):
            self._parts.append(part)

    def encoded(self) -> bytes:
        """All of them so far, as records, one behind the other."""
        if part := self._packer.flush(zstandard.COMPRESSOBJ_FLUSH_BLOCK):
            self._parts.append(part)
        return zstandard.ZstdDecompressor().decompressobj().decompress(b"".join(self._parts))


def _encoded(entry: ChunkIndex) -> bytes:
    """As `encode`, which takes several times as long and is asked twice a flush."""
    places = [part for place in entry.message_index_offsets.items() for part in place]
    packing = entry.compression.encode()
    content = b"".join((
        struct.pack(
            "<QQQQI", entry.message_start_time, entry.message_end_time, entry.chunk_start_offset, entry.chunk_length,
            5 * len(places),
        ),
        struct.pack("<" + "HQ" * (len(places) // 2), *places),
        struct.pack("<QI", entry.message_index_length, len(packing)), packing,
        struct.pack("<QQ", entry.compressed_size, entry.uncompressed_size),
    ))  # fmt: skip
    return FRAME.pack(Opcode.CHUNK_INDEX, len(content)) + content


class Contents:
    """What a file holds so far, as its summary will tell it."""

    def __init__(self) -> None:
        self.schemas: list[bytes] = []
        self.channels: list[bytes] = []
        self.metadata: list[MetadataIndex] = []
        self.chunks = ChunkIndexes()
        self.counts: Counter[int] = Counter()
        self.start_ns: int | None = None
        self.end_ns = 0

    def add(self, added: Group) -> None:
        """Takes up a chunk that has been written, or read."""
        self.chunks.append(added.entry)
        for record in added.records:
            if record.opcode == Opcode.MESSAGE:
                self.counts[record.id] += 1
            else:
                (self.schemas if record.opcode == Opcode.SCHEMA else self.channels).append(record.raw)
        if any(record.opcode == Opcode.MESSAGE for record in added.records):
            start_ns = added.entry.message_start_time
            self.start_ns = start_ns if self.start_ns is None else min(self.start_ns, start_ns)
            self.end_ns = max(self.end_ns, added.entry.message_end_time)

    def tail(self, *, offset: int, data_crc: int) -> bytes:
        """Everything after the data section, which ends at byte `offset`: data end, summary, footer, magic."""
        data_end = encode(DataEnd(data_crc))
        start = offset + len(data_end)
        summary, offsets = self._summary(start)
        offsets_at = start + len(summary)
        summary += offsets
        footer_head = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, offsets_at)
        crc = zlib.crc32(footer_head, zlib.crc32(summary))
        footer = encode(Footer(summary_start=start, summary_offset_start=offsets_at, summary_crc=crc))
        return data_end + summary + footer + MAGIC

    def _summary(self, start: int) -> tuple[bytes, bytes]:
        groups: tuple[tuple[Opcode, list[bytes]], ...] = (
            (Opcode.SCHEMA, self.schemas),
            (Opcode.CHANNEL, self.channels),
            (Opcode.STATISTICS, [encode(self._statistics())]),
            (Opcode.CHUNK_INDEX, [self.chunks.encoded()]),
            (Opcode.METADATA_INDEX, [encode(index) for index in self.metadata]),
        )
        body, offsets = b"", b""
        for opcode, records in groups:
            part = b"".join(records)
            if part:
                place = SummaryOffset(group_opcode=opcode, group_start=start + len(body), group_length=len(part))
                offsets += encode(place)
                body += part
        return body, offsets

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=0,
            channel_count=len(self.channels),
            channel_message_counts=dict(self.counts),
            chunk_count=self.chunks.count,
            message_count=self.counts.total(),
            message_end_time=self.end_ns,
            message_start_time=self.start_ns or 0,
            metadata_count=len(self.metadata),
            schema_count=len(self.schemas),
        )

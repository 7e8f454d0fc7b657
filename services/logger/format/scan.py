"""Reading a log that may be cut, damaged or forged: no length is trusted, nothing raises but `Unreadable` and `Cut`."""

import mmap
import struct
from collections.abc import Iterator

import msgspec
import zstandard
from mcap.opcode import Opcode

from services.logger.format import container

MAX_CHUNK_BYTES = 48 << 20
"""More than a flush and the largest message that the bus carries."""
"""A chunk that says it is larger is not one of ours."""
_CHUNK_HEAD = struct.Struct("<QQQII")
_U16 = struct.Struct("<H")
_U64 = struct.Struct("<Q")

Buffer = bytes | memoryview | mmap.mmap


class Unreadable(ValueError):
    """These bytes are not what an MCAP record should be."""


class Cut(Unreadable):
    """The bytes end inside a record."""


class Frame(msgspec.Struct, frozen=True, kw_only=True):
    """A record's place in the file: where it begins, where its content begins, where it ends."""

    opcode: int
    start: int
    content: int
    end: int


class Payload(msgspec.Struct, frozen=True, kw_only=True):
    """A chunk, read as far as it can be; `problem` says what stopped that."""

    records: tuple[container.Stored, ...]
    places: tuple[int, ...]
    """Where each record begins in the uncompressed chunk."""
    payload: bytes
    data: bytes
    compression: str
    problem: str = ""


def frame(data: Buffer, at: int) -> Frame:
    """The record that begins at `at`."""
    if at + container.FRAME.size > len(data):
        raise Cut(f"the file ends inside a record's frame at byte {at}")
    opcode, length = container.FRAME.unpack_from(data, at)
    content = at + container.FRAME.size
    if content + length > len(data):
        raise Cut(f"the record at byte {at} says {length} bytes, {len(data) - content} are left")
    return Frame(opcode=opcode, start=at, content=content, end=content + length)


def chunk(data: Buffer, where: Frame) -> Payload:
    """The records of the chunk at `where`. Never raises: what cannot be read becomes the answer's `problem`."""
    try:
        compression, packed = _chunk_parts(bytes(data[where.content : where.end]))
        payload, problem = _unpack(compression, packed)
    except Unreadable as error:
        return Payload(records=(), places=(), payload=b"", data=b"", compression="", problem=str(error))
    records, places = [], []
    try:
        for place, record in split(payload):
            records.append(record)
            places.append(place)
    except Unreadable as error:
        problem = problem or str(error)
    return Payload(
        records=tuple(records),
        places=tuple(places),
        payload=payload,
        data=packed,
        compression=compression,
        problem=problem,
    )


def split(payload: bytes) -> Iterator[tuple[int, container.Stored]]:
    """The records of an uncompressed chunk with their places in it. Raises Unreadable at the first part that is not a record."""
    at = 0
    while at < len(payload):
        where = frame(payload, at)
        content = payload[where.content : where.end]
        yield at, _stored(where.opcode, content)
        at = where.end


def _stored(opcode: int, content: bytes) -> container.Stored:
    if opcode == Opcode.MESSAGE and len(content) >= container.MESSAGE_HEAD.size:
        channel_id, sequence, log_time_ns, _ = container.MESSAGE_HEAD.unpack_from(content)
        return container.Stored(
            opcode=opcode, id=channel_id, sequence=sequence, log_time_ns=log_time_ns, content=content
        )
    if opcode in (Opcode.SCHEMA, Opcode.CHANNEL) and len(content) >= _U16.size:
        return container.Stored(opcode=opcode, id=_U16.unpack_from(content)[0], content=content)
    raise Unreadable(f"a record of kind {opcode} with {len(content)} bytes does not belong in a chunk")


def _chunk_parts(content: bytes) -> tuple[str, bytes]:
    """Compression and compressed bytes of a chunk record's content."""
    try:
        *_, name_length = _CHUNK_HEAD.unpack_from(content)
        name_end = _CHUNK_HEAD.size + name_length
        name = content[_CHUNK_HEAD.size : name_end].decode("ascii")
        (length,) = _U64.unpack_from(content, name_end)
    except (struct.error, UnicodeDecodeError, OverflowError) as error:
        raise Unreadable("the chunk's header cannot be read") from error
    if length != len(content) - name_end - _U64.size:
        raise Unreadable("the chunk's length and its record's length differ")
    return name, content[name_end + _U64.size :]


def _unpack(compression: str, packed: bytes) -> tuple[bytes, str]:
    """The uncompressed bytes, as many as can be had, and what stopped it."""
    if compression == "":
        return packed, ""
    if compression != "zstd":
        raise Unreadable(f"compression {compression!r} is not one we write")
    try:
        if not 0 <= zstandard.get_frame_parameters(packed).content_size <= MAX_CHUNK_BYTES:
            raise Unreadable("the compressed bytes do not say a sensible size")
        return zstandard.ZstdDecompressor().decompress(packed), ""
    except zstandard.ZstdError as error:
        return _unpack_part(packed), f"the compressed bytes are damaged ({error})"


def _unpack_part(packed: bytes) -> bytes:
    """What comes out before the damage; decompression hands out whole blocks, so it may be nothing."""
    unpacker, parts, size = zstandard.ZstdDecompressor().decompressobj(), [], 0
    try:
        for at in range(0, len(packed), 256):
            parts.append(unpacker.decompress(packed[at : at + 256]))
            size += len(parts[-1])
            if size > MAX_CHUNK_BYTES:
                break
    except (zstandard.ZstdError, MemoryError):
        pass
    return b"".join(parts)

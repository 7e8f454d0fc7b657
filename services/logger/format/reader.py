"""Reads the messages of a log in the order in which they were logged, as far as the file can be read. Checks nothing: see verify."""

import mmap
import struct
from collections.abc import Iterator
from contextlib import suppress
from io import BytesIO
from pathlib import Path

import msgspec
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel

from drivemcp.errors import UserError
from proto.topics import TOPICS, Topic
from services.logger.format import chain, container, scan

_PUBLISHED = struct.Struct("<Q")


class Logged(msgspec.Struct, frozen=True, kw_only=True):
    """One message of a log. `name` is its topic with the id filled in."""

    name: str
    sequence: int
    log_time_ns: int
    stamp_ns: int
    data: bytes


def messages(path: Path) -> Iterator[Logged]:
    """Every message but the chain records. Ends where the file ends or can be read no further.

    Raises UserError where this is no log, OSError where it cannot be read.
    """
    if path.stat().st_size < len(container.MAGIC):
        return
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as mapped:
        if mapped[: len(container.MAGIC)] != container.MAGIC:
            raise UserError(f"{path} is no MCAP file")
        names: dict[int, str] = {}
        for record in _records(mapped):
            if record.opcode == Opcode.CHANNEL:
                with suppress(McapError, ValueError, struct.error):
                    names[record.id] = str(Channel.read(ReadDataStream(BytesIO(record.content))).topic)
            elif record.opcode == Opcode.MESSAGE and names.get(record.id, chain.TOPIC) != chain.TOPIC:
                yield _logged(names[record.id], record)


def _records(mapped: mmap.mmap) -> Iterator[container.Stored]:
    at = len(container.MAGIC)
    while at < len(mapped):
        try:
            where = scan.frame(mapped, at)
        except scan.Cut:
            return
        if where.opcode == Opcode.DATA_END:
            return
        if where.opcode == Opcode.CHUNK:
            yield from scan.chunk(mapped, where).records
        at = where.end


def _logged(name: str, record: container.Stored) -> Logged:
    return Logged(
        name=name,
        sequence=record.sequence,
        log_time_ns=record.log_time_ns,
        stamp_ns=_PUBLISHED.unpack_from(record.content, container.MESSAGE_HEAD.size - _PUBLISHED.size)[0],
        data=record.content[container.MESSAGE_HEAD.size :],
    )


def topic_of(name: str) -> Topic[msgspec.Struct] | None:
    """The row of the topic table that a name belongs to."""
    for topic in TOPICS:
        if topic.name == name:
            return topic
    for topic in TOPICS:
        before, id_mark, after = topic.name.partition("<id>")
        if id_mark and name.startswith(before) and name.endswith(after) and len(name) > len(before) + len(after):
            return topic
    return None

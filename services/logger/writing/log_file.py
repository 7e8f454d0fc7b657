"""One log file: records go in by flushes, each sealed by a chain record; a flush that fails leaves it as it was."""

import hashlib
import os
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import msgspec
from mcap.records import Channel, Header, Metadata, MetadataIndex, Schema

from proto.health import ChainHead
from services.logger.format import chain, container
from services.logger.format.signing import Signer

ORIGIN = "drivemcp.log"
"""Name of the metadata record that stands first in a file and says what its chain starts from."""
PROFILE = "drivemcp"


class Form(msgspec.Struct, frozen=True, kw_only=True):
    """How a channel's messages are encoded, and their schema."""

    message_encoding: str
    schema_name: str
    schema_encoding: str
    schema: bytes


class Record(msgspec.Struct, frozen=True, kw_only=True):
    """One message to log. `publish_time_ns` is its source's stamp, `log_time_ns` when the logger had it."""

    topic: str
    form: Form
    sequence: int
    log_time_ns: int
    publish_time_ns: int
    data: bytes


class Origin(msgspec.Struct, frozen=True, kw_only=True):
    """Where a file's chain starts."""

    file: str
    vehicle: str
    public_key: str
    previous_file: str = ""
    previous_head: str = chain.ZERO
    format: str = chain.FORMAT


class RawFile(Protocol):
    """What a log file needs of the file system."""

    def write(self, data: bytes) -> None:
        """Appends all of `data`; raises OSError, perhaps after a part of it."""

    def truncate(self, size: int) -> None:
        """Cuts the file to `size` bytes and goes on from there."""

    def sync(self) -> None:
        """Returns once what was written would outlive a loss of power."""

    def close(self) -> None:
        """Lets go of the file."""


class DiskFile:
    """A new file on disk; refuses to overwrite."""

    def __init__(self, path: Path) -> None:
        self._fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o640)

    def write(self, data: bytes) -> None:
        """Appends all of `data`."""
        rest = memoryview(data)
        while rest:
            rest = rest[os.write(self._fd, rest) :]

    def truncate(self, size: int) -> None:
        """Cuts the file to `size` bytes."""
        os.ftruncate(self._fd, size)
        os.lseek(self._fd, size, os.SEEK_SET)

    def sync(self) -> None:
        """fdatasync."""
        os.fdatasync(self._fd)

    def close(self) -> None:
        """Closes the descriptor."""
        os.close(self._fd)


class LogFile:
    """Writes one file. Nothing in it changes its state unless the bytes are written."""

    def __init__(self, raw: RawFile, origin: Origin, signer: Signer, *, compress: bool = True) -> None:
        self._raw, self._signer, self._compress = raw, signer, compress
        self.origin = origin
        self.head = ChainHead(file=origin.file, records=0, head_sha256=origin.previous_head)
        self.chained = 0
        self.messages = 0
        self.size = 0
        self._contents = container.Contents()
        self._schema_ids: dict[str, int] = {}
        self._channel_ids: dict[str, int] = {}
        self._crc = 0
        self._span_start = 0
        self._span = hashlib.sha256()
        head, opened = opening(origin)
        self._contents.metadata.append(MetadataIndex(offset=len(head), length=len(opened), name=ORIGIN))
        self._write(head + opened)

    def append(self, records: Sequence[Record], *, now_ns: int, closed: bool = False) -> ChainHead:
        """Writes `records` and seals them. Raises OSError; then the file is as before and they may be given again."""
        schema_ids, channel_ids = dict(self._schema_ids), dict(self._channel_ids)
        stored: list[container.Stored] = []
        for record in records:
            stored.append(_message(record, _channel(record.topic, record.form, schema_ids, channel_ids, stored)))
        chain_id = _channel(chain.TOPIC, CHAIN_FORM, schema_ids, channel_ids, stored)
        # nothing to tell but the end: the chain record stands alone
        data = container.group(stored, offset=self.size, compress=self._compress) if stored else None
        before = data.raw if data else b""
        messages = self.messages + len(records)
        sealed = self._seal(before, stored, messages=messages, closed=closed)
        link = container.message(
            channel_id=chain_id,
            sequence=self.chained,
            log_time_ns=now_ns,
            publish_time_ns=now_ns,
            data=chain.encode(sealed),
        )
        seal = container.group([link], offset=self.size + len(before), compress=False)
        self._write(before + seal.raw)
        for part in (data, seal):
            if part:
                self._contents.add(part)
        self._schema_ids, self._channel_ids, self.messages = schema_ids, channel_ids, messages
        self._span_start, self._span = self.size - len(seal.raw), hashlib.sha256(seal.raw)
        self.chained += 1
        self.head = ChainHead(
            file=self.origin.file, records=messages, head_sha256=sealed.head, signature=sealed.signature,
            key_id=sealed.key_id, closed=closed,
        )  # fmt: skip
        return self.head

    def finish(self) -> None:
        """Writes the summary behind a closing chain record. Raises OSError."""
        self._write(self._contents.tail(offset=self.size, data_crc=self._crc))

    def release(self) -> None:
        """Lets go of the file, once it would outlive a loss of power. An unfinished file stays unclosed. Raises OSError."""
        try:
            self._raw.sync()
        finally:
            self._raw.close()

    def sync(self) -> None:
        """Puts what was written beyond a loss of power. Raises OSError."""
        self._raw.sync()

    def _seal(
        self, before: bytes, stored: Sequence[container.Stored], *, messages: int, closed: bool
    ) -> chain.ChainRecord:
        span = self._span.copy()
        span.update(before)
        body = chain.ChainBody(
            n=self.chained,
            previous=self.head.head_sha256,
            start=self._span_start,
            end=self.size + len(before),
            span_sha256=span.hexdigest(),
            entries=tuple(chain.entry(record) for record in stored),
            messages=messages,
            closed=closed,
        )
        return chain.seal(body, key_id=self._signer.key_id, sign=self._signer.sign)

    def _write(self, data: bytes) -> None:
        try:
            self._raw.write(data)
        except Exception:
            self._raw.truncate(self.size)  # a part of it may be there; cutting needs no space
            raise
        self._crc = zlib.crc32(data, self._crc)
        self._span.update(data)
        self.size += len(data)


def opening(origin: Origin) -> tuple[bytes, bytes]:
    """The first bytes of a file: magic and header, then the record that says where its chain starts."""
    fields = {name: str(value) for name, value in msgspec.to_builtins(origin).items()}
    return container.MAGIC + container.encode(Header(PROFILE, PROFILE)), container.encode(Metadata(ORIGIN, fields))


CHAIN_FORM = Form(
    message_encoding="json",
    schema_name="drivemcp.ChainRecord",
    schema_encoding="jsonschema",
    schema=msgspec.json.encode(
        {
            "type": "object",
            "required": ["body", "head", "key_id", "signature"],
            "properties": {
                "body": msgspec.json.schema(chain.ChainBody)["$defs"]["ChainBody"] | {"title": "ChainBody"},
                "head": {"type": "string"},
                "key_id": {"type": "string"},
                "signature": {"type": "string"},
            },
            "$defs": {"Entry": msgspec.json.schema(chain.Entry)["$defs"]["Entry"]},
        }
    ),
)


def _channel(
    topic: str,
    form: Form,
    schema_ids: dict[str, int],
    channel_ids: dict[str, int],
    stored: list[container.Stored],
) -> int:
    """The id of a topic's channel; defined in `stored` where it is new to the file."""
    known = channel_ids.get(topic)
    if known is not None:
        return known
    schema_id = schema_ids.get(form.schema_name)
    if schema_id is None:
        schema_id = schema_ids[form.schema_name] = len(schema_ids) + 1
        schema = Schema(id=schema_id, data=form.schema, encoding=form.schema_encoding, name=form.schema_name)
        stored.append(container.definition(schema))
    channel_id = channel_ids[topic] = len(channel_ids) + 1
    channel = Channel(
        id=channel_id, topic=topic, message_encoding=form.message_encoding, metadata={}, schema_id=schema_id
    )
    stored.append(container.definition(channel))
    return channel_id


def _message(record: Record, channel_id: int) -> container.Stored:
    return container.message(
        channel_id=channel_id,
        sequence=record.sequence,
        log_time_ns=record.log_time_ns,
        publish_time_ns=record.publish_time_ns,
        data=record.data,
    )

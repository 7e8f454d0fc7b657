"""The hash chain, pure: what one chain record says, and how heads follow from each other.

A flush writes one chunk of records and behind it, uncompressed, one chain record. Its body lists every record of the
flush (kind, id, sequence, log time, SHA-256 of the stored content) and the SHA-256 of all file bytes since the last
chain record's chunk began. The head is SHA-256(previous head, body); the head is signed. So a record cannot be changed,
dropped, inserted or moved without the next head differing, and heads cannot be made anew without the key.
"""

import hashlib
from collections.abc import Callable

import msgspec

from services.logger.format.container import Stored

FORMAT = "drivemcp-chain-1"
TOPIC = "logger/chain"
ZERO = "00" * 32
"""The previous head of a vehicle's first file."""


class Entry(msgspec.Struct, frozen=True, kw_only=True, array_like=True):
    """One record as the chain knows it. Opcodes are MCAP's: 3 schema, 4 channel, 5 message; the hash is the content's."""

    opcode: int
    id: int
    sequence: int
    log_time_ns: int
    sha256: str


class ChainBody(msgspec.Struct, frozen=True, kw_only=True):
    """What one chain record vouches for. `start` to `end` are the file's bytes whose hash is `span_sha256`."""

    n: int
    previous: str
    start: int
    end: int
    span_sha256: str
    entries: tuple[Entry, ...]
    messages: int
    """Messages in the file up to here, chain records not counted."""
    closed: bool = False
    """The last chain record of a file that was closed in order."""


class ChainRecord(msgspec.Struct, frozen=True, kw_only=True):
    """As stored: the body's own bytes, so that nothing need be put in canonical form to check them."""

    body: msgspec.Raw
    head: str
    key_id: str
    signature: str


def entry(record: Stored) -> Entry:
    """How a stored record is listed."""
    return Entry(
        opcode=record.opcode,
        id=record.id,
        sequence=record.sequence,
        log_time_ns=record.log_time_ns,
        sha256=hashlib.sha256(record.content).hexdigest(),
    )


def next_head(previous: str, body: bytes) -> str:
    """The head that follows `previous` (hex) when `body` is sealed."""
    return hashlib.sha256(FORMAT.encode() + bytes.fromhex(previous) + body).hexdigest()


def signed_text(head: str) -> bytes:
    """The bytes that a signature of `head` is made over; names their purpose so that it fits nothing else."""
    return f"{FORMAT} head {head}".encode()


def seal(body: ChainBody, *, key_id: str, sign: Callable[[bytes], str]) -> ChainRecord:
    """The chain record of `body`."""
    raw = msgspec.json.encode(body)
    head = next_head(body.previous, raw)
    return ChainRecord(body=msgspec.Raw(raw), head=head, key_id=key_id, signature=sign(signed_text(head)))


def encode(record: ChainRecord) -> bytes:
    """As stored."""
    return msgspec.json.encode(record)


def decode(stored: bytes) -> tuple[ChainRecord, ChainBody]:
    """A stored chain record and its body. Raises ValueError where the bytes are not exactly what `encode` gives."""
    record = msgspec.json.decode(stored, type=ChainRecord)
    body = msgspec.json.decode(record.body, type=ChainBody)
    if encode(record) != stored or msgspec.json.encode(body) != bytes(record.body):
        raise ValueError("not in the form in which chain records are written")
    return record, body

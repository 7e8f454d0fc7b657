"""The verifier's pass over one file: what it finds wrong ends the pass and is kept as the first bad place."""

import hashlib
import mmap
import re
import struct
import zlib
from collections.abc import Iterable, Sequence
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import NoReturn

import msgspec
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, MetadataIndex

from services.logger.format import chain, container, scan, signing, time_stamp
from services.logger.verification.report import UNSEALED, Found, Place, Report, What, first_difference
from services.logger.writing.log_file import ORIGIN, Origin, opening
from services.logger.writing.topic_formats import GAP_TOPIC, Gap

_LINK_START = re.compile(rb'\{"body":\{"n":(\d{1,18}),')
_LINK_END = re.compile(rb'"signature":"[0-9a-f]{128}"\}')
_PARSING = (McapError, ValueError, IndexError, struct.error, msgspec.MsgspecError)


class _Bad(Exception):
    def __init__(self, place: Place) -> None:
        super().__init__(str(place))
        self.place = place


class _Read(msgspec.Struct, frozen=True, kw_only=True):
    """A chunk and the message indexes behind it, as read, and as they should be around what was read."""

    start: int
    end: int
    payload: scan.Payload
    group: container.Group
    problem: str
    cut: bool
    """The file ends inside its indexes, and all of them that is there is as it should be."""

    @property
    def found(self) -> list[Found]:
        """Its records as the comparison takes them."""
        pairs = zip(self.payload.records, self.payload.places, strict=True)
        return [Found(entry=chain.entry(record), start=self.start, place=place) for record, place in pairs]

    @property
    def link(self) -> bytes:
        """The stored chain record, if that is what the chunk holds."""
        records = self.payload.records
        if self.payload.compression == "" and len(records) == 1 and records[0].opcode == Opcode.MESSAGE:
            data = records[0].content[container.MESSAGE_HEAD.size :]
            return data if data.startswith(b'{"body":{') else b""
        return b""


class Walk:
    """One pass. `good` is the byte up to which chain records vouch for everything."""

    def __init__(
        self,
        data: memoryview,
        mapped: mmap.mmap,
        *,
        expected_heads: frozenset[str],
        public_key: str,
        sought: frozenset[str],
    ) -> None:
        self._data, self._mapped = data, mapped
        self._expected_heads, self._public_key = set(expected_heads), public_key
        self._sought, self._stamped = sought, dict[str, int]()
        self._origin: Origin | None = None
        self._contents = container.Contents()
        self._topics: dict[int, str] = {}
        self._head, self._n, self._messages, self._key_id = chain.ZERO, 0, 0, ""
        self._span_start, self._good = 0, 0
        self._closing = self._closed = False
        self._lost, self._lost_why = 0, ""
        self._bad: Place | None = None

    def run(self) -> None:
        """Reads up to the end or to the first bad place."""
        try:
            self._opening()
            if self._origin is not None:
                self._flushes()
            if self._n == 0 and not self._expected_heads:
                raise _Bad(UNSEALED)
        except _Bad as found:
            self._bad = found.place

    def report(self, name: str) -> Report:
        """What the pass came to."""
        whole = self._closed or self._bad is not None
        return Report(
            file=name,
            size=len(self._data),
            messages=self._messages,
            chained=self._n,
            head=self._head,
            origin=self._origin,
            key_id=self._key_id,
            closed=self._closed,
            tail_bytes=0 if whole else len(self._data) - self._good,
            first_bad=self._bad,
            expected_head_missing=self._bad is None and bool(self._expected_heads),
            stamped=self._stamped,
            lost=self._lost,
            lost_why=self._lost_why,
        )

    def _opening(self) -> None:
        """Magic, header, origin: exactly as we write them; what they say is vouched for by the first chain record."""
        try:
            header = scan.frame(self._data, len(container.MAGIC))
            where = scan.frame(self._data, header.end)
            fields = Metadata.read(_stream(self._data[where.content : where.end])).metadata
            origin = msgspec.convert(fields, Origin)
            head, opened = opening(origin)
        except scan.Cut:
            if container.MAGIC.startswith(bytes(self._data[: len(container.MAGIC)])) and not self._stored_link(0):
                return  # cut before the opening was whole: nothing is in it yet
            self._damaged(0, "this is not the opening of a log")
        except _PARSING:
            self._damaged(0, "this is not the opening of a log")
        if self._data[: where.end] != head + opened:
            self._damaged(0, "the file's opening is not as it is written")
        if self._public_key and origin.public_key != self._public_key:
            self._damaged(header.end, f"signed by key {_key_id(origin.public_key)}, not by the expected one")
        self._origin, self._head, self._good = origin, origin.previous_head, where.end
        self._contents.metadata.append(MetadataIndex(offset=len(head), length=len(opened), name=ORIGIN))

    def _flushes(self) -> None:
        """Chunk after chunk, each flush up to its chain record; then the end, if there is one."""
        at, pending = self._good, list[_Read]()
        while at < len(self._data):
            try:
                where = scan.frame(self._data, at)
                if where.opcode == Opcode.DATA_END:
                    return self._end(at, pending)
                if where.opcode != Opcode.CHUNK or self._closing:
                    self._blame(pending, at, f"a record of kind {where.opcode} that was not written here", "inserted")
                read = self._group(where)
            except scan.Cut as cut:
                return self._cut(at, pending, str(cut))
            if read.cut and read.link:
                self._vouched(pending, read)  # its flush must hold, though it is not whole
                return None
            if read.cut:
                return self._cut(at, pending, f"the file ends inside the index of the chunk at byte {at}")
            at = read.end
            if read.link:
                self._flush(pending, read)
                self._good, pending = at, []
            else:
                pending.append(read)
        return self._cut(at, pending, "the file ends before a chain record") if pending else None

    def _group(self, where: scan.Frame) -> _Read:
        """A chunk and the message indexes behind it. Raises Cut where a frame reaches past the end."""
        payload = scan.chunk(self._data, where)
        group = container.frame_group(
            payload.records, payload.payload, payload.data, compression=payload.compression, offset=where.start
        )
        rest = bytes(self._data[where.start : where.start + len(group.raw)])
        cut = rest != group.raw and group.raw.startswith(rest)
        end = len(self._data) if cut else where.end
        while end < len(self._data) and self._data[end] == Opcode.MESSAGE_INDEX:
            end = scan.frame(self._data, end).end
        same = cut or bytes(self._data[where.start : end]) == group.raw
        problem = payload.problem or ("" if same else "the framing around it is changed")
        return _Read(start=where.start, end=end, payload=payload, group=group, problem=problem, cut=cut)

    def _flush(self, pending: list[_Read], read: _Read) -> None:
        """Takes one flush for good, if it holds."""
        record, body = self._vouched(pending, read)
        for part in (*pending, read):
            self._contents.add(part.group)
        self._messages, self._n, self._head, self._key_id = body.messages, self._n + 1, record.head, record.key_id
        self._span_start, self._closing = read.start, body.closed
        self._expected_heads.discard(record.head)
        if self._sought and (imprint := time_stamp.imprint(record.head)) in self._sought:
            self._stamped[imprint] = body.messages
        self._gaps(pending)

    def _gaps(self, pending: list[_Read]) -> None:
        """Adds up what the logger itself says is missing; the records are vouched for, their topics known."""
        for record in (record for part in pending for record in part.payload.records):
            if record.opcode == Opcode.MESSAGE and self._topics.get(record.id) == GAP_TOPIC:
                gap = msgspec.json.decode(record.content[container.MESSAGE_HEAD.size :], type=Gap)
                self._lost, self._lost_why = self._lost + gap.lost, self._lost_why or gap.reason

    def _vouched(self, pending: list[_Read], read: _Read) -> tuple[chain.ChainRecord, chain.ChainBody]:
        """Checks one flush against its chain record: first the chain record itself, then all that it vouches for."""
        record, body = self._own_checks(read)
        self._position(body, read.start)
        self._compare(body.entries, pending, at=read.start)
        self._span(pending, body, at=read.start)
        self._message_head(pending, read, body)
        counted = self._messages + sum(entry.opcode == Opcode.MESSAGE for entry in body.entries)
        if body.messages != counted:
            self._chain_record("changed", read.start, "its count of messages is wrong")
        return record, body

    def _own_checks(self, read: _Read) -> tuple[chain.ChainRecord, chain.ChainBody]:
        """The chain record fits its own hash, form, framing and signature."""
        assert self._origin is not None
        public_key = self._origin.public_key
        try:
            record, body = chain.decode(read.link)
            hashed = not read.problem and record.head == chain.next_head(body.previous, bytes(record.body))
        except ValueError:
            self._chain_record("changed", read.start, "it is not in the form in which chain records are written")
        if not hashed:
            self._chain_record("changed", read.start, read.problem or "it does not fit its own hash")
        signed = signing.signature_holds(public_key, chain.signed_text(record.head), record.signature)
        if not signed or record.key_id != _key_id(public_key):
            if self._n == body.n == 0 and not self._span_holds(body):
                self._damaged(0, "the file's opening is not as it was written")
            self._chain_record("changed", read.start, "its signature is not the log's key's")
        return record, body

    def _message_head(self, pending: list[_Read], read: _Read, body: chain.ChainBody) -> None:
        """What stands before its text, outside its signature: the chain's channel, its number, and twice one time."""
        for part in pending:
            self._learn_topics(part.payload.records)
        head = container.MESSAGE_HEAD.unpack_from(read.payload.records[0].content)
        channel, sequence, logged_ns, published_ns = head
        if (self._topics.get(channel), sequence, published_ns) != (chain.TOPIC, body.n & 0xFFFFFFFF, logged_ns):
            self._chain_record("changed", read.start, "its channel, number or times are not a chain record's")

    def _position(self, body: chain.ChainBody, at: int) -> None:
        """The chain record is the one that comes next."""
        if body.n > self._n and self._stored_link(at, number=self._n):
            self._chain_record("reordered", at, f"chain record {self._n} stands later; {body.n} stands here")
        if body.n > self._n:
            lost = body.messages - sum(e.opcode == Opcode.MESSAGE for e in body.entries) - self._messages
            self._chain_record("dropped", at, f"it is gone, with or without the {lost} messages that it listed")
        if body.n < self._n:
            self._chain_record("inserted", at, f"a copy of chain record {body.n}, which stood before")
        if body.previous != self._head and self._n == 0:
            self._damaged(0, "the file's opening names another head to start from than the chain does")
        if body.previous != self._head:
            self._chain_record("changed", at, "it does not continue from the head before it")

    def _compare(self, listed: Sequence[chain.Entry], pending: list[_Read], *, at: int, stopped: str = "") -> None:
        """The records that stand there are the listed ones, in their order. `stopped`: why no more could be read."""
        problem = next((part.problem for part in pending if part.payload.problem), stopped)
        found = [one for part in pending for one in part.found]
        difference = first_difference(listed, found, unreadable=bool(problem))
        if difference is None:
            return
        for part in pending:
            self._learn_topics(part.payload.records)
        place = difference.found
        offset = place.start if place else pending[0].start if pending else at
        where = f"byte {place.place} of its chunk" if place else "nothing stands in its place"
        self._record(difference.what, difference.entry, offset, problem or where)

    def _span(self, pending: list[_Read], body: chain.ChainBody, *, at: int) -> None:
        """The raw bytes since the last chain record's chunk; the records in them are already known to be right."""
        if (body.start, body.end) != (self._span_start, at):
            self._damaged(self._good, f"bytes {body.start} to {body.end} were written here; {at} is where they end")
        if not self._span_holds(body):
            start = next((part.start for part in pending if part.problem), self._span_start)
            self._damaged(start, f"the framing between bytes {start} and {at} is changed; the records in it are not")

    def _span_holds(self, body: chain.ChainBody) -> bool:
        return hashlib.sha256(self._data[body.start : body.end]).hexdigest() == body.span_sha256

    def _end(self, at: int, pending: list[_Read]) -> None:
        """Data end, summary, footer: exactly what the data makes them."""
        if pending or not self._closing:
            self._blame(pending, at, "the file has an end, but its closing chain record is gone", "dropped")
        expected = self._contents.tail(offset=at, data_crc=zlib.crc32(self._data[:at]))
        found = bytes(self._data[at:])
        self._closed = found == expected
        if self._closed:
            self._good = len(self._data)
        elif not expected.startswith(found):  # else it was cut while closing
            pairs = enumerate(zip(expected, found, strict=False))
            same = next((i for i, (one, other) in pairs if one != other), len(expected))
            self._damaged(at + same, "the summary is not what the data makes it; all records are as written")

    def _cut(self, at: int, pending: list[_Read], why: str) -> None:
        """No more can be read: the file was cut, unless a chain record behind the last good one shows a changed length."""
        if self._stored_link(self._good) or bytes(self._data[-len(container.MAGIC) :]) == container.MAGIC:
            start = next((part.start for part in pending if part.problem), at)
            self._blame(pending, start, why, "damaged")

    def _blame(self, pending: list[_Read], at: int, why: str, what: What) -> NoReturn:
        """Names the first record that is missing here, if the next chain record can be found; else the byte."""
        stored = self._stored_link(self._good, number=self._n)
        if stored:
            self._compare(chain.decode(stored)[1].entries, pending, at=at, stopped=why)
        before = f"the last good chain record is {self._n - 1}" if self._n else "no chain record stands before it"
        raise _Bad(Place(what=what, offset=at, detail=f"{why}; {before}"))

    def _stored_link(self, at: int, *, number: int | None = None) -> bytes:
        """The first whole, signed chain record behind byte `at` that is not one of those read; empty without one.

        It is found by its text, wherever it stands. `number`: exactly the one of this number.
        """
        starts = [(int(match[1]), match.start()) for match in _LINK_START.finditer(self._mapped, at)]
        for (n, start), (_, end) in pairwise([*starts, (0, len(self._data))]):
            if n == number if number is not None else n >= self._n:
                last = _LINK_END.search(self._mapped, start, end)
                stored = bytes(self._data[start : last.end()]) if last else b""
                if stored and self._is_signed(stored):
                    return stored
        return b""

    def _is_signed(self, stored: bytes) -> bool:
        """Whether it is in the form of a chain record, and signed by the log's key as far as that is known."""
        try:
            record, body = chain.decode(stored)
            hashed = record.head == chain.next_head(body.previous, bytes(record.body))
        except ValueError:
            return False
        key = self._origin.public_key if self._origin else self._public_key
        return hashed and (not key or signing.signature_holds(key, chain.signed_text(record.head), record.signature))

    def _learn_topics(self, records: Iterable[container.Stored]) -> None:
        for record in records:
            if record.opcode == Opcode.CHANNEL:
                try:
                    self._topics[record.id] = Channel.read(_stream(record.content)).topic
                except _PARSING:
                    continue  # a damaged definition: its messages are named by the channel's number

    def _record(self, what: What, entry: chain.Entry, offset: int, detail: str) -> NoReturn:
        if entry.opcode == Opcode.MESSAGE:
            topic = self._topics.get(entry.id, f"channel {entry.id}")
            place = Place(
                what=what,
                topic=topic,
                sequence=entry.sequence,
                log_time_ns=entry.log_time_ns,
                offset=offset,
                detail=detail,
            )
        else:
            kind = "schema" if entry.opcode == Opcode.SCHEMA else "channel"
            place = Place(what=what, topic=f"the definition of {kind} {entry.id}", offset=offset, detail=detail)
        raise _Bad(place)

    def _chain_record(self, what: What, offset: int, detail: str) -> NoReturn:
        raise _Bad(Place(what=what, topic=chain.TOPIC, sequence=self._n, offset=offset, detail=detail))

    def _damaged(self, offset: int, detail: str) -> NoReturn:
        raise _Bad(Place(what="damaged", offset=offset, detail=detail))


def _stream(content: bytes | memoryview) -> ReadDataStream:
    return ReadDataStream(BytesIO(bytes(content)))


def _key_id(public_key: str) -> str:
    try:
        return signing.key_id(public_key)
    except ValueError:
        return "(no key)"


def verify(
    path: Path,
    *,
    expected_head: str = "",
    public_key: str = "",
    anchored: frozenset[str] = frozenset(),
    sought: frozenset[str] = frozenset(),
) -> Report:
    """Reads the whole file. `expected_head` and all of `anchored` must be among its heads; `public_key` (hex) must have signed.

    Imprints that are `sought` and of one of its heads stand in `stamped`.

    Raises OSError where the file cannot be read.
    """
    expected = anchored | {expected_head} if expected_head else anchored
    if path.stat().st_size == 0:
        bad = None if expected else UNSEALED
        return Report(file=str(path), size=0, first_bad=bad, expected_head_missing=bool(expected))
    with (
        path.open("rb") as file,
        mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as mapped,
        memoryview(mapped) as data,
    ):
        walk = Walk(data, mapped, expected_heads=expected, public_key=public_key, sought=sought)
        walk.run()
        return walk.report(str(path))

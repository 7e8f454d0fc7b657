"""What a log leaves out for privacy: hashed with the logger's key, so that the owner of the originals can prove that they are meant.

A plain hash of a speed could be found by trying all speeds; a keyed one cannot, without the key.
"""

import hashlib
import hmac
from collections.abc import Iterator

import msgspec

from proto import topics
from proto.decision import Advisory, Decision, TraceRecord
from services.logger.writing.log_file import Record
from services.logger.writing.topic_formats import json_form

TOPIC = "logger/withheld"
KEPT = frozenset(topic.name for topic in (topics.HEALTH, topics.LOG, topics.CALLS, topics.SCENARIO, topics.BRAKE))
"""Topics that tell neither speed nor place. Pictures have a rule of their own."""
EVERY_NS = 10_000_000_000


class Withheld(msgspec.Struct, frozen=True, kw_only=True):
    """Messages of one topic that the log does not hold: how many, until when, and the hash that binds them.

    `hmac_sha256`: over each message's length (8 bytes, little-endian) and JSON data, in their order, with `Signer.withholding_key`.
    """

    topic: str
    count: int
    from_sequence: int
    until_ns: int
    hmac_sha256: str


def is_kept(topic: topics.Topic[msgspec.Struct], message: msgspec.Struct) -> bool:
    """Whether a message stays: what tells of no way driven, and each tick that spoke, braked or was kept from braking."""
    if topic.name in KEPT or topic.logged == "foxglove_image":
        return True
    if isinstance(message, TraceRecord):
        return _acts(message.decision) or _acts(message.advisory)
    return isinstance(message, Decision | Advisory) and _acts(message)


def _acts(word: Decision | Advisory) -> bool:
    return word.kind != "SILENT" or bool(word.act_withheld)


class Withholding:
    """The running hashes. Call it on one thread."""

    def __init__(self, key: bytes) -> None:
        self._key = key
        self._running: dict[str, _Running] = {}
        self._sequence = 0

    def take(self, record: Record) -> Iterator[Record]:
        """Hash a record in place of keeping it; gives the record of a stretch of that topic that is over."""
        running = self._running.get(record.topic)
        if running is not None and record.log_time_ns - running.began_ns >= EVERY_NS:
            yield self._over(record.topic)
            running = None
        if running is None:
            running = self._running[record.topic] = _Running(self._key, record)
        running.add(record)

    def rest(self) -> list[Record]:
        """The stretches that are not over, at the end."""
        return [self._over(topic) for topic in list(self._running)]

    def _over(self, topic: str) -> Record:
        running = self._running.pop(topic)
        self._sequence += 1
        told = Withheld(
            topic=topic,
            count=running.count,
            from_sequence=running.first.sequence,
            until_ns=running.until_ns,
            hmac_sha256=running.hash.hexdigest(),
        )
        return Record(
            topic=TOPIC,
            form=json_form(Withheld),
            sequence=self._sequence,
            log_time_ns=running.until_ns,
            publish_time_ns=running.until_ns,
            data=msgspec.json.encode(told),
        )


class _Running:
    def __init__(self, key: bytes, first: Record) -> None:
        self.first, self.began_ns, self.until_ns, self.count = first, first.log_time_ns, first.log_time_ns, 0
        self.hash = hmac.new(key, digestmod=hashlib.sha256)

    def add(self, record: Record) -> None:
        self.hash.update(len(record.data).to_bytes(8, "little") + record.data)
        self.until_ns, self.count = max(self.until_ns, record.log_time_ns), self.count + 1

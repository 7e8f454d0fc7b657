"""What a run's messages leave behind: taken from the bus as they pass, or from the log and the truth kept beside it."""

import gzip
import hashlib
import zlib
from bisect import bisect_right
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Generic, NamedTuple, TypeVar

import msgspec

from domain.hearing import Hearing
from drivemcp.bus.received import Received, decode
from drivemcp.errors import MALFORMED, UserError
from drivemcp.node import Node
from proto import topics
from proto.decision import Advisory, Decision, Event
from proto.tools import CallStatus
from proto.topics import Topic
from proto.truth import Corrupted, Truth
from proto.weather import Conditions
from services.logger.format.reader import messages, topic_of

DAMAGED = (OSError, EOFError, zlib.error)
"""What reading a run's compressed files raises: the file is not there or no gzip file, is cut, or is spoiled."""
M = TypeVar("M", bound=msgspec.Struct)
TRUTH_FILE = "truth.msgpack.gz"
"""Truth is never logged, so that nothing can read it from a log; the evaluation keeps it in a file of its own."""


class At(NamedTuple, Generic[M]):
    """A message and when it was published, in seconds since the start of the run."""

    time_s: float
    message: M


class Call(msgspec.Struct, frozen=True, kw_only=True):
    """Of an outcome in a trace, what is measured."""

    tool: str
    status: CallStatus


class Tick(msgspec.Struct, frozen=True, kw_only=True):
    """Of a trace, what is measured: a hundredth of its size."""

    tick: int
    events: tuple[Event, ...]
    calls: tuple[Call, ...]


@dataclass(frozen=True, kw_only=True)
class Record:
    """One run. Each list is in the order of time; without truth, `truths` is empty and what needs it is not measured."""

    truths: tuple[Truth, ...] = ()
    """20 a second; their own `time_s` counts."""
    advisories: tuple[At[Advisory], ...] = ()
    """One a tick, silent ones included."""
    decisions: tuple[At[Decision], ...] = ()
    traces: tuple[At[Tick], ...] = ()
    conditions: tuple[At[Conditions], ...] = ()
    corrupted: tuple[At[Corrupted], ...] = ()
    """What the evaluation did to it."""

    @cached_property
    def spoken(self) -> tuple[At[Advisory], ...]:
        """The messages that the driver hears, as the cockpit speaks them."""
        return tuple(each for each, heard in self.told if heard)

    @cached_property
    def told(self) -> tuple[tuple[At[Advisory], bool], ...]:
        """The same with where each intervention begins, and whether each is heard."""
        hearing = Hearing()
        judged = [
            (each, hearing.hears(each.message, round(each.time_s * 1e9)), hearing.begins) for each in self.advisories
        ]
        return tuple((each, heard) for each, heard, begins in judged if heard or begins)

    def outcome(self) -> str:
        """A digest of truths, advisories, decisions, traces and conditions, in hex: runs that came out alike have the same digest.

        The last tick's decision may come after the end of the log, so the digest leaves it out.
        """
        last_s = max((each.time_s for each in self.advisories), default=0.0)
        decisions = [each for each in self.decisions if each.time_s < last_s]
        told = (self.truths, self.advisories, decisions, self.traces, self.conditions)
        return hashlib.sha256(msgspec.json.encode(told, order="deterministic")).hexdigest()

    @cached_property
    def _times_s(self) -> list[float]:
        return [truth.time_s for truth in self.truths]

    def truth_at(self, time_s: float) -> Truth | None:
        """The newest truth at that instant; before the first one, the first."""
        if not self.truths:
            return None
        return self.truths[max(0, bisect_right(self._times_s, time_s + 1e-6) - 1)]

    def truths_between(self, from_s: float, to_s: float) -> tuple[Truth, ...]:
        """Those from one instant to another, both included."""
        start = bisect_right(self._times_s, from_s - 1e-6)
        return self.truths[start : bisect_right(self._times_s, to_s + 1e-6)]


_FOLLOWED: tuple[Topic[Any], ...] = (
    topics.TRUTH,
    topics.ADVISORY,
    topics.DECISION,
    topics.TRACE,
    topics.CONDITIONS,
    topics.CORRUPTED,
)
_TICK = msgspec.json.Decoder(Tick)


@dataclass(slots=True)
class Recorder:
    """Collects a run's messages as they pass; `record` is what has come so far."""

    _found: dict[str, list[tuple[int, Any]]] = field(default_factory=dict)

    def follow(self, node: Node) -> None:
        """Subscribe to all that is measured; hand this to `evaluation.run.host.drive`."""
        for topic in _FOLLOWED:
            self._found[topic.name] = []
            node.subscribe_raw(topic, self._into(topic))

    def _into(self, topic: Topic[Any]) -> Callable[[Received[Any]], None]:
        found = self._found[topic.name]
        read = _TICK.decode if topic is topics.TRACE else partial(decode, topic)

        def add(received: Received[Any]) -> None:
            found.append((received.stamp_ns, read(received.payload)))

        return add

    def start_ns(self) -> int:
        """The stamp of the run's instant 0."""
        return _start_ns(self._found)

    def record(self) -> Record:
        """The run so far."""
        return _record(self._found)


def from_log(log: Path) -> Record:
    """A run from its MCAP file and, where it lies in the same folder, the truth that `keep` wrote.

    Raises UserError where a message does not fit this version or the truth is damaged, OSError where a file cannot be read.
    """
    found: dict[str, list[tuple[int, Any]]] = {topic.name: [] for topic in _FOLLOWED}
    for logged in messages(log):
        topic = topic_of(logged.name)
        if topic is not None and topic.name in found:
            found[topic.name].append((logged.stamp_ns, _decoded(topic, logged.data, log)))
    truth = log.parent / TRUTH_FILE
    if truth.exists():
        found[topics.TRUTH.name] = _kept(truth)
    return _record(found)


def keep(recorder: Recorder, folder: Path) -> Path:
    """Write the truth of a run beside its log; the file's path."""
    path = folder / TRUTH_FILE
    rows = recorder._found.get(topics.TRUTH.name, [])
    path.write_bytes(gzip.compress(msgspec.msgpack.encode(rows), mtime=0))
    return path


def _kept(path: Path) -> list[tuple[int, Any]]:
    packed = path.read_bytes()
    try:
        return list(msgspec.msgpack.decode(gzip.decompress(packed), type=list[tuple[int, Truth]]))
    except DAMAGED as error:
        raise UserError(f"{path}: the truth is damaged: {error}") from None
    except MALFORMED as error:
        raise UserError(f"{path}: does not fit this version's Truth: {error}") from None


def _decoded(topic: Topic[Any], data: bytes, log: Path) -> Any:
    try:
        return _TICK.decode(data) if topic is topics.TRACE else msgspec.json.decode(data, type=topic.message)
    except MALFORMED as error:
        raise UserError(f"{log}: {topic.name} does not fit this version: {error}") from None


def _record(found: dict[str, list[tuple[int, Any]]]) -> Record:
    start_ns = _start_ns(found)

    def timed(topic: Topic[Any]) -> tuple[At[Any], ...]:
        return tuple(At((stamp_ns - start_ns) / 1e9, message) for stamp_ns, message in found.get(topic.name, ()))

    return Record(
        truths=tuple(message for _, message in found.get(topics.TRUTH.name, ())),
        advisories=timed(topics.ADVISORY),
        decisions=timed(topics.DECISION),
        traces=timed(topics.TRACE),
        conditions=timed(topics.CONDITIONS),
        corrupted=timed(topics.CORRUPTED),
    )


def _start_ns(found: dict[str, list[tuple[int, Any]]]) -> int:
    """The instant 0 of the run: the truth names its own; without it, the first message."""
    for stamp_ns, truth in found.get(topics.TRUTH.name, ()):
        return int(stamp_ns - round(truth.time_s * 1e9))
    stamps: Iterable[int] = (rows[0][0] for rows in found.values() if rows)
    return min(stamps, default=0)

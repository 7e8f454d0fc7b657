"""Three bits per topic, computed once: alive (young enough), on rate (at least 60 % of its rate), valid (decodes, in step)."""

import os
import time
from collections import deque

import msgspec

from proto import PROTO_VERSION
from proto.health import TopicHealth
from proto.topics import Topic
from proto.wire import PubHead

SKEW_LIMIT_NS = 20_000_000
"""Publications stamped further than this in the receiver's future tell of clocks that are not in step (design 4)."""
_RATE_SHARE = 0.6
_WINDOW = 32
MOST_PUBLISHERS = 256
"""Keys and publishers whose numbers are followed; a publisher that makes up names costs the oldest their count of gaps."""


class Health(msgspec.Struct, frozen=True):
    """The three bits."""

    alive: bool
    on_rate: bool
    valid: bool

    @property
    def ok(self) -> bool:
        """All three."""
        return self.alive and self.on_rate and self.valid


class TopicMonitor:
    """Watches one key of one topic as it arrives."""

    def __init__(self, topic: Topic[msgspec.Struct]) -> None:
        self.topic = topic
        self.received = 0
        self.lost = 0
        self.malformed = 0
        self._seq: dict[tuple[str, str], tuple[int, int]] = {}
        self._arrivals: deque[int] = deque(maxlen=_WINDOW)
        self._valid = True

    def saw(self, key: str, head: PubHead, now_ns: int, *, wall: bool) -> None:
        """A publication arrived: count gaps by key and publisher (a restarted one begins anew), judge its clock."""
        epoch, last = self._seq.get((key, head.publisher), (head.epoch, head.seq - 1))
        if epoch == head.epoch:
            self.lost += max(0, head.seq - last - 1)
        self._seq.pop((key, head.publisher), None)
        self._seq[key, head.publisher] = (head.epoch, head.seq)
        if len(self._seq) > MOST_PUBLISHERS:
            del self._seq[next(iter(self._seq))]
        self.received += 1
        self._arrivals.append(now_ns)
        skewed = wall and head.sent_ns - time.time_ns() > SKEW_LIMIT_NS
        self._valid = head.major == PROTO_VERSION[0] and not skewed

    def broken(self) -> None:
        """A publication did not decode."""
        self.malformed += 1
        self._valid = False

    def age_ms(self, now_ns: int) -> float | None:
        """Since the last arrival; None before the first."""
        return (now_ns - self._arrivals[-1]) / 1e6 if self._arrivals else None

    def health(self, now_ns: int) -> Health:
        """The three bits now. A topic without a rate is alive and on rate once seen."""
        age = self.age_ms(now_ns)
        if age is None:
            return Health(alive=False, on_rate=False, valid=self._valid)
        if self.topic.rate_hz == 0:
            return Health(alive=True, on_rate=True, valid=self._valid)
        # either way: an arrival in the future tells of a clock that was stepped back, not of a topic that lives
        return Health(alive=abs(age) <= self.topic.max_age_ms, on_rate=self._on_rate(now_ns), valid=self._valid)

    def _on_rate(self, now_ns: int) -> bool:
        if len(self._arrivals) < 4:
            return True
        span_s = (now_ns - self._arrivals[0]) / 1e9
        return len(self._arrivals) >= _RATE_SHARE * self.topic.rate_hz * span_s

    def report(self, name: str, now_ns: int) -> TopicHealth:
        """The bits and the counters, to be published."""
        bits = self.health(now_ns)
        return TopicHealth(
            topic=name,
            alive=bits.alive,
            on_rate=bits.on_rate,
            valid=bits.valid,
            received=self.received,
            lost=self.lost,
            malformed=self.malformed,
            age_ms=self.age_ms(now_ns),
        )


def resident_mb() -> float:
    """Resident memory of this process in MB (Linux; 0 elsewhere)."""
    try:
        with open("/proc/self/statm", encoding="ascii") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6
    except OSError:
        return 0.0

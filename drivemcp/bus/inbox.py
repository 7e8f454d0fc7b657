"""What waits for a node's one worker thread: publications, timers, jobs. Zenoh's threads only put in; nothing here blocks them."""

import heapq
import threading
import time
from collections import Counter, deque
from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import NamedTuple

from proto.wire import PubHead

INBOX_LIMIT = 4096
"""Publications kept for a worker that is behind; the oldest go first and are counted."""
MOST_OF_ONE = INBOX_LIMIT // 4
"""Of one key and publisher: one that floods loses its own messages, not others'."""


class Parcel(NamedTuple):
    """One publication as it came; `head` is `None` where it does not decode."""

    key: str
    payload: bytes
    head: PubHead | None
    arrived_ns: int
    deliver: Callable[["Parcel"], None]


class Inbox:
    """A queue with coalescing of `latest` keys and a bound."""

    def __init__(self, limit: int = INBOX_LIMIT, most_of_one: int | None = None) -> None:
        self._limit, self._most_of_one = limit, most_of_one
        self._lock = threading.Lock()
        self._ready: SimpleQueue[None] = SimpleQueue()
        """One for each parcel and job: what wakes the worker."""
        self._parcels: deque[Parcel] = deque()
        self._waiting: Counter[tuple[str, str]] = Counter()
        """By key and publisher, how many parcels wait."""
        self._latest: dict[tuple[str, int], Parcel] = {}
        self._jobs: deque[Callable[[], None]] = deque()
        self._closed = False
        self.dropped = 0

    def put(self, parcel: Parcel, *, latest: bool) -> None:
        """Add a publication; of a `latest` topic only the newest of a key is kept."""
        with self._lock:
            if self._closed:
                return
            if latest:
                slot = _slot(parcel)
                waiting = slot in self._latest
                self._latest[slot] = parcel
                if waiting:
                    self.dropped += 1
                    return
            if self._most_of_one is not None and self._waiting[_source(parcel)] >= self._most_of_one:
                self._latest.pop(_slot(parcel), None)
                self.dropped += 1
                return
            self._parcels.append(parcel)
            self._waiting[_source(parcel)] += 1
            if len(self._parcels) > self._limit:
                self._latest.pop(_slot(self._out()), None)  # else its key would be waited for for ever
                self.dropped += 1
                return
        self._ready.put(None)

    def put_job(self, job: Callable[[], None]) -> None:
        """Add work for the worker thread itself."""
        self._jobs.append(job)
        self._ready.put(None)

    def take(self, timeout_s: float) -> Parcel | Callable[[], None] | None:
        """The next publication or job; None after the timeout or when closed."""
        try:
            self._ready.get(timeout=timeout_s)
        except Empty:
            return None
        with self._lock:
            if self._jobs:
                return self._jobs.popleft()
            if not self._parcels:
                return None
            parcel = self._out()
            return self._latest.pop(_slot(parcel), parcel)

    def _out(self) -> Parcel:
        """The oldest, which does not wait any longer."""
        parcel = self._parcels.popleft()
        source = _source(parcel)
        self._waiting[source] -= 1
        if self._waiting[source] <= 0:
            del self._waiting[source]
        return parcel

    def close(self) -> None:
        """Take in no more publications, and wake the worker for the last time."""
        with self._lock:
            self._closed = True
        self._ready.put(None)

    def finish(self, handle: Callable[[Parcel | Callable[[], None]], None], within_s: float) -> int:
        """Hand over what is left, for so long at most; how many publications were not. They count as dropped."""
        until_s = time.monotonic() + within_s
        while time.monotonic() < until_s and (item := self.take(0.0)) is not None:
            handle(item)
        with self._lock:
            left = len(self._parcels)
            self._parcels.clear()
            self._waiting.clear()
            self._latest.clear()
            self.dropped += left
        return left

    @property
    def closed(self) -> bool:
        """Whether `close` was called."""
        return self._closed


def _slot(parcel: Parcel) -> tuple[str, int]:
    """A subscription's place for a key of a `latest` topic."""
    return parcel.key, id(parcel.deliver)


def _source(parcel: Parcel) -> tuple[str, str]:
    return parcel.key, parcel.head.publisher if parcel.head is not None else ""


class Timers:
    """Periodic functions by due time on any clock. A period that was slept through fires once, not many times.

    A clock that is stepped back takes the due times with it: no function waits until the clock has caught up.
    """

    def __init__(self) -> None:
        self._heap: list[tuple[int, int, int, Callable[[], None]]] = []
        self._count = 0
        self._seen_ns: int | None = None

    def add(self, period_ns: int, first_ns: int, function: Callable[[], None]) -> None:
        """Call `function` at `first_ns` and every `period_ns` after."""
        self._count += 1
        heapq.heappush(self._heap, (first_ns, self._count, period_ns, function))

    def next_due_ns(self) -> int | None:
        """When the next one is due."""
        return self._heap[0][0] if self._heap else None

    def due(self, now_ns: int) -> list[Callable[[], None]]:
        """Those due now, in the order in which they were due."""
        if self._seen_ns is not None and now_ns < self._seen_ns:
            self._shift(now_ns - self._seen_ns)
        self._seen_ns = now_ns
        ready: list[Callable[[], None]] = []
        while self._heap and self._heap[0][0] <= now_ns:
            due_ns, order, period_ns, function = heapq.heappop(self._heap)
            ready.append(function)
            behind = (now_ns - due_ns) // period_ns
            heapq.heappush(self._heap, (due_ns + (behind + 1) * period_ns, order, period_ns, function))
        return ready

    def _shift(self, by_ns: int) -> None:
        self._heap = [
            (due_ns + by_ns, order, period, call) for due_ns, order, period, call in self._heap
        ]  # still a heap

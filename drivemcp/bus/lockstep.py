"""Lockstep: publications are held until the conductor's step, then handled in an order that depends on the data alone."""

import threading
import time
from collections.abc import Callable, Mapping
from queue import Empty, SimpleQueue

import msgspec

from drivemcp.bus.inbox import Parcel
from drivemcp.bus.session import Bus, Reply
from drivemcp.errors import LockstepError
from proto.keys import step_key
from proto.services import BY_NAME
from proto.wire import StepReply, StepRequest

LOOK_S = 0.1
"""How often a conductor that waits looks whether the service lives."""
STEP_BOUND_S = 30.0
"""Wall time within which a service must finish one step; a longer one is a stuck run."""
_REQUEST = msgspec.json.Encoder()
_REPLY = msgspec.json.Decoder(StepReply)


_Held = tuple[int, int, str, int, int, Parcel]


def matches(pattern: str, key: str) -> bool:
    """Whether a key falls under a subscription whose chunks may be `*`."""
    left, right = pattern.split("/"), key.split("/")
    return len(left) == len(right) and all(a in ("*", b) for a, b in zip(left, right, strict=True))


def step_order(service: str) -> int:
    """The place of a service in a step; third parties stand before the arbiter."""
    return BY_NAME[service].step_order if service in BY_NAME else 48


class HeldParcels:
    """Publications that wait for the step in which they count."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._changed = threading.Condition(self._lock)
        self._waiting = False
        self._held: list[_Held] = []
        self._seen: dict[str, int] = {}
        self._patterns: set[str] = set()
        self._awaited: dict[str, bool] = {}
        """By key, whether a pattern waits for it: the same keys come with every step."""
        self._count = 0

    def subscribe(self, pattern: str) -> None:
        """From now on keys under the pattern are waited for."""
        self._patterns.add(pattern)
        self._awaited = {}

    def put(self, parcel: Parcel) -> None:
        """Hold one; called on the bus's threads."""
        head = parcel.head
        if head is None:
            return
        with self._lock:
            self._count += 1
            self._held.append((head.stamp_ns, step_order(head.publisher), parcel.key, head.seq, self._count, parcel))
            self._seen[parcel.key] = max(head.seq, self._seen.get(parcel.key, -1))
            if self._waiting:
                self._changed.notify_all()

    def take(self, published: Mapping[str, int], timeout_s: float) -> list[Parcel]:
        """All that was published up to the given numbers, by stamp, the publisher's place in the step, key and number.

        Keys that are not given are those with no new number since they were last given.

        Raises LockstepError when some never come.
        """
        awaited = self._awaited
        for key in published.keys() - awaited.keys():
            awaited[key] = any(matches(pattern, key) for pattern in self._patterns)
        wanted = {key: seq for key, seq in published.items() if awaited[key]}
        if not wanted:
            return []
        deadline = time.monotonic() + timeout_s
        with self._lock:
            while missing := [key for key, seq in wanted.items() if self._seen.get(key, -1) < seq]:
                self._waiting = True
                if not self._changed.wait(max(0.0, deadline - time.monotonic())) and time.monotonic() >= deadline:
                    raise LockstepError(f"publications never arrived: {', '.join(missing[:4])}")
            self._waiting = False
            ready, still = list[_Held](), list[_Held]()
            for item in self._held:
                (ready if item[3] <= wanted.get(item[2], -1) else still).append(item)
            self._held = still
        return [item[5] for item in sorted(ready, key=lambda item: item[:5])]


class Conductor:
    """Steps every service in the order of the data, and gathers what each has published."""

    def __init__(self, bus: Bus, vehicle: str, name: str, alive: Callable[[], set[str]] | None = None) -> None:
        self._alive = alive
        """Which services live, where that is followed: one that ends is not waited for."""
        self._bus = bus
        self._vehicle = vehicle
        self._name = name
        self._step = 0
        self._untold: dict[str, dict[str, int]] = {}
        """By service, the last numbers of the keys published on since it was last told."""
        self._published: dict[str, int] = {}

    def step(self, services: set[str], now_ns: int, own: Mapping[str, int]) -> None:
        """Let each service handle all that was published up to now. Raises LockstepError naming the one that is stuck or gone."""
        self._step += 1
        if gone := self._untold.keys() - services - {self._name}:
            raise LockstepError(f"step {self._step}: {', '.join(_in_order(set(gone)))} ended")
        others = services - {self._name}
        for service in services - self._untold.keys():
            self._untold[service] = dict(self._published)
        self._note(own)
        called: set[str] = set()
        for service in _in_order(others):
            called |= self._ask(service, now_ns, report_only=False)
        while called & others:  # what calls of its tools made a service publish after its own turn
            called = set().union(*(self._ask(each, now_ns, report_only=True) for each in _in_order(called & others)))

    def untold(self, service: str) -> dict[str, int]:
        """The last number of every key that was published on since the service was last told."""
        untold, self._untold[service] = self._untold.get(service, self._published), {}
        return untold

    def _note(self, published: Mapping[str, int]) -> None:
        if published:
            for known in (self._published, *self._untold.values()):
                known.update(published)

    def _ask(self, service: str, now_ns: int, *, report_only: bool) -> set[str]:
        """Let one service do its step, or only tell what it has published since; whose tools it has called."""
        replies: SimpleQueue[Reply | None] = SimpleQueue()
        request = StepRequest(
            step=self._step,
            now_ns=now_ns,
            published={} if report_only else self.untold(service),
            report_only=report_only,
        )
        key = step_key(self._vehicle, service)
        self._bus.get(key, replies.put, timeout_s=STEP_BOUND_S, payload=_REQUEST.encode(request))
        first = self._first(service, replies)
        if first is None or first.payload is None:
            why = (first.error or b"").decode("utf-8", "replace")[:300] if first else "no answer"
            raise LockstepError(f"step {self._step}: {service} did not finish ({why or 'timeout'})")
        reply = _REPLY.decode(first.payload)
        if reply.error:
            raise LockstepError(f"step {self._step}: {service} failed: {reply.error}")
        self._note(reply.published)
        return set(reply.called)

    def _first(self, service: str, replies: "SimpleQueue[Reply | None]") -> Reply | None:
        """The first reply; `None` where no reply came in time. Raises LockstepError as soon as the service has ended."""
        deadline_s = time.monotonic() + STEP_BOUND_S + 1
        lived = self._alive is not None and service in self._alive()
        while time.monotonic() < deadline_s:
            try:
                return replies.get(timeout=LOOK_S)
            except Empty:
                if lived and self._alive is not None and service not in self._alive():
                    raise LockstepError(f"step {self._step}: {service} ended") from None
        return None


def _in_order(services: set[str]) -> list[str]:
    return sorted(services, key=lambda name: (step_order(name), name))

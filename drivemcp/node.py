"""A node: one service's handle on the bus. Publishes, subscribes, serves and calls tools, keeps health, on one worker thread."""

import itertools
import logging
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

import msgspec

from drivemcp.bus.inbox import MOST_OF_ONE, Inbox, Parcel, Timers
from drivemcp.bus.lockstep import STEP_BOUND_S, Conductor, HeldParcels
from drivemcp.bus.received import Received, decode, head_of, received_as
from drivemcp.bus.session import Bus, Publisher, Query, wait_settled
from drivemcp.bus.topic_health import Health, TopicMonitor, resident_mb
from drivemcp.clock import Clock, SimulatedClock, WallClock
from drivemcp.config import ServiceConfig
from drivemcp.errors import MALFORMED, ContractError, LockstepError
from drivemcp.tools.client import Ask, ToolClient
from drivemcp.tools.definition import Tool
from drivemcp.tools.server import Authorize, ToolServer
from proto import topics
from proto.health import ServiceHealth
from proto.keys import alive_key, chunk, step_key, topic_key
from proto.tools import CallHead, CallRecord, CallRecords, Outcome, ToolEntry
from proto.topics import Topic
from proto.wire import PubHead, StepReply, StepRequest

M = TypeVar("M", bound=msgspec.Struct)
F = TypeVar("F", bound=Callable[..., Any])
_MSGPACK = msgspec.msgpack.Encoder()
_JSON = msgspec.json.Encoder()
_EPOCHS = itertools.count(time.time_ns())
HEALTH_PERIOD_S = 1.0
CALLS_PERIOD_S = 0.05
SETTLE_S = 0.3
FINISH_S = 2.0
"""How long a node that ends goes on with what it had received."""


class _Outlet:
    """One key this node publishes on."""

    __slots__ = ("lock", "publisher", "seq")

    def __init__(self, publisher: Publisher) -> None:
        self.publisher = publisher
        self.seq = 0
        self.lock = threading.Lock()


def _no_actuation(tool: Tool, head: CallHead, payload: bytes) -> str:
    return "actuation is off; it takes a grant (drivemcp grant) and a confirmation of this very command"


class Node:
    """Made by the runner or by `drivemcp.testing`; a service's `build` receives it."""

    def __init__(self, bus: Bus, name: str, config: ServiceConfig, *, authorize: Authorize = _no_actuation) -> None:
        self.name = chunk(name)
        self.config = config
        self.lockstep = config.lockstep
        self.clock: Clock = SimulatedClock() if self.lockstep else WallClock()
        self.log = logging.getLogger(f"drivemcp.{name}")
        self.detail: dict[str, str] = {}
        """What the service wants known in its health: encoder and detector in use, versions."""
        self._bus = bus
        self._epoch = next(_EPOCHS)
        self._outlets: dict[str, _Outlet] = {}
        self._outlet_lock = threading.Lock()
        self._monitors: dict[str, TopicMonitor] = {}
        self._latest: dict[str, Received[Any]] = {}
        self._calls: deque[CallRecord] = deque(maxlen=10_000)
        self._inbox = Inbox(most_of_one=MOST_OF_ONE)
        self._held = HeldParcels()
        self._timers = Timers()
        self._closers: list[Callable[[], None]] = []
        self._fresh: dict[str, int] = {}
        """By key, the last number published since the last report to the conductor."""
        self._started_ns = time.time_ns()
        self.unhandled = 0
        """Publications received and not handled by the end; known when the closers run."""
        self._closed = threading.Event()
        self.tools = ToolServer(
            bus,
            vehicle=config.vehicle,
            server=self.name,
            workers=config.tool_workers,
            max_pending=config.max_pending_calls,
            log_call=self._log_call,
            authorize=authorize,
            logger=self.log,
        )
        self.client = ToolClient(
            bus,
            vehicle=config.vehicle,
            caller=self.name,
            log_call=self._log_call,
            logger=self.log,
            modelled_ms=config.modelled_ms if self.lockstep else None,
        )
        self._conductor = Conductor(bus, config.vehicle, self.name, self.alive_services)
        self._worker = threading.Thread(target=self._work, name=f"{name}-worker", daemon=True)

    # -- publishing ------------------------------------------------------------------------------------------------

    def publish(self, topic: Topic[M], message: M, *, id: str | None = None, stamp_ns: int | None = None) -> None:
        """Number, stamp, encode and send. `stamp_ns` keeps the source's stamp; otherwise now. Raises ContractError on a wrong type."""
        if not isinstance(message, topic.message):
            raise ContractError(f"topic {topic.name!r} carries {topic.message.__name__}, not {type(message).__name__}")
        key = topic_key(self.config.vehicle, topic, id or (self.name if topic.has_id else None))
        payload = (_MSGPACK if topic.encoding == "msgpack" else _JSON).encode(message)
        now_ns = self.clock.now_ns()
        outlet = self._outlet(key, droppable=topic.droppable and not self.lockstep)
        with outlet.lock:
            outlet.seq += 1
            if self.lockstep:
                with self._outlet_lock:
                    self._fresh[key] = outlet.seq
            head = PubHead(
                seq=outlet.seq,
                stamp_ns=now_ns if stamp_ns is None else stamp_ns,
                sent_ns=time.time_ns(),
                publisher=self.name,
                epoch=self._epoch,
            )
            outlet.publisher.put(payload, _MSGPACK.encode(head))

    def _outlet(self, key: str, *, droppable: bool) -> _Outlet:
        outlet = self._outlets.get(key)
        if outlet is None:
            with self._outlet_lock:
                outlet = self._outlets.setdefault(key, _Outlet(self._bus.publisher(key, droppable=droppable)))
            if self.lockstep:  # the first message must not outrun the news of who subscribes
                wait_settled(outlet.publisher.matching, SETTLE_S)
        return outlet

    def _log_call(self, record: CallRecord) -> None:
        self._calls.append(record)

    def _publish_calls(self) -> None:
        records: list[CallRecord] = []
        while self._calls:
            records.append(self._calls.popleft())
        if records:
            self.publish(topics.CALLS, CallRecords(records=tuple(records)))

    # -- subscribing -----------------------------------------------------------------------------------------------

    def subscribe(
        self, topic: Topic[M], callback: Callable[[M, Received[M]], None] | None = None, *, id: str | None = None
    ) -> None:
        """Deliver decoded messages on the worker thread; without a callback only `latest` and `health` follow the topic."""
        monitored = self._monitor(topic, id)

        def deliver(parcel: Parcel) -> None:
            received = self._open(topic, parcel, monitored)
            if received is not None:
                self._latest[parcel.key] = received
                if callback is not None:
                    callback(received.message, received)

        self._listen(topic, id, deliver)

    def subscribe_raw(
        self, topic: Topic[M], callback: Callable[[Received[Any]], None], *, id: str | None = None
    ) -> None:
        """Deliver bytes as they came (`payload`), undecoded, on the worker thread."""
        monitored = self._monitor(topic, id)

        def deliver(parcel: Parcel) -> None:
            head = self._head(parcel, monitored)
            if head is not None:
                callback(received_as(None, parcel, head))

        self._listen(topic, id, deliver)

    def latest(self, topic: Topic[M], id: str | None = None) -> Received[M] | None:
        """The newest message handled so far on a topic that is subscribed to."""
        return self._latest.get(topic_key(self.config.vehicle, topic, id))

    def health(self, topic: Topic[Any], id: str | None = None) -> Health:
        """Alive, on rate, valid. A topic without a subscription is not alive, not on rate and not valid."""
        monitor = self._monitors.get(topic_key(self.config.vehicle, topic, id))
        return monitor.health(self.clock.now_ns()) if monitor else Health(alive=False, on_rate=False, valid=False)

    def _monitor(self, topic: Topic[Any], id: str | None) -> TopicMonitor:
        key = topic_key(self.config.vehicle, topic, id)
        return self._monitors.setdefault(key, TopicMonitor(topic))

    def _listen(self, topic: Topic[Any], id: str | None, deliver: Callable[[Parcel], None]) -> None:
        pattern = topic_key(self.config.vehicle, topic, id)
        latest = topic.keep == "latest"
        if self.lockstep:
            self._held.subscribe(pattern)

        def receive(key: str, payload: bytes, attachment: bytes) -> None:
            parcel = Parcel(key, payload, head_of(attachment), time.time_ns(), deliver)
            if self.lockstep:
                self._held.put(parcel)
            else:
                self._inbox.put(parcel, latest=latest)

        self._bus.subscribe(pattern, receive)

    def _head(self, parcel: Parcel, monitor: TopicMonitor) -> PubHead | None:
        if parcel.head is None:
            monitor.broken()
            return None
        monitor.saw(
            parcel.key, parcel.head, self.clock.now_ns() if self.lockstep else parcel.arrived_ns, wall=not self.lockstep
        )
        return parcel.head

    def _open(self, topic: Topic[M], parcel: Parcel, monitor: TopicMonitor) -> Received[M] | None:
        head = self._head(parcel, monitor)
        if head is None:
            return None
        try:
            return received_as(decode(topic, parcel.payload), parcel, head)
        except (*MALFORMED, ValueError) as error:
            monitor.broken()
            if monitor.malformed in (1, 10, 100, 1000):
                self.log.warning("%s: message %d does not decode and is dropped: %s", parcel.key, head.seq, error)
            return None

    # -- tools -----------------------------------------------------------------------------------------------------

    def tool(self, **options: Any) -> Callable[[F], F]:
        """Decorator: offer a function as a tool (`deadline_ms`, `capability`, `title`, `answers`, `effect`, ...)."""
        options.setdefault("deadline_ms", 40.0)

        def register(target: F) -> F:
            self.tools.add(target, **options)
            return target

        return register

    def call(self, tool: str, arguments: Mapping[str, Any] | msgspec.Struct, *, deadline_ms: float) -> Outcome:
        """Call one tool by its bare name; never raises."""
        return self.client.call_all([(tool, arguments, deadline_ms)])[0]

    def call_all(self, asks: Iterable[Ask]) -> list[Outcome]:
        """Call several in parallel: (tool, arguments, deadline_ms) each; outcomes in the same order."""
        return self.client.call_all(asks)

    def late(self) -> list[Outcome]:
        """Replies that missed their tick."""
        return self.client.late()

    def catalogue(self) -> dict[str, ToolEntry]:
        """Tools known on the bus."""
        return self.client.catalogue()

    def alive_services(self) -> set[str]:
        """Services with a liveliness token."""
        return self.client.alive()

    # -- time and life ---------------------------------------------------------------------------------------------

    def every(self, period_s: float, function: Callable[[], None]) -> None:
        """Call periodically on the worker thread, by the node's clock."""
        period_ns = int(period_s * 1e9)
        self._inbox.put_job(lambda: self._timers.add(period_ns, self.clock.now_ns() + period_ns, function))

    def run_soon(self, job: Callable[[], None]) -> None:
        """Run on the worker thread."""
        self._inbox.put_job(job)

    def on_close(self, function: Callable[[], None]) -> None:
        """Call when the node closes, last registered first."""
        self._closers.append(function)

    def watch_services(self) -> None:
        """Follow liveliness and catalogues; the orchestrator, the gateway and the conductor do."""
        self.client.watch()

    def open(self, *, announce: bool = True) -> None:
        """Start the worker, serve tools, and say that the service is alive."""
        self._worker.start()
        self.every(CALLS_PERIOD_S, self._publish_calls)
        if self.tools.tools:
            self.tools.open()
        if announce:
            self.every(HEALTH_PERIOD_S, self._publish_health)
            if self.lockstep:
                self._bus.serve(step_key(self.config.vehicle, self.name), self._on_step)
            self._bus.announce(alive_key(self.config.vehicle, self.name))

    def close(self) -> None:
        """Take no more work, finish what was received, run the closers. The bus is the opener's to close."""
        if self._closed.is_set():
            return
        self._closed.set()
        self._inbox.close()
        if self._worker.is_alive() and self._worker is not threading.current_thread():
            self._worker.join(5.0)
        for function in reversed(self._closers):
            self._guarded(function, "closing")
        self.tools.close()
        self._guarded(self._publish_calls, "the last calls")

    def _work(self) -> None:
        while not self._inbox.closed:
            due_ns = None if self.lockstep else self._timers.next_due_ns()
            wait_s = 0.5 if due_ns is None else min(0.5, max(0.0, (due_ns - self.clock.now_ns()) / 1e9))
            if (item := self._inbox.take(wait_s)) is not None:
                self._handle(item)
            if not self.lockstep:
                self._fire_timers()
        if not self.lockstep:
            self.unhandled = self._inbox.finish(self._handle, FINISH_S)

    def _handle(self, item: Parcel | Callable[[], None]) -> None:
        if isinstance(item, Parcel):
            self._guarded(lambda: item.deliver(item), item.key)
        else:
            self._guarded(item, "job")

    def _fire_timers(self) -> None:
        for function in self._timers.due(self.clock.now_ns()):
            self._guarded(function, getattr(function, "__qualname__", "timer"))

    def _guarded(self, function: Callable[[], None], what: str) -> None:
        try:
            function()
        except Exception:
            self.log.exception("%s: handling %s failed", self.name, what)

    def _publish_health(self) -> None:
        if self.config.heartbeat_file:
            Path(self.config.heartbeat_file).touch()
        now_ns = self.clock.now_ns()
        prefix = len(f"drivemcp/{self.config.vehicle}/")
        self.publish(
            topics.HEALTH,
            ServiceHealth(
                service=self.name,
                pid=os.getpid(),
                uptime_s=(time.time_ns() - self._started_ns) / 1e9,
                rss_mb=resident_mb(),
                topics=tuple(monitor.report(key[prefix:], now_ns) for key, monitor in self._monitors.items()),
                calls_served=self.tools.served,
                calls_refused=self.tools.refused,
                dropped=self._inbox.dropped,
                detail=dict(self.detail),
            ),
        )

    # -- lockstep --------------------------------------------------------------------------------------------------

    def conduct_step(self, now_ns: int, services: set[str] | None = None) -> None:
        """The conductor's step: every living service handles what was published up to `now_ns`, in order; then this node does.

        Call it on the worker thread, after publishing the instant's sensors. Raises LockstepError when one is stuck.
        """
        self.set_clock(now_ns)
        self._conductor.step(self.alive_services() if services is None else services, now_ns, self._new_publications())
        self._drain(self._conductor.untold(self.name))

    def set_clock(self, now_ns: int) -> None:
        """Set the simulated clock; only the conductor does."""
        if isinstance(self.clock, SimulatedClock):
            self.clock.set_ns(now_ns)

    def _on_step(self, query: Query) -> None:
        self._inbox.put_job(lambda: self._step(query))

    def _step(self, query: Query) -> None:
        request = msgspec.json.decode(query.payload, type=StepRequest)
        error = ""
        if not request.report_only:
            self.set_clock(request.now_ns)
            try:
                self._drain(request.published)
            except LockstepError as problem:
                error = str(problem)
        called = self.client.called()  # before what was published is counted: a call under way is told of next time
        reply = StepReply(service=self.name, published=self._new_publications(), error=error, called=called)
        query.answer(query.key, _JSON.encode(reply))

    def _drain(self, published: Mapping[str, int]) -> None:
        for parcel in self._held.take(published, STEP_BOUND_S / 2):
            self._guarded(lambda parcel=parcel: parcel.deliver(parcel), parcel.key)  # type: ignore[misc]
        self._fire_timers()

    def _new_publications(self) -> dict[str, int]:
        with self._outlet_lock:
            fresh, self._fresh = self._fresh, {}
        return fresh

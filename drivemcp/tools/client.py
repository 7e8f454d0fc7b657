"""Calls tools: in parallel, each with its deadline, never raising. Names are checked against the catalogue before any key is made."""

import hashlib
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from queue import Empty, SimpleQueue
from typing import Any

import msgspec

from drivemcp.bus.session import Bus, Querier, Reply
from drivemcp.errors import MALFORMED
from drivemcp.tools.pending import Pending
from drivemcp.tools.refusal import refusal, unknown_tool
from proto import PROTO_VERSION
from proto.keys import alive_key, catalogue_key, is_chunk, tool_key
from proto.services import OWNERS
from proto.tools import (
    BUSY,
    CANCELLED,
    CallHead,
    CallRecord,
    CallResult,
    CallStatus,
    Catalogue,
    Outcome,
    ProtocolError,
    ToolEntry,
)

_CATALOGUE = msgspec.json.Decoder(Catalogue)
_RESULT = msgspec.json.Decoder(CallResult)
_PROBLEM = msgspec.json.Decoder(ProtocolError)
_HEAD = msgspec.msgpack.Encoder()
_ARGUMENTS = msgspec.json.Encoder(order="deterministic")
LATE_GRACE_S = 2.0
"""How long after its deadline a reply is still taken, to be used, with its age, in a later tick."""
DISCOVERY_TIMEOUT_S = 1.0
LOCKSTEP_BOUND_MS = 20_000.0
"""In lockstep lateness is modelled; this wall bound only fails a stuck run. No deadline is longer."""
QUERY_TIMEOUT_S = LOCKSTEP_BOUND_MS / 1e3 + LATE_GRACE_S
DEFAULT_MODELLED_MS = 4.0

Ask = tuple[str, Mapping[str, Any] | msgspec.Struct, float]


class ToolClient:
    """Discovers every server on the bus and calls its tools."""

    def __init__(
        self,
        bus: Bus,
        *,
        vehicle: str,
        caller: str,
        log_call: Callable[[CallRecord], None],
        logger: logging.Logger,
        modelled_ms: Mapping[str, float] | None = None,
        now_ns: Callable[[], int] = time.time_ns,
    ) -> None:
        """`now_ns`: the wall clock, which servers read as well."""
        self._bus = bus
        self._vehicle = vehicle
        self._caller = caller
        self._log_call = log_call
        self._logger = logger
        self._modelled_ms = modelled_ms
        self._now_ns = now_ns
        self._lock = threading.Lock()
        self._tools: dict[str, ToolEntry] = {}
        self._queriers: dict[str, tuple[str, Querier]] = {}
        self._waiting: set[Pending] = set()
        self._alive: set[str] = set()
        self._called: set[str] = set()
        self._late: deque[Outcome] = deque(maxlen=64)
        self._watching = False
        self._discovered_s = 0.0

    def watch(self) -> None:
        """Follow liveliness: a server that appears is asked for its catalogue, one that goes is unavailable at once."""
        if not self._watching:
            self._watching = True
            self._bus.watch(alive_key(self._vehicle), self._on_life)

    def alive(self) -> set[str]:
        """Services with a liveliness token now."""
        with self._lock:
            return set(self._alive)

    def catalogue(self) -> dict[str, ToolEntry]:
        """All tools known, by their bare names."""
        with self._lock:
            return dict(self._tools)

    def discover(self, timeout_s: float = DISCOVERY_TIMEOUT_S) -> dict[str, ToolEntry]:
        """Ask every server on the bus, and wait for their answers."""
        done = threading.Event()
        self._fetch(catalogue_key(self._vehicle), lambda: done.set(), timeout_s)
        done.wait(timeout_s + 0.2)
        return self.catalogue()

    def call_all(self, asks: Iterable[Ask], *, grant: str = "", confirmation: str = "") -> list[Outcome]:
        """Issue all calls, then collect: the slowest decides, each has its own deadline (ms). One outcome per ask, in order."""
        ended: SimpleQueue[None] = SimpleQueue()
        context = CallHead(call_id="", caller=self._caller, deadline_ns=0, grant=grant, confirmation=confirmation)
        wake = partial(ended.put, None)
        started = [self._start(tool, arguments, limit, wake, context) for tool, arguments, limit in asks]
        return [self._collect(item, ended) if isinstance(item, Pending) else item for item in started]

    def begin(
        self,
        tool: str,
        arguments: Mapping[str, Any],
        limit_ms: float,
        wake: Callable[[], None],
        *,
        traceparent: str = "",
    ) -> Pending | Outcome:
        """For a caller with a loop of its own: one call, of a tool in the catalogue. `wake` is called, on the bus's thread, once it
        has ended; then, or when its time is over, `finish` gives the outcome. An outcome at once: it could not be made.
        """
        context = CallHead(call_id="", caller=self._caller, deadline_ns=0, traceparent=traceparent)
        return self._start(tool, arguments, limit_ms, wake, context)

    def cancel(self, pending: Pending) -> None:
        """End a call before its time, and tell its server; one that has ended is left alone."""
        if pending.done or pending.collected:
            return
        pending.cancelled = True
        head = CallHead(call_id=pending.call_id, caller=self._caller, deadline_ns=0, cancels=True)
        self._queriers[pending.tool][1].get(b"", _HEAD.encode(head), _ignore)
        pending.end(None)

    def late(self) -> list[Outcome]:
        """Replies that came after their deadline since the last look, with their age."""
        found: list[Outcome] = []
        while self._late:
            found.append(self._late.popleft())
        return found

    def called(self) -> tuple[str, ...]:
        """Servers whose tools were called since the last look."""
        with self._lock:
            called, self._called = self._called, set()
        return tuple(sorted(called))

    def _on_life(self, key: str, alive: bool) -> None:
        service = key.rsplit("/", 1)[1]
        with self._lock:
            (self._alive.add if alive else self._alive.discard)(service)
        if alive:
            self._fetch(catalogue_key(self._vehicle, service), lambda: None, DISCOVERY_TIMEOUT_S)
            return
        for pending in tuple(self._waiting):
            if pending.server == service and not pending.done:
                pending.end(None)

    def _fetch(self, key: str, on_end: Callable[[], None], timeout_s: float) -> None:
        def on_reply(reply: Reply | None) -> None:
            if reply is None:
                on_end()
            elif reply.payload is not None:
                self._learn(reply.key, reply.payload)

        self._bus.get(key, on_reply, timeout_s=timeout_s)

    def _learn(self, key: str, payload: bytes) -> None:
        try:
            catalogue = _CATALOGUE.decode(payload)
        except MALFORMED as error:
            self._logger.warning("a catalogue does not decode and is ignored: %s", error)
            return
        if catalogue.proto_major != PROTO_VERSION[0]:
            self._logger.warning("server %s speaks another message version and is ignored", catalogue.server)
            return
        if key.split("/")[-2:] != ["tool", catalogue.server]:
            self._logger.warning("a catalogue under %s says that it is %s's and is ignored", key, catalogue.server)
            return
        with self._lock:
            for entry in catalogue.tools:
                if self._may_offer(entry, catalogue.server):
                    self._tools[entry.name] = entry
                else:
                    self._logger.warning(
                        "tool %r of %r is ignored: the name is taken, or is none", entry.name, catalogue.server
                    )

    def _may_offer(self, entry: ToolEntry, server: str) -> bool:
        """Whether it is the server's own, and both names can stand in a key: a call must not fail over them."""
        own = entry.meta.server == server == self._owner(entry.name, server)
        return own and is_chunk(entry.name) and is_chunk(server)

    def _owner(self, tool: str, server: str) -> str:
        """Whose a name is: the service's that the table gives it to, else the first server's that offered it."""
        known = self._tools.get(tool)
        return OWNERS.get(tool, known.meta.server if known else server)

    def _start(
        self,
        tool: str,
        arguments: Mapping[str, Any] | msgspec.Struct,
        limit_ms: float,
        wake: Callable[[], None],
        context: CallHead,
    ) -> Pending | Outcome:
        try:
            payload = _ARGUMENTS.encode(arguments)
        except UnicodeEncodeError:
            why = refusal(f"arguments of {tool}: a text in them is no Unicode", do="leave out lone surrogates")
            return self._without(tool, b"", why, "protocol_error")
        found = self._querier(tool)
        if found is None:
            return self._without(tool, payload, unknown_tool(tool, tuple(self.catalogue())))
        server, querier = found
        wall_ms = LOCKSTEP_BOUND_MS if self._modelled_ms is not None else limit_ms
        pending = Pending(tool, server, arguments, payload, self._now_ns(), wall_ms, wake)
        pending.limit_ms, pending.traceparent = limit_ms, context.traceparent
        head = msgspec.structs.replace(context, call_id=pending.call_id, deadline_ns=pending.deadline_ns)
        self._waiting.add(pending)
        with self._lock:
            self._called.add(server)
        querier.get(payload, _HEAD.encode(head), lambda reply: self._on_reply(pending, reply))
        return pending

    def _querier(self, tool: str) -> tuple[str, Querier] | None:
        known = self._queriers.get(tool)
        if known is not None:
            return known
        with self._lock:
            entry = self._tools.get(tool)
        if entry is None:
            entry = self._rediscover().get(tool)
        if entry is None:
            return None
        querier = self._bus.querier(tool_key(self._vehicle, entry.meta.server, tool), QUERY_TIMEOUT_S)
        self._queriers[tool] = (entry.meta.server, querier)
        return self._queriers[tool]

    def _rediscover(self) -> dict[str, ToolEntry]:
        now_s = time.monotonic()
        if now_s - self._discovered_s < 1.0:
            return self.catalogue()
        self._discovered_s = now_s
        if not (self._watching and self._tools):
            return self.discover()
        # a watched bus brings catalogues by itself, unless one was lost: ask again, and never wait for it within a tick
        self._fetch(catalogue_key(self._vehicle), lambda: None, DISCOVERY_TIMEOUT_S)
        return self.catalogue()

    def _on_reply(self, pending: Pending, reply: Reply | None) -> None:
        if pending.done:
            return  # a tool has one server: its first reply is the answer
        now_ns = self._now_ns()
        late = pending.collected or now_ns > pending.deadline_ns
        if reply is not None and reply.payload is not None and late:
            age_ms = (now_ns - pending.sent_ns) / 1e6
            outcome = self._outcome(pending, reply, age_ms)
            self._late.append(msgspec.structs.replace(outcome, late=True, age_ms=age_ms))
            return
        pending.end(reply)

    def _collect(self, pending: Pending, ended: "SimpleQueue[None]") -> Outcome:
        while not pending.finished():
            try:  # a token for each of the batch's calls that has ended, whichever it was
                ended.get(timeout=max(0.0, pending.until_s - time.monotonic()))
            except Empty:
                break
        return self.finish(pending)

    def finish(self, pending: Pending) -> Outcome:
        """The outcome now: of a call that has not ended its deadline is over."""
        done, pending.collected = pending.done, True
        self._waiting.discard(pending)
        elapsed_ms = (self._now_ns() - pending.sent_ns) / 1e6
        if self._modelled_ms is not None and done:
            elapsed_ms = self._modelled_ms.get(pending.tool, DEFAULT_MODELLED_MS)
        outcome = self._outcome(pending, pending.reply if done else None, elapsed_ms, gone=done)
        if self._modelled_ms is not None and outcome.ok and elapsed_ms > pending.limit_ms:
            self._late.append(msgspec.structs.replace(outcome, late=True, age_ms=elapsed_ms))
            outcome = msgspec.structs.replace(
                outcome, status="timeout", result=None, error="late by the modelled latency"
            )
        self._record(pending.sent_ns, outcome, pending.traceparent)
        return outcome

    def _outcome(self, pending: Pending, reply: Reply | None, elapsed_ms: float, *, gone: bool = False) -> Outcome:
        base = Outcome(
            tool=pending.tool,
            status="timeout",
            elapsed_ms=elapsed_ms,
            call_id=pending.call_id if self._modelled_ms is None else "",
            arguments=msgspec.to_builtins(pending.arguments),
            arguments_sha256=hashlib.sha256(pending.payload).hexdigest(),
        )
        if reply is None:
            if not gone:
                return msgspec.structs.replace(base, error="no answer before the deadline")
            why = CANCELLED if pending.cancelled else "no answer came: the server is gone"
            return msgspec.structs.replace(base, status="unavailable", error=why)
        return _with_error(base, reply.error) if reply.error is not None else _with_result(base, reply.payload or b"")

    def _without(self, tool: str, payload: bytes, error: str, status: CallStatus = "unavailable") -> Outcome:
        outcome = Outcome(tool=tool, status=status, error=error, arguments_sha256=hashlib.sha256(payload).hexdigest())
        self._record(self._now_ns(), outcome)
        return outcome

    def _record(self, sent_ns: int, outcome: Outcome, traceparent: str = "") -> None:
        self._log_call(
            CallRecord(
                call_id=outcome.call_id,
                caller=self._caller,
                tool=outcome.tool,
                side="caller",
                sent_ns=sent_ns,
                done_ns=self._now_ns(),
                status=outcome.status,
                arguments_sha256=outcome.arguments_sha256,
                result_sha256=outcome.result_sha256,
                error=outcome.error[:200],
                traceparent=traceparent,
            )
        )


def _ignore(_: Reply | None) -> None:
    """What a cancelled call's server says of it."""


def _with_error(base: Outcome, payload: bytes) -> Outcome:
    try:
        problem = _PROBLEM.decode(payload)
    except MALFORMED:
        # Zenoh's own error: the timeout of the query, or the server went away while it worked
        return msgspec.structs.replace(base, status="timeout", error=payload[:200].decode("utf-8", "replace"))
    status = "busy" if problem.code == BUSY else "protocol_error"
    return msgspec.structs.replace(base, status=status, error=f"{problem.code}: {problem.message}")


def _with_result(base: Outcome, payload: bytes) -> Outcome:
    digest = hashlib.sha256(payload).hexdigest()
    try:
        result = _RESULT.decode(payload)
        _ARGUMENTS.encode(result.structuredContent)  # what cannot be written again could not be logged
    except MALFORMED as error:
        return msgspec.structs.replace(
            base, status="protocol_error", error=f"the result does not decode: {error}", result_sha256=digest
        )
    if result.isError or result.structuredContent is None:
        text = " ".join(str(part.get("text", "")) for part in result.content) or "the tool failed without a word"
        return msgspec.structs.replace(base, status="tool_error", error=text, result_sha256=digest)
    return msgspec.structs.replace(base, status="ok", result=result.structuredContent, result_sha256=digest)

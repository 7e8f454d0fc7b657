"""Serves tools as queryables with MCP's semantics. Validation, deadlines, hashing, logging and error mapping stand here, once."""

import hashlib
import logging
import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

import msgspec

from drivemcp.bus.session import Bus, Query
from drivemcp.errors import MALFORMED, ContractError, ToolFailed
from drivemcp.tools.arguments import ArgumentDecoder, ArgumentsRefused
from drivemcp.tools.definition import Tool, as_object, define
from drivemcp.tools.refusal import SEE_TEXT, refusal
from proto import PROTO_VERSION
from proto.keys import catalogue_key, tool_key
from proto.tools import (
    BUSY,
    CANCELLED,
    DENIED,
    INTERNAL_ERROR,
    INVALID_PARAMS,
    CallHead,
    CallRecord,
    CallResult,
    CallStatus,
    Catalogue,
    ProtocolError,
)

_HEAD = msgspec.msgpack.Decoder(CallHead)
_ENCODER = msgspec.json.Encoder()
CLOSE_GRACE_S = 2.0
MOST_CANCELLED = 256
MOST_TRACEPARENT = 55
"""Characters, as W3C Trace Context has it."""
Authorize = Callable[[Tool, CallHead, bytes], str]
"""Why a call of an actuation tool is refused; empty: it is allowed."""


class ToolServer:
    """The tools of one service."""

    def __init__(
        self,
        bus: Bus,
        *,
        vehicle: str,
        server: str,
        workers: int,
        max_pending: int,
        log_call: Callable[[CallRecord], None],
        authorize: Authorize,
        logger: logging.Logger,
    ) -> None:
        self._bus = bus
        self._vehicle = vehicle
        self._server = server
        self._log_call = log_call
        self._authorize = authorize
        self._logger = logger
        self._tools: dict[str, Tool] = {}
        self._decoders: dict[str, ArgumentDecoder] = {}
        self._jobs: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._workers = workers
        self._threads: list[threading.Thread] = []
        self._max_pending = max_pending + workers
        self._pending = 0
        self._lock = threading.Lock()
        self._cancelled: OrderedDict[tuple[str, str], None] = OrderedDict()
        """Caller and id of calls that were given up; those that came too late are forgotten in their turn."""
        self.served = 0
        self.refused = 0

    def add(self, function: Callable[..., Any], **options: Any) -> Tool:
        """Register a function as a tool; serving starts with `open`."""
        tool = define(function, server=self._server, **options)
        if tool.entry.name in self._tools:
            raise ContractError(f"tool {tool.entry.name!r} is defined twice in {self._server!r}")
        self._tools[tool.entry.name] = tool
        self._decoders[tool.entry.name] = ArgumentDecoder(tool)
        return tool

    @property
    def tools(self) -> tuple[Tool, ...]:
        """Those registered."""
        return tuple(self._tools.values())

    def open(self) -> None:
        """Declare the catalogue and one queryable per tool."""
        catalogue = catalogue_key(self._vehicle, self._server)
        payload = _ENCODER.encode(Catalogue(server=self._server, tools=tuple(t.entry for t in self._tools.values())))

        def list_tools(query: Query) -> None:
            self._jobs.put(lambda: query.answer(catalogue, payload))

        for number in range(self._workers):
            thread = threading.Thread(target=self._serve, name=f"{self._server}-tool-{number}", daemon=True)
            thread.start()
            self._threads.append(thread)

        self._bus.serve(catalogue, list_tools)
        for name in self._tools:
            self._bus.serve(tool_key(self._vehicle, self._server, name), self._receiver(name))

    def close(self) -> None:
        """Take no more calls, and wait a moment for those that run: a reply must not come back to a closed session."""
        for _ in self._threads:
            self._jobs.put(None)
        deadline_s = time.monotonic() + CLOSE_GRACE_S
        for thread in self._threads:
            thread.join(max(0.0, deadline_s - time.monotonic()))

    def _receiver(self, name: str) -> Callable[[Query], None]:
        tool, decoder = self._tools[name], self._decoders[name]
        key = tool_key(self._vehicle, self._server, name)

        def receive(query: Query) -> None:
            if not query.payload and self._cancels(query):
                return
            with self._lock:
                full = self._pending >= self._max_pending
                self._pending += not full
            if full:
                self.refused += 1
                self._refuse(query, BUSY, refusal(f"{name} is busy: its queue is full", do="call again in a second"))
            else:
                self._jobs.put(lambda: self._work(tool, decoder, key, query))

        return receive

    def _cancels(self, query: Query) -> bool:
        """Whether it is the end of a call, which is noted."""
        try:
            head = _HEAD.decode(query.attachment)
        except MALFORMED:
            return False
        if head.cancels:
            with self._lock:
                self._cancelled[head.caller, head.call_id] = None
                while len(self._cancelled) > MOST_CANCELLED:
                    self._cancelled.popitem(last=False)
            query.drop()
        return head.cancels

    def _given_up(self, head: CallHead) -> bool:
        with self._lock:
            return (head.caller, head.call_id) in self._cancelled

    def _serve(self) -> None:
        while (job := self._jobs.get()) is not None:
            job()

    def _refuse(self, query: Query, code: int, message: str) -> None:
        query.refuse(_ENCODER.encode(ProtocolError(code=code, message=message)))

    def _work(self, tool: Tool, decoder: ArgumentDecoder, key: str, query: Query) -> None:
        try:
            self._answer(tool, decoder, key, query)
        except Exception:
            self._logger.exception("tool %s broke outside its function", tool.entry.name)
            self._refuse(query, INTERNAL_ERROR, self._broke(f"{tool.entry.name} failed inside the server"))
        finally:
            with self._lock:
                self._pending -= 1

    def _answer(self, tool: Tool, decoder: ArgumentDecoder, key: str, query: Query) -> None:
        received_ns = time.time_ns()
        head, problem = self._check(tool, query)
        if head is None:
            self.refused += 1
            self._refuse(query, *problem)
            return
        if head.deadline_ns < received_ns:
            self.refused += 1
            query.drop()  # the caller no longer waits: work past the deadline is of no use
            self._record(head, tool, query, received_ns, "timeout", b"", "deadline passed before the work began")
            return
        if self._given_up(head):
            self.refused += 1
            query.drop()
            self._record(head, tool, query, received_ns, "unavailable", b"", f"{CANCELLED} before the work began")
            return
        status, payload, error = self._run(tool, decoder, query)
        with self._lock:
            self.served += 1  # before the caller has the answer: what it counts then includes its own call
        if self._given_up(head):
            query.drop()
            error = error or f"{CANCELLED}; the work was done"
        else:
            query.answer(key, payload)
        self._record(head, tool, query, received_ns, status, payload, error)

    def _check(self, tool: Tool, query: Query) -> tuple[CallHead | None, tuple[int, str]]:
        try:
            head = _HEAD.decode(query.attachment)
        except MALFORMED as error:
            why = refusal(f"no valid call head in the attachment: {error}", do="attach a CallHead of proto/tools.py")
            return None, (INVALID_PARAMS, why)
        if head.proto_major != PROTO_VERSION[0]:
            why = f"caller {head.caller!r} speaks message version {head.proto_major}, this server {PROTO_VERSION[0]}"
            return None, (INVALID_PARAMS, refusal(why, do="install the same version of both"))
        if tool.entry.meta.callers and head.caller not in tool.entry.meta.callers:
            why = f"{tool.entry.name} is for {', '.join(tool.entry.meta.callers)} alone"
            return None, (DENIED, refusal(why, do="do without it"))
        if tool.entry.meta.capability == "actuation" and (why := self._authorize(tool, head, query.payload)):
            return None, (DENIED, refusal(f"{tool.entry.name} is refused: {why}", do="get a grant, then confirm"))
        return head, (0, "")

    def _run(self, tool: Tool, decoder: ArgumentDecoder, query: Query) -> tuple[CallStatus, bytes, str]:
        try:
            arguments = decoder.decode(query.payload or b"{}")
        except ArgumentsRefused as error:
            return _failure(str(error))
        try:
            result = tool.run(arguments)
        except ToolFailed as error:
            return _failure(refusal(str(error), field=error.field, do=error.do or SEE_TEXT))
        except Exception as error:
            self._logger.exception("tool %s raised", tool.entry.name)
            return _failure(self._broke(f"{tool.entry.name} failed: {type(error).__name__}"))
        return "ok", b'{"structuredContent":%b,"isError":false}' % _ENCODER.encode(as_object(result)), ""

    def _broke(self, problem: str) -> str:
        return refusal(problem, do=f"look into the log of the service {self._server}, which says why")

    def _record(
        self, head: CallHead, tool: Tool, query: Query, received_ns: int, status: CallStatus, result: bytes, error: str
    ) -> None:
        self._log_call(
            CallRecord(
                call_id=head.call_id,
                caller=head.caller,
                tool=tool.entry.name,
                side="server",
                sent_ns=received_ns,
                done_ns=time.time_ns(),
                status=status,
                arguments_sha256=hashlib.sha256(query.payload).hexdigest(),
                result_sha256=hashlib.sha256(result).hexdigest() if result else "",
                error=error[:200],
                traceparent=head.traceparent[:MOST_TRACEPARENT],
            )
        )


def _failure(message: str) -> tuple[CallStatus, bytes, str]:
    result = CallResult(content=({"type": "text", "text": message[:1000]},), isError=True)
    return "tool_error", _ENCODER.encode(result), message

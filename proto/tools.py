"""Tools on the wire: catalogue, call, result; MCP's tool semantics."""

from typing import Any, Literal

import msgspec

Capability = Literal["context", "diagnostic", "actuation"]
CallStatus = Literal["ok", "tool_error", "protocol_error", "timeout", "unavailable", "busy"]

INVALID_PARAMS = -32602
INTERNAL_ERROR = -32603
BUSY = -32000
DENIED = -32001
CANCELLED = "cancelled by the caller"
"""The error of a call that its caller gave up."""


class Effect(msgspec.Struct, frozen=True, kw_only=True):
    """How an expert's result may enter fusion: names of result fields. Lowering only."""

    target_mps_field: str = ""
    speed_factor_field: str = ""
    headway_factor_field: str = ""
    text_field: str = ""
    confidence_field: str = "confidence"


class ToolMeta(msgspec.Struct, frozen=True, kw_only=True):
    """What MCP's `_meta` of a catalogue entry carries under `drivemcp/tool`."""

    server: str
    capability: Capability = "context"
    deadline_ms: float = 40.0
    answers: tuple[str, ...] = ()
    """Kinds of events that route to this tool without a change to the orchestrator."""
    effect: Effect | None = None
    callers: tuple[str, ...] = ()
    """The services that alone may call it; empty: any."""
    proto_major: int = 1


class ToolEntry(msgspec.Struct, frozen=True, kw_only=True):
    """One entry of `tools/list`."""

    name: str
    title: str
    description: str
    inputSchema: dict[str, Any]
    outputSchema: dict[str, Any]
    annotations: dict[str, bool]
    meta: ToolMeta


class Catalogue(msgspec.Struct, frozen=True, kw_only=True):
    """What `tool/<server>` answers."""

    server: str
    tools: tuple[ToolEntry, ...]
    proto_major: int = 1


class CallHead(msgspec.Struct, frozen=True, kw_only=True):
    """The attachment of a call."""

    call_id: str
    caller: str
    deadline_ns: int
    """Absolute, on the wall clock shared by caller and server (CLOCK_REALTIME)."""
    proto_major: int = 1
    confirmation: str = ""
    grant: str = ""
    traceparent: str = ""
    """Of the trace that the call belongs to (W3C Trace Context); empty: none."""
    cancels: bool = False
    """No call, but the end of one: that of `call_id`. Its deadline is past, so that a server that does not know this field runs nothing."""


class CallResult(msgspec.Struct, frozen=True, kw_only=True):
    """The reply of a call."""

    structuredContent: dict[str, Any] | None = None
    content: tuple[dict[str, Any], ...] = ()
    isError: bool = False


class ProtocolError(msgspec.Struct, frozen=True, kw_only=True):
    """The payload of a Zenoh error reply."""

    code: int
    message: str


class Outcome(msgspec.Struct, frozen=True, kw_only=True):
    """What a caller knows after a call: always one, never an exception."""

    tool: str
    status: CallStatus
    result: dict[str, Any] | None = None
    error: str = ""
    elapsed_ms: float = 0.0
    call_id: str = ""
    arguments: dict[str, Any] = {}
    arguments_sha256: str = ""
    result_sha256: str = ""
    late: bool = False
    """The reply came in a later tick than the call's; `age_ms` says how old it is."""
    age_ms: float = 0.0
    cached: bool = False

    @property
    def ok(self) -> bool:
        """Whether there is a result to use."""
        return self.status == "ok"


class CallRecord(msgspec.Struct, frozen=True, kw_only=True):
    """What is logged of every call, by caller and by server."""

    call_id: str
    caller: str
    tool: str
    side: Literal["caller", "server"]
    sent_ns: int
    done_ns: int
    status: CallStatus
    arguments_sha256: str
    result_sha256: str = ""
    error: str = ""
    traceparent: str = ""


class CallRecords(msgspec.Struct, frozen=True, kw_only=True):
    """The calls of the last 50 ms, in the order in which they ended."""

    records: tuple[CallRecord, ...]

"""What the report reads of a log's messages. Every field has a default, so that logs of older versions are read as far as they go."""

from typing import Any

import msgspec


class Limit(msgspec.Struct, frozen=True):
    """A limit as posted."""

    value: float = 0.0
    unit: str = "km/h"
    mps: float = 0.0
    assumed: bool = False
    advisory: bool = False


class Citation(msgspec.Struct, frozen=True):
    """A paragraph that was cited, in full."""

    document: str = ""
    start: int = 0
    excerpt: str = ""
    section: str = ""


class Reason(msgspec.Struct, frozen=True):
    """A reason behind the advice."""

    source: str = ""
    text: str = ""
    confidence: float = 1.0
    citations: tuple[Citation, ...] = ()


class Event(msgspec.Struct, frozen=True):
    """A detector above its threshold."""

    kind: str = ""
    g: float = 0.0
    eta: float = 0.0
    detail: str = ""


class Call(msgspec.Struct, frozen=True):
    """A tool that was asked."""

    tool: str = ""
    status: str = ""
    error: str = ""
    elapsed_ms: float = 0.0


class Fused(msgspec.Struct, frozen=True):
    """The experts' answers, fused."""

    reasons: tuple[Reason, ...] = ()
    citations: tuple[Citation, ...] = ()


class Decision(msgspec.Struct, frozen=True):
    """The arbiter's decision."""

    kind: str = "SILENT"
    reason: str = ""
    act_withheld: str = ""
    brake_mps2: float = 0.0
    profile: str = ""
    metrics: dict[str, float | bool | None] = {}


class Advisory(msgspec.Struct, frozen=True):
    """What the driver was told."""

    snapshot_stamp_ns: int = 0
    kind: str = "SILENT"
    directive: str = ""
    justification: str = ""
    urgency: str = ""
    hazard: str = ""
    topic: str = ""
    target_mps: float | None = None
    legal_limit: Limit | None = None
    unit: str = "km/h"
    language: str = "en"
    confidence: float = 0.0
    degraded: tuple[str, ...] = ()
    late_tools: tuple[str, ...] = ()
    snapshot_to_advice_ms: float | None = None


class Told(msgspec.Struct, frozen=True):
    """A message beside which a trace keeps sequence and stamp."""

    message: dict[str, Any] = {}


class Inputs(msgspec.Struct, frozen=True):
    """What the tick was decided from."""

    tracks: Told | None = None
    ego: Told | None = None
    conditions: Told | None = None
    degradation: Told | None = None


class Tick(msgspec.Struct, frozen=True):
    """One tick of the trace."""

    tick: int = 0
    stamp_ns: int = 0
    inputs: Inputs = Inputs()
    world: dict[str, Any] = {}
    events: tuple[Event, ...] = ()
    calls: tuple[Call, ...] = ()
    fused: Fused = Fused()
    decision: Decision = Decision()
    advisory: Advisory = Advisory()
    versions: dict[str, str] = {}

    @property
    def speed_mps(self) -> float | None:
        """The ego's speed, as the tick knew it."""
        speed = self.inputs.ego.message.get("speed_mps") if self.inputs.ego is not None else None
        return float(speed) if isinstance(speed, int | float) else None

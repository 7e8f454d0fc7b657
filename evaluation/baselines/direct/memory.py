"""What the Direct methods remember between two ticks; it travels in the orchestrator's state as JSON data."""

import msgspec

from proto.rules import LegalLimit
from services.orchestrator.state import State


class Told(msgspec.Struct, frozen=True, kw_only=True):
    """What the front end answered when it was asked directly."""

    kind: str
    """Of the event because of which it was asked."""
    action: str
    text: str
    confidence: float
    due_ns: int
    """When the answer is there: where lateness is modelled, later than now."""
    latency_ms: float
    limit: LegalLimit | None = None
    hazard: str = ""
    waited: bool = False
    """Whether its words had to wait for the pause after another message, which is no latency."""


class Direct(msgspec.Struct, frozen=True, kw_only=True):
    """Answers on their way, the one heard in this tick, and the last limit told, which stands until another is."""

    waiting: tuple[Told, ...] = ()
    heard: Told | None = None
    limit: Told | None = None
    asked: tuple[tuple[int, str], ...] = ()
    """The signs ahead that were asked about, by track and reading."""
    passed_over: tuple[str, ...] = ()
    """Kinds of events that waited in this tick, as a graver one was asked about."""


def recalled(state: State) -> Direct:
    """The memory that a state holds; a fresh one at first."""
    return msgspec.convert(state.advisor, Direct)


def kept(state: State, direct: Direct) -> State:
    """The state with this memory."""
    return msgspec.structs.replace(state, advisor=msgspec.to_builtins(direct))

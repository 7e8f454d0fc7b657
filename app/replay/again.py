"""Decides every tick again from its trace: the orchestrator's part and the arbiter's, bit for bit. Pure.

The orchestrator's state after a tick is known from a trace that carries it whole (the first, and every hundredth), or by
having decided that tick again with the same result. After a gap, ticks up to the next whole state cannot be decided again;
they are counted as such, never as identical.
"""

from collections.abc import Iterable, Iterator
from typing import Literal

import msgspec

from app.replay.at_hand import AtHand, UnknownProfile
from app.replay.differences import Difference, differences
from drivemcp.errors import UserError
from proto.decision import TraceRecord
from services.arbiter import decide as arbiter
from services.orchestrator.state import State, digest
from services.orchestrator.tick import redecide, state_of

LOCAL = "local"
"""The profile that a decision names which the orchestrator took itself, the arbiter being away."""
SHIPPED = AtHand()
_MEASURED = {"event_to_advice_ms": None, "snapshot_to_advice_ms": None}

Status = Literal["identical", "different", "undecidable"]


class Again(msgspec.Struct, frozen=True, kw_only=True):
    """One tick decided again."""

    tick: int
    status: Status
    differences: tuple[Difference, ...] = ()
    why: str = ""
    """Why it could not be decided again."""


def decide_again(traces: Iterable[TraceRecord], at_hand: AtHand = SHIPPED) -> Iterator[Again]:
    """Every tick, in order. Raises UserError for a whole state that does not fit."""
    before: State | None = None
    last: int | None = None
    for trace in traces:
        if trace.tick == 1:
            before = State()  # a drive begins
        elif last is None or trace.tick != last + 1:
            before = None
        orchestrator, after = _orchestrator(before, trace)
        yield _joined(trace.tick, orchestrator, _arbiter(trace, at_hand))
        before, last = after, trace.tick


def _orchestrator(before: State | None, trace: TraceRecord) -> tuple[Again, State | None]:
    """This tick again, and the state to go on from."""
    if before is None:
        why = "the orchestrator's state before it is not in the log"
        return Again(tick=trace.tick, status="undecidable", why=why), known_state(trace)
    try:
        again = redecide(before, trace)
    except msgspec.ValidationError as error:
        return Again(tick=trace.tick, status="undecidable", why=f"its inputs do not fit: {error}"), known_state(trace)
    if not again.differences:
        return Again(tick=trace.tick, status="identical"), again.ticked.state
    ticked = again.ticked
    pairs = (
        ("events", trace.events, ticked.events),
        ("fused", trace.fused, ticked.fused),
        ("request", trace.request, ticked.request),
        ("decision", trace.decision, ticked.decision),
        (
            "advisory",
            msgspec.structs.replace(trace.advisory, **_MEASURED),
            msgspec.structs.replace(ticked.advisory, **_MEASURED),
        ),
        ("calls", [call.tool for call in trace.calls], [call.tool for call in ticked.outcomes]),
        ("state_sha256", trace.state_sha256, digest(ticked.state)),
    )
    found = tuple(one for name, logged, new in pairs for one in differences(name, logged, new))
    # go on from the logged state where there is one, so that one difference is not told of every later tick
    named = found or tuple(Difference(field=name, logged="", again="otherwise") for name in again.differences)
    return Again(tick=trace.tick, status="different", differences=named), known_state(trace)


def known_state(trace: TraceRecord) -> State | None:
    """The whole state after a tick whose trace carries it. Raises UserError where it does not fit."""
    try:
        return state_of(trace)
    except msgspec.ValidationError as error:
        raise UserError(f"the state of tick {trace.tick} does not fit this version: {error}") from None


def _arbiter(trace: TraceRecord, at_hand: AtHand) -> Again:
    logged = trace.decision
    if trace.request is None or logged.profile == LOCAL:
        return Again(tick=trace.tick, status="identical")  # the orchestrator's own rule, decided again above
    try:
        verdict = arbiter.redecide(trace.request, logged, at_hand.of(logged.profile, logged.profile_sha256))
    except UnknownProfile as error:
        return Again(tick=trace.tick, status="undecidable", why=str(error))
    except msgspec.ValidationError as error:
        return Again(tick=trace.tick, status="undecidable", why=f"the arbiter's inputs do not fit: {error}")
    found = tuple(differences("decision", logged, verdict.decision))
    return Again(tick=trace.tick, status="different" if found else "identical", differences=found)


def _joined(tick: int, one: Again, other: Again) -> Again:
    """Both parts: different if one is, undecidable if one is, identical only if both are."""
    statuses = {one.status, other.status}
    status: Status = (
        "different" if "different" in statuses else "undecidable" if "undecidable" in statuses else "identical"
    )
    return Again(
        tick=tick,
        status=status,
        differences=one.differences + other.differences,
        why="; ".join(part for part in (one.why, other.why) if part),
    )
